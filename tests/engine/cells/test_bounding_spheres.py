"""Queries with small limits of memory, on a model whose patches intersect each other.

A query that reaches a limit reports wider intervals, or no hits of some rays. All reported results
are right.
"""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.nets.query_nets import surface_nets
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.surface.bspline import BsplineSurface

RNG = np.random.default_rng(12)
CLOUD = BsplineSurface(RNG.normal(size=(18, 18, 3)), (3, 3)).lower()
"""225 patches that intersect each other."""

POINTS, DIRECTIONS = RNG.normal(size=(2, 12, 3))


LIMITS = pytest.mark.parametrize(
    ("open_pairs", "spheres"), [(150, 1 << 20), (1 << 20, 60), (150, 60)]
)
"""The most pairs that are open on a level, and the most that the tree leaves for the whole query,
without counting 4 pairs of each point or ray."""


def test_spheres_have_the_centres_of_their_cells() -> None:
    cells = CellTree(surface_nets(CLOUD.batches), WorkLimits(pairs=0, of_item=0))
    tree = BoundingSpheres(cells)
    assert len(tree.levels) == 3
    # The first three rows of `level` and of `models` are the coordinates of centres.
    for level, middle in zip(tree.levels, tree.middles, strict=True):
        np.testing.assert_array_equal(level[:3], cells.models[:3, middle])


@LIMITS
def test_closest_points_with_small_limits_are_right(open_pairs: int, spheres: int) -> None:
    """With 60 pairs in all, some points are not `reached`: they have wider intervals.

    A small limit of open pairs alone changes no result.
    """
    query = ProjectQuery(POINTS, 1e-6)
    reference = project_on_surface(CLOUD, query)
    limits = replace(query.limits, open=open_pairs, spheres=spheres, free_spheres=4)
    result = project_on_surface(CLOUD, replace(query, limits=limits))
    low, high = result["distance_bounds"].T
    assert (low <= reference["distance_bounds"][:, 1]).all()
    assert (high >= reference["distance_bounds"][:, 0]).all()
    is_reached = result["reached"]
    assert is_reached.all() == (spheres > 60)
    np.testing.assert_allclose(
        result["distances"][is_reached], reference["distances"][is_reached], rtol=1e-5
    )
    distances = np.linalg.norm(result["positions"] - POINTS, axis=1)
    np.testing.assert_allclose(distances, result["distances"], rtol=1e-9)


@LIMITS
def test_hits_of_rays_with_small_limits_are_right(open_pairs: int, spheres: int) -> None:
    """With 60 pairs in all, some rays are not `reached`: they have no hits.

    A small limit of open pairs alone changes no result.
    """
    query = RayQuery(POINTS, DIRECTIONS, only_first=False)
    reference = intersect_rays(CLOUD, query, max_hits=1 << 20)
    limits = replace(query.limits, open=open_pairs, spheres=spheres, free_spheres=4)
    result = intersect_rays(CLOUD, replace(query, limits=limits), max_hits=1 << 20)
    is_reached = result["reached"]
    assert reference["reached"].all()
    assert is_reached.all() == (spheres > 60)
    np.testing.assert_array_equal(result["counts"], np.where(is_reached, reference["counts"], 0))
    np.testing.assert_allclose(result["t"], reference["t"][is_reached[reference["ray"]]], rtol=1e-9)
