"""The class of one Bézier patch: its lowering, its copies of arrays, and its issues."""

import numpy as np
import pytest
from hypothesis import given

from service.errors import InvalidRequest, Issue
from service.surface.bezier import BezierSurface
from service.surface.lowered import Part
from tests.strategies import Array, weighted_nets

FLAT = np.stack([*np.meshgrid([0.0, 1, 2], [0.0, 1, 2, 3], indexing="ij"), np.zeros((3, 4))], -1)


def list_issues(**fields: object) -> tuple[Issue, ...]:
    """The issues of a surface with these fields."""
    with pytest.raises(InvalidRequest) as caught:
        BezierSurface(**fields)  # type: ignore[arg-type]
    return caught.value.issues


@given(weighted_nets())
def test_a_bezier_surface_is_lowered_to_one_patch(
    net_and_weights: tuple[Array, Array | None],
) -> None:
    """The model has one batch of one patch, with the points and weights of the surface."""
    net, weights = net_and_weights
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


def test_a_surface_is_frozen_and_copies_the_arrays_of_the_caller() -> None:
    """Later changes of these arrays have no effect; the arrays of the surface are read-only."""
    net, weights = FLAT.copy(), np.ones((3, 4))
    surface = BezierSurface(net, weights)
    net[:], weights[:] = 7, 7
    np.testing.assert_array_equal(surface.control_net, FLAT)
    np.testing.assert_array_equal(surface.weights, np.ones((3, 4)))
    (batch,) = surface.lower().batches
    for array in (surface.control_net, surface.weights, batch.points, batch.weights):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError):
        setattr(surface, "up", "z")  # noqa: B010 - a plain assignment is refused by mypy already


def test_minus_zero_becomes_zero() -> None:
    """Surfaces that are equal must have equal bytes, because their hash is a key of caches."""
    net = FLAT.copy()
    net[1, 1, 2] = -0.0
    assert not np.signbit(BezierSurface(net).control_net).any()


def test_at_most_20_coordinates_have_issues() -> None:
    """All 48 coordinates are invalid; issues are in the order of the coordinates."""
    issues = list_issues(control_net=np.full((4, 4, 3), np.nan))
    assert len(issues) == 20
    assert [i.pointer for i in issues[:4]] == [
        "/control_net/0/0/0",
        "/control_net/0/0/1",
        "/control_net/0/0/2",
        "/control_net/0/1/0",
    ]
