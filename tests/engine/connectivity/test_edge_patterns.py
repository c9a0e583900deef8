"""The numbers of equal border points of a grid of patches are those that a comparison finds."""

import numpy as np
import pytest

from service.engine.connectivity.connect import connect
from service.engine.connectivity.edge_patterns import (
    border_points,
    find_pattern,
    number_grid_points,
)
from service.engine.connectivity.equal_points import find_equal_points
from service.engine.connectivity.incidence import Connectivity
from service.surface.batches import TensorPatches
from service.surface.bspline import BsplineSurface


def lower_hills(counts: tuple[int, int], degree: tuple[int, int]) -> TensorPatches:
    """The patches of a B-spline with pseudo-random control points."""
    net = np.random.default_rng(2).normal(size=(*counts, 3))
    (batch,) = BsplineSurface(net, degree).lower().batches
    assert isinstance(batch, TensorPatches)
    return batch


@pytest.mark.parametrize("degree", [(1, 1), (1, 3), (3, 1), (2, 2), (4, 3)])
def test_points_of_a_grid_are_numbered_as_if_all_were_compared(degree: tuple[int, int]) -> None:
    counts = degree[0] + 4, degree[1] + 6
    batch = lower_hills(counts, degree)
    numbers, columns = find_equal_points(border_points(batch)), counts[1] - degree[1]
    assert (number_grid_points(batch, columns) == numbers).all()
    by_columns, compared = find_pattern([batch], numbers, columns), find_pattern([batch], numbers)
    assert by_columns.connectivity.key == compared.connectivity.key
    for name in ("ids", "edges"):
        for ours, theirs in zip(getattr(by_columns, name), getattr(compared, name), strict=True):
            np.testing.assert_array_equal(ours, theirs)
    for ours, theirs in zip(by_columns.sides, compared.sides, strict=True):
        np.testing.assert_array_equal(ours[0], theirs[0])
        np.testing.assert_array_equal(ours[1], theirs[1])
    np.testing.assert_array_equal(by_columns.corners, compared.corners)


def test_splines_of_one_shape_have_one_connectivity() -> None:
    """Whether or not control points are equal that no two corners have in common."""
    net = np.random.default_rng(2).normal(size=(9, 9, 3))
    net[3, 3:5] = net[3, 3]
    found: list[Connectivity] = []
    for points in (net, net + np.arange(9)[:, np.newaxis, np.newaxis] ** 2):
        model = BsplineSurface(points).lower()
        connectivity = connect(model).connectivity
        compared = find_pattern(model.batches, find_equal_points(border_points(model.batches[0])))
        assert connectivity.key == compared.connectivity.key
        found.append(connectivity)
    assert found[0].key == found[1].key
