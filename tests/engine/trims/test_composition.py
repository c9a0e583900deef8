"""Curves S(c(t)) against rational arithmetic."""

from fractions import Fraction

import numpy as np
from hypothesis import given

from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.composition import MOST, compose_curves
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.spline_tables import CurveTable
from tests.engine.trims.tables import find_curve_point, find_surface_point, seeds
from tests.engine.trims.test_gaps import COUNT, build_case


@given(seeds)
def test_compositions_are_on_the_surface(seed: int) -> None:
    surfaces, _, pcurves = build_case(seed)
    every = np.arange(COUNT)
    curves = compose_curves(
        ClosedSurfaces.open(FaceSurfaces.of(surfaces)), every, Splines.of(pcurves), 1e-10
    )
    assert (curves.degree <= MOST).all()
    for k in range(COUNT):
        first, last = (Fraction(t) for t in pcurves.domains[k].tolist())
        for i in range(9):
            t = first + (last - first) * Fraction(i, 8)
            exact = find_surface_point(surfaces, k, *find_curve_point(pcurves, k, t))
            point = curves.evaluate(np.array([k]), np.array([float(t)]))[0]
            np.testing.assert_allclose(point, [float(x) for x in exact], rtol=0, atol=1e-9)


def test_curves_of_high_degree_are_interpolated() -> None:
    surfaces, _, _ = build_case(7)
    rng = np.random.default_rng(7)
    degree = MOST
    low, high = surfaces.domains[0].T
    share = np.linspace(0, 1, degree + 1)[:, np.newaxis] * 0.6 + 0.2 * rng.random((degree + 1, 2))
    table = CurveTable(
        np.array([degree]),
        np.array([degree + 1]),
        low + share * (high - low),
        np.ones(degree + 1),
        np.array([False]),
        np.repeat([0.0, 1.0], degree + 1),
    )
    zero = np.zeros(1, np.intp)
    closed = ClosedSurfaces.open(FaceSurfaces.of(surfaces))
    pcurves = Splines.of(table)
    curve = compose_curves(closed, zero, pcurves, 1e-10)
    assert curve.degree[0] < MOST
    t = np.linspace(0, 1, 200)
    zeros = np.zeros(200, np.intp)
    image = closed.evaluate(zeros, pcurves.evaluate(zeros, t))
    assert np.abs(curve.evaluate(zeros, t) - image).max() < 1e-9


def test_coordinates_that_are_constant_add_no_degree() -> None:
    surfaces, _, pcurves = build_case(3)
    count = pcurves.counts[0]
    pcurves.points[:count, 0] = pcurves.points[0, 0]
    pcurves.is_rational[0], pcurves.weights[:count] = False, 1.0
    one = np.zeros(1, np.intp)
    curve = compose_curves(
        ClosedSurfaces.open(FaceSurfaces.of(surfaces)), one, Splines.of(pcurves).take(one), 1e-10
    )
    assert curve.degree[0] == surfaces.degrees[0, 1] * pcurves.degrees[0]


def test_a_parameter_curve_that_is_a_point_gives_a_point() -> None:
    surfaces, _, pcurves = build_case(3)
    count = pcurves.counts[0]
    pcurves.points[:count] = pcurves.points[0]
    pcurves.is_rational[0], pcurves.weights[:count] = False, 1.0
    one = np.zeros(1, np.intp)
    curve = compose_curves(
        ClosedSurfaces.open(FaceSurfaces.of(surfaces)), one, Splines.of(pcurves).take(one), 1e-10
    )
    exact = find_surface_point(surfaces, 0, *pcurves.points[0].tolist())
    ends = curve.evaluate(np.zeros(2, np.intp), pcurves.domains[0])
    np.testing.assert_allclose(ends, [[float(x) for x in exact]] * 2, rtol=0, atol=1e-12)
