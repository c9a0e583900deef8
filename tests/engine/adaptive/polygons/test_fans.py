"""Convex polygons in triangles: all of them, none of them a line."""

from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.bases.arrays import Ints
from service.engine.adaptive.polygons.fans import ALL, cut, ways
from tests.strategies import Array

FLAT = np.array([1.0, 0, 1, 0, 0, 0, 1])
"""A unit square without height."""


def around(below: int, right: int, above: int, left: int) -> tuple[Array, Array]:
    """A square with so many places between the corners of its sides."""
    rest = [np.arange(n + 1) / (n + 1) for n in (below, right, above, left)]
    x = [rest[0], np.ones(right + 1), 1 - rest[2], np.zeros(left + 1)]
    y = [np.zeros(below + 1), rest[1], np.ones(above + 1), 1 - rest[3]]
    return np.concatenate(x), np.concatenate(y)


def cut_one(x: Array, y: Array, z: Array, form: Array) -> tuple[Ints, Array]:
    """Triangles of one polygon, and twice their areas."""
    points = np.stack([x, y, z], axis=1)[:, :, None]
    corners = np.arange(len(x))[:, None]
    triangles, polygon = cut(corners, x[:, None], y[:, None], points, form[:, None])
    assert (polygon == 0).all()
    a, b, c = triangles.T
    areas: Array = (x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a])
    return triangles, areas


@given(st.tuples(*[st.integers(0, 4)] * 4))
@settings(max_examples=40)
def test_polygons_are_covered(between: tuple[int, int, int, int]) -> None:
    """Few corners or many, however they lie."""
    x, y = around(*between)
    triangles, areas = cut_one(x, y, np.zeros(len(x)), FLAT)
    assert len(triangles) == len(x) - 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(2.0)


def test_all_ways_are_known() -> None:
    """Catalan numbers, each way another one."""
    for corners in range(4, ALL + 1):
        triangles, found = ways(corners)
        assert len(triangles) == comb(corners, 3)
        assert len(found) == comb(2 * corners - 4, corners - 2) // (corners - 1)
        assert len({tuple(sorted(way)) for way in found.tolist()}) == len(found)


@pytest.mark.parametrize("extra", [0, 6])
def test_edges_run_where_the_surface_does_not_bend(extra: int) -> None:
    """A ridge along a diagonal: it is not cut across, with few corners or many."""
    x, y = around(0, 0, 0, extra)
    for sign, ends in ((1.0, {0, 2}), (-1.0, {1, 3})):
        # Heights (x − y)² or (x + y)²: none along the one diagonal, most along the other.
        form = np.array([1.0, 0, 1, 1, -sign, 1, 0.5])
        triangles, _ = cut_one(x, y, np.zeros(len(x)), form)
        across = {1, 3} if sign > 0 else {0, 2}
        edges = [
            {a, b}
            for t in triangles.tolist()
            for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))
        ]
        assert across not in edges
        assert extra or ends in edges


def test_a_straight_corner_keeps_its_area() -> None:
    """Two sides of the square that are one line in space: the diagonal starts between them."""
    x, y = around(0, 0, 0, 0)
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0]])[:, :, None]
    corners = np.arange(4)[:, None]
    triangles, _ = cut(corners, x[:, None], y[:, None], points, FLAT[:, None])
    assert {frozenset(t) for t in triangles.tolist()} == {
        frozenset({0, 1, 2}),
        frozenset({0, 2, 3}),
    }


def test_polygons_do_not_know_each_other() -> None:
    """Cut together or alone, the same triangles."""
    rng = np.random.default_rng(1)
    for between in ((1, 0, 2, 0), (3, 3, 2, 2)):
        x, y = around(*between)
        count, many = len(x), 7
        points = rng.uniform(-1, 1, (count, 3, many))
        form = np.concatenate([rng.uniform(-1, 1, (6, many)), np.ones((1, many))])
        corners = np.arange(count * many).reshape(many, count).T
        wide = np.repeat(x[:, None], many, axis=1), np.repeat(y[:, None], many, axis=1)
        together, polygon = cut(corners, *wide, points, form)
        for k in range(many):
            alone, _ = cut(corners[:, [k]], x[:, None], y[:, None], points[..., [k]], form[:, [k]])
            assert np.array_equal(together[polygon == k], alone)
