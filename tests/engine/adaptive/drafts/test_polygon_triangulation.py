"""Convex polygons in triangles: they are covered, and no triangle is a line."""

from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.bases.arrays import Ints
from service.engine.adaptive.drafts.polygon_triangulation import (
    ALL,
    _choose_among_all,
    _choose_step_by_step,
    list_triangulations,
    list_triples,
    triangulate_polygons,
)
from tests.strategies import Array

FLAT = np.array([1.0, 0, 1, 0, 0, 0, 1])
"""A flat unit square as a `Leaves.form`: E, F, G of its lengths, a, b, c of its heights, and the
allowed deviation."""


def place_around(below: int, right: int, above: int, left: int) -> tuple[Array, Array]:
    """Parameters x, y of the corners of a square, with this many corners more on each side."""
    # Along each side, with its first corner and without its last.
    steps = [np.arange(n + 1) / (n + 1) for n in (below, right, above, left)]
    x = [steps[0], np.ones(right + 1), 1 - steps[2], np.zeros(left + 1)]
    y = [np.zeros(below + 1), steps[1], np.ones(above + 1), 1 - steps[3]]
    return np.concatenate(x), np.concatenate(y)


def triangulate_one(x: Array, y: Array, z: Array, form: Array) -> tuple[Ints, Array]:
    """Triangles of one polygon, and twice their areas."""
    triangles, polygon = triangulate_polygons(
        np.array([len(x)]), x, y, np.stack([x, y, z]), form[:, None]
    )
    assert (polygon == 0).all()
    a, b, c = triangles.T
    areas: Array = (x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a])
    return triangles, areas


@given(st.tuples(*[st.integers(0, 4)] * 4))
def test_polygons_are_covered(between: tuple[int, int, int, int]) -> None:
    """Squares with up to four more corners on each side."""
    x, y = place_around(*between)
    triangles, areas = triangulate_one(x, y, np.zeros(len(x)), FLAT)
    assert len(triangles) == len(x) - 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(2.0)


def test_all_triangulations_are_listed() -> None:
    """All listed triangulations are different, and their number is a Catalan number."""
    for corners in range(4, ALL + 1):
        result = list_triangulations(corners)
        assert list_triples(corners).shape == (3, comb(corners, 3))
        assert len(result) == comb(2 * corners - 4, corners - 2) // (corners - 1)
        assert len({tuple(sorted(way)) for way in result.tolist()}) == len(result)


@given(st.integers(4, ALL), st.integers(0, 99))
def test_both_methods_find_a_triangulation_of_the_least_cost(corners: int, seed: int) -> None:
    """One method compares all triangulations; the other builds them from those of fewer corners."""
    # The cost of each triangle of three corners, in five polygons.
    costs = np.random.default_rng(seed).uniform(size=(comb(corners, 3), 5))
    least = costs[_choose_among_all(costs, corners), np.arange(5)].sum(axis=0)
    assert costs[_choose_step_by_step(costs, corners), np.arange(5)].sum(axis=0) == pytest.approx(
        least
    )


@pytest.mark.parametrize("extra", [0, 6])
def test_edges_run_where_the_surface_does_not_bend(extra: int) -> None:
    """Edges follow a ridge along a diagonal, with few corners or many."""
    x, y = place_around(0, 0, 0, extra)
    for sign, along, across in ((1.0, {0, 2}, {1, 3}), (-1.0, {1, 3}, {0, 2})):
        # E, F, G; a, b, c of the heights (x − y)² or (x + y)², which bend only across the diagonal
        # between the corners `along`; and the allowed deviation.
        form = np.array([1.0, 0, 1, 1, -sign, 1, 0.5])
        triangles, _ = triangulate_one(x, y, np.zeros(len(x)), form)
        edges = [
            {a, b}
            for t in triangles.tolist()
            for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))
        ]
        assert across not in edges
        # With more corners, other edges than the diagonal may follow the ridge.
        assert extra or along in edges


def test_the_diagonal_begins_at_a_straight_corner() -> None:
    """The two sides at corner 0 are one line in space, so a triangle of the corners 3, 0 and 1
    would have no area in space."""
    x, y = place_around(0, 0, 0, 0)
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0]]).T
    triangles, _ = triangulate_polygons(np.array([4]), x, y, points, FLAT[:, None])
    assert {frozenset(t) for t in triangles.tolist()} == {
        frozenset({0, 1, 2}),
        frozenset({0, 2, 3}),
    }


def test_polygons_are_cut_independently() -> None:
    """A polygon has the same triangles together with others and alone."""
    rng = np.random.default_rng(1)
    shapes = [place_around(*between) for between in [(1, 0, 2, 0), (3, 3, 2, 2), (1, 0, 2, 0)] * 3]
    size = np.array([len(x) for x, _ in shapes])
    x, y = (np.concatenate(places) for places in zip(*shapes, strict=True))
    points = rng.uniform(-1, 1, (3, len(x)))
    form = np.concatenate([rng.uniform(-1, 1, (6, len(size))), np.ones((1, len(size)))])
    together, polygon = triangulate_polygons(size, x, y, points, form)
    for k, end in enumerate(np.cumsum(size).tolist()):
        corners = slice(end - int(size[k]), end)
        alone, _ = triangulate_polygons(
            size[k : k + 1], x[corners], y[corners], points[:, corners], form[:, [k]]
        )
        assert np.array_equal(together[polygon == k], alone + corners.start)
