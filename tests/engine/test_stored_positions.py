"""Grids of positions: their steps, and exact sums of multiples of a step."""

from math import log2

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from service.engine.stored_positions import (
    FLOAT32_MAX,
    MAX_NUMBER,
    MAX_ROUNDING,
    MAX_STEPS,
    find_step,
    round_to_grid,
)

coordinates = st.floats(-FLOAT32_MAX, FLOAT32_MAX, allow_nan=False)
boxes = st.lists(coordinates, min_size=6, max_size=6).map(
    lambda six: np.sort(np.array(six).reshape(2, 3), axis=0)
)


@given(box=boxes)
@example(box=np.zeros((2, 3)))
@example(box=np.array([[0.0, 0, 0], [5e-324, 0, 0]]))
@example(box=np.full((2, 3), FLOAT32_MAX))
@example(box=np.array([[-FLOAT32_MAX] * 3, [FLOAT32_MAX] * 3]))
@example(box=np.array([[4.6e6, 0, 0], [4.6e6 + 1e-9, 0, 0]]))
def test_16_bits_can_number_all_multiples_in_a_box(box: np.ndarray) -> None:
    low, high = box
    step = find_step(low, high)
    assert log2(step).is_integer()
    ends = round_to_grid(box, step)
    assert np.abs(ends).max() <= FLOAT32_MAX
    steps = ends / step
    assert (steps == np.rint(steps)).all()
    assert (steps[1] - steps[0] <= MAX_NUMBER).all()
    # Near the largest float32, a coordinate may have no multiple above it.
    has_multiples = np.abs(box) < FLOAT32_MAX - step
    assert np.abs(ends - box)[has_multiples].max(initial=0.0) <= step / 2


@pytest.mark.parametrize("extent", [1.0, 0.75, 3.0, 65533 * 2.0**-7, 65533.1, 1e-30, 1e30])
def test_the_step_is_the_least_power_of_two_with_which_16_bits_suffice(extent: float) -> None:
    step = find_step(np.zeros(3), np.array([extent, 0, extent / 3]))
    assert step / 2 * MAX_STEPS < extent <= step * MAX_STEPS


def test_multiples_stay_and_other_points_move_by_at_most_half_a_diagonal() -> None:
    rng = np.random.default_rng(5)
    points = rng.uniform(-3, 3, (1000, 3))
    step = find_step(points.min(axis=0), points.max(axis=0))
    rounded = round_to_grid(points, step)
    assert (round_to_grid(rounded, step) == rounded).all()
    largest_movement = np.linalg.norm(rounded - points, axis=1).max()
    assert 0.6 * MAX_ROUNDING * step < largest_movement <= MAX_ROUNDING * step
    # Relative to an origin on the grid that is not too far, float32 stores all positions exactly.
    for origin in (np.zeros(3), round_to_grid(np.array([1e3, -7.0, 0.1]), step)):
        assert ((rounded - origin).astype(np.float32).astype(np.float64) + origin == rounded).all()


def test_zeros_are_not_negative() -> None:
    assert not np.signbit(round_to_grid(np.array([-0.0, -1e-9]), 1.0)).any()
