"""Bounds of gaps between edges and parameter curves, against points in rational arithmetic."""

from fractions import Fraction
from math import sqrt

import numpy as np
import pytest
from hypothesis import given

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.composition import compose_curves
from service.engine.trims.gaps import bound_gaps
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable, SurfaceTable
from tests.engine.trims.tables import (
    build_curves,
    build_surfaces,
    find_curve_point,
    find_surface_point,
    seeds,
)

COUNT = 3


def build_case(seed: int) -> tuple[SurfaceTable, CurveTable, CurveTable]:
    """Surfaces, edges, and parameter curves inside of the domains, all with the range [0, 1]."""
    rng = np.random.default_rng(seed)
    surfaces = build_surfaces(rng, COUNT)
    edges, pcurves = build_curves(rng, COUNT, 3), build_curves(rng, COUNT, 2)
    low, high = surfaces.domains[..., 0], surfaces.domains[..., 1]
    owner = np.repeat(np.arange(COUNT), pcurves.counts)
    share = rng.integers(0, 17, (len(pcurves.points), 2)) / 16
    share[:: max(1, int(rng.integers(1, 4)))] = rng.choice([0.0, 1.0], 2)
    pcurves.points[:] = low[owner] + share * (high - low)[owner]
    return surfaces, edges, pcurves


def find_gap(tables: tuple[SurfaceTable, CurveTable, CurveTable], k: int, share: Fraction) -> float:
    """The distance between edge k and its image, exactly but for the root."""
    surfaces, edges, pcurves = tables
    (a, b), (c, d) = (
        [Fraction(t) for t in table.domains[k].tolist()] for table in (pcurves, edges)
    )
    u, v = find_curve_point(pcurves, k, a + (b - a) * share)
    image = find_surface_point(surfaces, k, u, v)
    point = find_curve_point(edges, k, c + (d - c) * share)
    return sqrt(sum((x - y) ** 2 for x, y in zip(point, image, strict=True)))


@given(seeds)
def test_no_point_of_an_edge_is_beyond_its_bound(seed: int) -> None:
    tables = build_case(seed)
    surfaces = ClosedSurfaces.open(FaceSurfaces.of(tables[0]))
    edges, pcurves = (
        Splines.of(table).move_ranges(np.zeros(COUNT), np.ones(COUNT)) for table in tables[1:]
    )
    every = np.arange(COUNT)
    gaps = bound_gaps(surfaces, every, edges, every, pcurves)
    finer = bound_gaps(surfaces, every, edges, every, pcurves, nodes=8.0)
    worst = np.array(
        [max(find_gap(tables, k, Fraction(i, 8)) for i in range(9)) for k in range(COUNT)]
    )
    assert (worst <= gaps.bound).all()
    assert (worst <= finer.bound).all()
    assert (gaps.seen <= gaps.bound).all()
    is_polynomial = ~(tables[0].is_rational | tables[1].is_rational | tables[2].is_rational)
    # cos(π / 4) and cos(π / 16): no bound of a polynomial is looser, but for rounding.
    assert (gaps.bound <= gaps.seen * 1.4143 + 1e-9)[is_polynomial].all()
    assert (finer.bound <= finer.seen * 1.0197 + 1e-9)[is_polynomial].all()


@given(seeds)
def test_edges_that_are_compositions_have_gaps_of_rounding(seed: int) -> None:
    tables = build_case(seed)
    surfaces = ClosedSurfaces.open(FaceSurfaces.of(tables[0]))
    pcurves, every = Splines.of(tables[2]), np.arange(COUNT)
    edges = compose_curves(surfaces, every, pcurves, 1e-9)
    assert (bound_gaps(surfaces, every, edges, every, pcurves).bound < 1e-6).all()


def build_curve(dimension: int, points: list[list[float]]) -> Splines:
    """A Bézier curve."""
    degree = len(points) - 1
    return Splines.of(
        CurveTable(
            np.array([degree]),
            np.array([degree + 1]),
            np.array(points, float).reshape(-1, dimension),
            np.ones(degree + 1),
            np.array([False]),
            np.repeat([0.0, 1.0], degree + 1),
        )
    )


def build_plane() -> ClosedSurfaces:
    """The square [0, 10]² at height 0, with the domain [0, 1]²."""
    points = np.array([[0.0, 0, 0], [0, 10, 0], [10, 0, 0], [10, 10, 0]])
    table = SurfaceTable(
        np.array([[1, 1]]),
        np.array([[2, 2]]),
        points,
        np.ones(4),
        np.array([False]),
        np.tile([0.0, 0, 1, 1], 2),
    )
    return ClosedSurfaces.open(FaceSurfaces.of(table))


@pytest.mark.parametrize("height", [0.0, 1e-7, 0.25, 3.0])
def test_an_arch_over_a_plane_has_its_height_as_gap(height: float) -> None:
    edge = build_curve(3, [[0, 0, 0], [5, 5, 2 * height], [10, 10, 0]])
    pcurve = build_curve(2, [[0, 0], [1, 1]])
    zero: Ints = np.zeros(1, np.intp)
    bound: FloatArray = bound_gaps(build_plane(), zero, edge, zero, pcurve, nodes=64.0).bound
    assert height <= bound[0] <= height * 1.001 + 1e-12


def test_a_parameter_curve_with_another_speed_has_a_gap() -> None:
    edge = build_curve(3, [[0, 0, 0], [10, 0, 0]])
    pcurve = build_curve(2, [[0, 0], [0, 0], [1, 0]])  # t² in place of t
    zero: Ints = np.zeros(1, np.intp)
    bound = bound_gaps(build_plane(), zero, edge, zero, pcurve, nodes=64.0).bound[0]
    assert 2.5 <= bound < 2.51
