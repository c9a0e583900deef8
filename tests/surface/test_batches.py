"""Batches of patches: bounding box, and sides that collapse to one point."""

import numpy as np
import pytest

from service.surface.batches import TensorPatches
from service.surface.sides import take_side


@pytest.mark.parametrize("count", [1, 2, 63, 64, 81])
def test_bounds_and_collapsed_sides_of_any_number_of_patches(count: int) -> None:
    """A side whose ends are equal but whose inner points differ is not collapsed.

    Of four patches, the first has a collapsed side u = 0, the second a collapsed side v = 1, the
    third three equal corners, and the fourth no equal points.
    """
    points = np.random.default_rng(count).uniform(-1, 1, (count, 3, 4, 3))
    points[::4, 0] = points[::4, :1, 0]
    points[1::4, :, -1] = points[1::4, :1, -1]
    points[2::4, -1, 0] = points[2::4, -1, -1] = points[2::4, 0, 0]
    batch, flat = TensorPatches(points), points.reshape(-1, 3)
    np.testing.assert_array_equal(batch.bounds, (flat.min(axis=0), flat.max(axis=0)))
    sides = (take_side(points, number) for number in range(4))
    is_collapsed = np.stack([(s == s[:, :1]).all(axis=(1, 2)) for s in sides], axis=1)
    np.testing.assert_array_equal(batch.collapsed, is_collapsed)
