"""Bounds of points, of few by columns and of many by rows of `FOLD` points."""

import numpy as np
import pytest

from service.engine.extent import FOLD, MAX_TRANSPOSED, find_extent


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    "count", [1, 77, MAX_TRANSPOSED, MAX_TRANSPOSED + 1, MAX_TRANSPOSED + FOLD]
)
def test_bounds_are_the_least_and_largest_coordinates(count: int, dtype: type[np.floating]) -> None:
    """More points than `MAX_TRANSPOSED` are reduced by rows; the last row may be incomplete."""
    points = np.random.default_rng(count).standard_normal((count, 3)).astype(dtype)
    # The same points, with x and z exchanged, and in reverse order: views with negative strides.
    for view in (points, points[:, ::-1], points[::-1]):
        low, high = find_extent(view)
        assert low.dtype == high.dtype == dtype
        np.testing.assert_array_equal(low, view.min(axis=0))
        np.testing.assert_array_equal(high, view.max(axis=0))
