"""Curves of space for parameter curves: within their proved distance of S(c(t))."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.decoders.cad import splines
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.elementary import Cylinder, Sphere
from service.decoders.cad.fitting import fit_pcurves
from service.decoders.cad.frames import build_frame
from tests.spline_strategies import KnotVector, knot_vectors, random_points, random_weights

FRAME = build_frame((1.0, 0.0, 2.0), (0.0, 0.6, 0.8))
GOAL = 1e-6


def measure_error(surface: Surface, pcurve: Curve, curve: Curve, period: float = 0.0) -> float:
    """The largest distance at equal parameters, at 500 of them."""
    t = np.linspace(*splines.find_domain(pcurve), 500)
    u, v = splines.evaluate(pcurve, t).T
    if period:
        low = surface.knots[0][0]
        u = low + (u - low) % period
    expected = splines.evaluate_surface(surface, u, v)
    return float(np.abs(splines.evaluate(curve, t) - expected).max())


@given(
    u=knot_vectors(st.integers(1, 3), max_spans=3),
    v=knot_vectors(st.integers(1, 3), max_spans=3),
    c=knot_vectors(st.integers(1, 3), max_spans=3),
    seed=st.integers(0, 2**32 - 1),
    is_rational=st.booleans(),
)
def test_fits_are_within_their_bounds(
    u: KnotVector, v: KnotVector, c: KnotVector, seed: int, is_rational: bool
) -> None:
    weights = random_weights(u.point_count, seed, v.point_count) ** 0.3 if is_rational else None
    surface = splines.build_surface(
        (u.degree, v.degree),
        (u.knots, v.knots),
        random_points(u.point_count, seed, v.point_count),
        weights,
    )
    rng = np.random.default_rng(seed)
    pcurves = []
    for _ in range(2):
        share = rng.uniform(0, 1, (c.point_count, 2))
        low = np.array([knots[0] for knots in surface.knots])
        high = np.array([knots[-1] for knots in surface.knots])
        own = rng.uniform(0.5, 2, c.point_count) if is_rational else None
        pcurves.append(splines.build_curve(c.degree, c.knots, low + share * (high - low), own))
    for pcurve, fit in zip(pcurves, fit_pcurves(surface, pcurves, GOAL), strict=True):
        assert fit.curve is not None
        assert fit.error <= 100 * GOAL
        assert fit.curve.degree <= 11
        assert measure_error(surface, pcurve, fit.curve) <= fit.error
        assert splines.find_domain(fit.curve) == splines.find_domain(pcurve)


def test_an_exact_composition_keeps_its_digits() -> None:
    surface = Cylinder(FRAME, 2.0).trim((0.0, 2 * pi), (0.0, 5.0))
    helix = splines.build_curve(1, [0, 0, 1, 1], [[0.0, 1.0], [pi, 4.0]])
    (fit,) = fit_pcurves(surface, [helix], GOAL)
    assert fit.curve is not None
    assert fit.error < 1e-11
    assert measure_error(surface, helix, fit.curve) <= fit.error


def test_pcurves_may_go_around() -> None:
    surface = Cylinder(FRAME, 2.0).trim((0.0, 2 * pi), (0.0, 5.0))
    line = splines.build_curve(1, [0, 0, 1, 1], [[4.0, 1.0], [9.0, 4.0]])
    (fit,) = fit_pcurves(surface, [line], GOAL)
    assert fit.curve is not None
    assert measure_error(surface, line, fit.curve, 2 * pi) <= fit.error + 1e-12 < 1e-9


def test_a_pcurve_along_a_pole_is_a_point() -> None:
    surface = Sphere(FRAME, 2.0).trim((0.0, 2 * pi), (-pi / 2, pi / 2))
    pole = splines.build_curve(1, [0, 0, 1, 1], [[0.0, pi / 2], [2 * pi, pi / 2]])
    meridian = splines.build_curve(1, [0, 0, 1, 1], [[1.0, -pi / 2], [1.0, pi / 2]])
    fits = fit_pcurves(surface, [pole, meridian], GOAL)
    assert fits[0].curve is None
    assert fits[1].curve is not None
    assert splines.find_ends(fits[1].curve) == pytest.approx(
        np.array([FRAME.place(0, 0, -2), FRAME.place(0, 0, 2)])
    )
    assert fit_pcurves(surface, [], GOAL) == []
