"""One Bézier patch: what is accepted, what is refused and how it is said."""

import numpy as np
import pytest
from hypothesis import given

from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface
from service.surface.checks import MAX_WEIGHT_RATIO
from service.surface.lowered import Part
from tests.strategies import Array, weighted_nets

FLAT = np.stack([*np.meshgrid([0.0, 1, 2], [0.0, 1, 2, 3], indexing="ij"), np.zeros((3, 4))], -1)


def issues_of(**fields: object) -> tuple[Issue, ...]:
    """What is wrong with the surface of these fields."""
    with pytest.raises(InvalidRequest) as caught:
        BezierSurface(**fields)  # type: ignore[arg-type]
    return caught.value.issues


def spoilt(value: float, *place: int) -> np.ndarray:
    """The flat net with one coordinate replaced."""
    net = FLAT.copy()
    net[place] = value
    return net


@given(weighted_nets())
def test_lowers_to_the_patch_it_is(weighted: tuple[Array, Array | None]) -> None:
    """One batch of one patch, the numbers untouched."""
    net, weights = weighted
    model = BezierSurface(net, weights, up="z", name="bowl").lower()
    (batch,) = model.batches
    np.testing.assert_array_equal(batch.points, net[None])
    assert batch.degree == (net.shape[0] - 1, net.shape[1] - 1)
    assert (batch.count, model.patch_count) == (1, 1)
    assert (model.name, model.up, model.parts) == ("bowl", "z", (Part("bowl", 0, 1),))
    if weights is None:
        assert batch.weights is None
    else:
        np.testing.assert_array_equal(batch.weights, weights[None])


def test_is_frozen_and_keeps_no_hold_on_its_input() -> None:
    """Changing the caller's array afterwards changes nothing; the own arrays cannot be written."""
    mine, weights = FLAT.copy(), np.ones((3, 4))
    surface = BezierSurface(mine, weights)
    mine[:], weights[:] = 7, 7
    np.testing.assert_array_equal(surface.control_net, FLAT)
    np.testing.assert_array_equal(surface.weights, np.ones((3, 4)))
    (batch,) = surface.lower().batches
    for array in (surface.control_net, surface.weights, batch.points, batch.weights):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError):
        setattr(surface, "up", "z")  # noqa: B010 - a plain assignment is refused by mypy already


def test_minus_zero_is_zero() -> None:
    """Equal surfaces have equal bytes."""
    net = BezierSurface(spoilt(-0.0, 1, 1, 2)).control_net
    assert not np.signbit(net).any()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_refuses_numbers_that_are_not_finite(value: float) -> None:
    """The pointer names the coordinate."""
    (issue,) = issues_of(control_net=spoilt(value, 2, 3, 1))
    assert (issue.code, issue.pointer) == ("not_finite", "/control_net/2/3/1")
    assert issue.got
    assert issue.needed


@pytest.mark.parametrize("value", [3.5e38, -3.4029e38, 1e300])
def test_refuses_coordinates_beyond_single_precision(value: float) -> None:
    """They could not be written in glTF or STL."""
    (issue,) = issues_of(control_net=spoilt(value, 0, 1, 0))
    assert (issue.code, issue.pointer) == ("coordinate_too_large", "/control_net/0/1/0")


def test_names_at_most_twenty_faults() -> None:
    """Every coordinate is wrong; the first twenty are told, in order."""
    issues = issues_of(control_net=np.full((4, 4, 3), np.nan))
    assert len(issues) == 20
    assert [i.pointer for i in issues[:4]] == [
        "/control_net/0/0/0",
        "/control_net/0/0/1",
        "/control_net/0/0/2",
        "/control_net/0/1/0",
    ]


@pytest.mark.parametrize("shape", [(1, 2), (2, 1), (1, 1), (0, 2), (2, 0), (0, 0)])
def test_refuses_fewer_than_two_by_two_points(shape: tuple[int, int]) -> None:
    """A row of points is a curve, not a surface."""
    (issue,) = issues_of(control_net=np.zeros((*shape, 3)))
    assert (issue.code, issue.pointer) == ("too_few_points", "/control_net")
    assert "2 × 2" in issue.needed


@pytest.mark.parametrize("shape", [(3, 4, 2), (3, 4, 4), (3, 4, 0), (3, 3), (1, 3, 4, 3), (4,), ()])
def test_refuses_points_of_another_dimension(shape: tuple[int, ...]) -> None:
    """A control point has exactly three coordinates."""
    (issue,) = issues_of(control_net=np.zeros(shape))
    assert (issue.code, issue.pointer) == ("wrong_dimension", "/control_net")


def test_refuses_absurd_degrees() -> None:
    """Degree 64 is the last one; the refusal says why."""
    assert BezierSurface(np.zeros((65, 2, 3))).degree == (64, 1)
    (issue,) = issues_of(control_net=np.zeros((2, 66, 3)))
    assert (issue.code, issue.pointer) == ("degree_too_high", "/control_net")
    assert "65" in issue.got
    assert "64" in issue.needed


@pytest.mark.parametrize(
    ("value", "code"),
    [
        (0.0, "weight_not_positive"),
        (-1.0, "weight_not_positive"),
        (np.nan, "not_finite"),
        (np.inf, "not_finite"),
    ],
)
def test_refuses_weights_that_are_not_positive_numbers(value: float, code: str) -> None:
    """The pointer names the weight."""
    weights = np.ones((3, 4))
    weights[1, 2] = value
    (issue,) = issues_of(control_net=FLAT, weights=weights)
    assert (issue.code, issue.pointer) == (code, "/weights/1/2")


@pytest.mark.parametrize("shape", [(4, 3), (3, 4, 1), (12,), (2, 4), ()])
def test_refuses_weights_of_another_shape(shape: tuple[int, ...]) -> None:
    """One weight a control point, and the answer says how many that is."""
    (issue,) = issues_of(control_net=FLAT, weights=np.ones(shape))
    assert (issue.code, issue.pointer) == ("weights_shape", "/weights")
    assert "3 × 4" in issue.needed


def test_refuses_weights_too_far_apart() -> None:
    """Lighter points would drown in rounding."""
    weights = np.ones((3, 4))
    weights[0, 0] = 0.5 / MAX_WEIGHT_RATIO
    (issue,) = issues_of(control_net=FLAT, weights=weights)
    assert (issue.code, issue.pointer) == ("weight_ratio", "/weights")


def test_refuses_another_vertical_axis() -> None:
    """Up is y or z; what was sent is not repeated."""
    (issue,) = issues_of(control_net=FLAT, up="<script>")
    assert (issue.code, issue.pointer) == ("wrong_value", "/up")
    assert "script" not in issue.got + issue.message + issue.needed
