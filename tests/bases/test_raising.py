"""Degrees in which weights are positive: the least ones, and the same net in them."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases import triangle
from service.bases.arrays import FloatArray
from service.bases.knots import clamped_knots, periodic_knots
from service.bases.raising import (
    BezierDirection,
    Degrees,
    Raising,
    SplineDirection,
    TriangleDirection,
    find_degrees,
)

FLOOR = 1e-8


def raise_net(weights: FloatArray, highest: int = 64, most: int = 10**6) -> tuple[Degrees, bool]:
    directions = [BezierDirection(axis, n - 1) for axis, n in enumerate(weights.shape)]

    def fits(degrees: Degrees) -> bool:
        return int(np.prod(np.array(degrees) + 1)) <= most

    return find_degrees(weights[..., np.newaxis], directions, FLOOR, highest, fits)


A, B, ONES = np.array([1.0, 0, 1]), np.array([1.0, 0, 0, 1]), np.ones(4)
NETS = {
    "along u": (np.outer(A, ONES), (3, 3)),
    "along v": (np.outer(ONES, A), (3, 3)),
    "along u more": (np.outer(B, ONES), (5, 3)),
    "both": (np.outer(A, A), (3, 3)),
    "both, not alike": (np.outer(A, B), (3, 5)),
    "the middle of 3 × 3": (1 - np.outer([0, 1.0, 0], [0, 1, 0]), (3, 3)),
    "one of 3 × 5": (1 - np.outer([0, 1.0, 0], [0, 0, 1, 0, 0]), (2, 5)),
}


@pytest.mark.parametrize(("weights", "expected"), NETS.values(), ids=NETS)
def test_degrees_are_least_and_those_of_a_transposed_net_transposed(
    weights: FloatArray, expected: Degrees
) -> None:
    assert raise_net(weights) == (expected, True)
    assert raise_net(weights.T) == (expected[::-1], True)


def test_limits_end_the_search() -> None:
    assert raise_net(np.outer(A, A), highest=2) == ((2, 2), False)
    assert raise_net(np.outer(A, A), most=15) == ((2, 2), False)
    assert raise_net(np.outer(A, A), most=16) == ((3, 3), True)
    assert raise_net(np.outer(A, ONES), most=16) == ((3, 3), True)
    assert raise_net(np.outer([1, -1.0, 1], ONES)) == ((64, 64), False)


@given(data=st.data())
def test_no_direction_can_be_lowered(data: st.DataObject) -> None:
    shape = data.draw(st.tuples(st.integers(2, 5), st.integers(2, 5)))
    weights = np.random.default_rng(data.draw(st.integers(0, 2**32))).uniform(-0.3, 1, shape)
    weights[[0, 0, -1, -1], [0, -1, 0, -1]] = 1
    degrees, is_enough = raise_net(weights, most=2000)
    directions = [BezierDirection(axis, n - 1) for axis, n in enumerate(shape)]

    def find_least(*new: int) -> float:
        return float(Raising(directions, new).apply(weights[..., np.newaxis]).min())

    if is_enough:
        assert find_least(*degrees) > 0
    start = tuple(n - 1 for n in shape)
    if is_enough and degrees != start:
        p, q = degrees
        lower = [(p - 1, q)] * (p > start[0]) + [(p, q - 1)] * (q > start[1])
        assert sum(find_least(*each) < 2 * FLOOR for each in lower) >= len(lower) - 1


def test_estimates_are_elevations_with_other_rounding() -> None:
    rng = np.random.default_rng(2)
    values = rng.normal(size=(3, 5, 10, 2))
    for direction in (
        BezierDirection(1, 4),
        TriangleDirection(2, 3),
        SplineDirection(1, 2, clamped_knots(5, 2)),
        SplineDirection(1, 3, periodic_knots(5, 3), is_periodic=True),
    ):
        for degree in (direction.degree + 1, direction.degree + 3):
            exact, estimate = (
                change(values, degree) for change in (direction.elevate, direction.estimate)
            )
            assert exact.shape[direction.axis] == direction.count(degree)
            np.testing.assert_allclose(estimate, exact, atol=1e-14)


def test_shares_of_triangles_are_those_of_the_steps() -> None:
    for low, high in ((1, 4), (3, 4), (5, 9)):
        net = np.eye(triangle.count_points(low))
        steps = triangle.elevate((net, None), high)[0]
        np.testing.assert_allclose(triangle.elevation_shares(low, high), steps, atol=1e-15)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_blocks_do_not_change_a_bit(order: Sequence[int], monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(3).normal(size=(3, 4, 4)).transpose(*order, 2)
    raising = Raising(
        [BezierDirection(axis, n - 1) for axis, n in enumerate(values.shape[:2])], (5, 6)
    )
    whole = raising.apply(values)
    monkeypatch.setattr("service.bases.raising.BLOCK_POINTS", 1)
    assert np.array_equal(raising.apply(values), whole)
