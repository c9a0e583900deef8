"""The folded reduction gives the exact bounds."""

import numpy as np
import pytest

from service.engine.extent import FOLD, find_extent


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [1, FOLD, 4 * FOLD - 1, 4 * FOLD, 4 * FOLD + 1, 5 * FOLD + 77])
def test_folded_bounds_are_the_bounds(count: int, dtype: type[np.floating]) -> None:
    """For numbers of points that fold evenly, and for others."""
    points = np.random.default_rng(count).standard_normal((count, 3)).astype(dtype)
    for given in (points, points[:, ::-1], points[::-1]):
        low, high = find_extent(given)
        assert low.dtype == high.dtype == dtype
        np.testing.assert_array_equal(low, given.min(axis=0))
        np.testing.assert_array_equal(high, given.max(axis=0))
