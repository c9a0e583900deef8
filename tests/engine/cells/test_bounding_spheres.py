"""Queries with small limits of memory, on a model whose patches intersect each other.

A query that reaches a limit reports wider intervals, or no hits of some rays. All reported results
are right.
"""

import numpy as np
import pytest

from service.engine.cells import bounding_spheres as patch_tree
from service.engine.cells.tree import CellTree
from service.engine.closest import search as closest
from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.nets.query_nets import surface_nets
from service.engine.rays import search as rays
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.surface.bspline import BsplineSurface

RNG = np.random.default_rng(12)
CLOUD = BsplineSurface(RNG.normal(size=(18, 18, 3)), (3, 3)).lower()
"""225 patches that intersect each other."""

POINTS, DIRECTIONS = RNG.normal(size=(2, 12, 3))


def set_limits(monkeypatch: pytest.MonkeyPatch, *, max_open_pairs: int, max_pairs: int) -> None:
    """Sets small limits of the pairs (point or ray, sphere or cell) of a query.

    At most `max_open_pairs` pairs are open on a level of the tree. The tree leaves at most
    `max_pairs` pairs for the whole query, without counting 4 pairs of each point or ray.
    """
    monkeypatch.setattr(patch_tree, "MAX_OPEN_PAIRS", max_open_pairs)
    for module in (closest, rays):
        monkeypatch.setattr(module, "MAX_PAIRS_IN_TREE", max_pairs)
        monkeypatch.setattr(module, "FREE_PAIRS", 4)


def test_spheres_have_the_centres_of_their_cells() -> None:
    cells = CellTree(surface_nets(CLOUD.batches))
    tree = patch_tree.PatchTree(cells)
    assert len(tree.levels) == 3
    # The first three rows of `level` and of `models` are the coordinates of centres.
    for level, middle in zip(tree.levels, tree.middles, strict=True):
        np.testing.assert_array_equal(level[:3], cells.models[:3, middle])


@pytest.mark.parametrize(
    ("max_open_pairs", "max_pairs"), [(150, 1 << 20), (1 << 20, 60), (150, 60)]
)
def test_closest_points_with_small_limits_are_right(
    monkeypatch: pytest.MonkeyPatch, max_open_pairs: int, max_pairs: int
) -> None:
    """With 60 pairs in all, some points are not `reached`: they have wider intervals.

    A small limit of open pairs alone changes no result.
    """
    reference = project_on_surface(CLOUD, ProjectQuery(POINTS, 1e-6))
    set_limits(monkeypatch, max_open_pairs=max_open_pairs, max_pairs=max_pairs)
    result = project_on_surface(CLOUD, ProjectQuery(POINTS, 1e-6))
    low, high = result["distance_bounds"].T
    assert (low <= reference["distance_bounds"][:, 1]).all()
    assert (high >= reference["distance_bounds"][:, 0]).all()
    is_reached = result["reached"]
    assert is_reached.all() == (max_pairs > 60)
    np.testing.assert_allclose(
        result["distances"][is_reached], reference["distances"][is_reached], rtol=1e-5
    )
    distances = np.linalg.norm(result["positions"] - POINTS, axis=1)
    np.testing.assert_allclose(distances, result["distances"], rtol=1e-9)


@pytest.mark.parametrize(
    ("max_open_pairs", "max_pairs"), [(150, 1 << 20), (1 << 20, 60), (150, 60)]
)
def test_hits_of_rays_with_small_limits_are_right(
    monkeypatch: pytest.MonkeyPatch, max_open_pairs: int, max_pairs: int
) -> None:
    """With 60 pairs in all, some rays are not `reached`: they have no hits.

    A small limit of open pairs alone changes no result.
    """
    query = RayQuery(POINTS, DIRECTIONS, only_first=False)
    reference = intersect_rays(CLOUD, query, max_hits=1 << 20)
    set_limits(monkeypatch, max_open_pairs=max_open_pairs, max_pairs=max_pairs)
    result = intersect_rays(CLOUD, query, max_hits=1 << 20)
    is_reached = result["reached"]
    assert reference["reached"].all()
    assert is_reached.all() == (max_pairs > 60)
    np.testing.assert_array_equal(result["counts"], np.where(is_reached, reference["counts"], 0))
    np.testing.assert_allclose(result["t"], reference["t"][is_reached[reference["ray"]]], rtol=1e-9)
