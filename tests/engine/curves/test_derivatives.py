"""Derivatives, curvatures and torsions of curves, compared with exact arithmetic."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles.curve_bends import find_bends, find_derivatives, find_limits, find_taylor_terms
from oracles.curves import exact_points
from oracles.exact import Vector, curve_point
from oracles.splines import spline_point, to_fractions
from service.bases import knots as knot
from service.bases.arrays import FloatArray
from service.engine.curves.derivatives import evaluate_derivatives
from service.engine.curves.evaluation import CurveSamples
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from tests.engine.curves.test_trace import bezier_curves, bspline_curves

NAMES = ("dt", "dtt", "dttt")


def evaluate(curve: Curve, parameters: list[float], order: int = 3) -> dict[str, Any]:
    """The columns at these parameters."""
    pieces = curve.lower()
    samples = CurveSamples.locate(np.array(parameters, float), pieces.breaks)
    return evaluate_derivatives(pieces, samples, order)


def power_curve(*coefficients: list[float]) -> BezierCurve:
    """The curve Σ a_k t^k, with a row for each power, as a Bézier curve."""
    rows = np.array(coefficients, float)
    degree = len(rows) - 1
    ratios = [
        [math.comb(i, k) / math.comb(degree, k) for k in range(degree + 1)]
        for i in range(degree + 1)
    ]
    return BezierCurve(np.array(ratios) @ rows)


def check_columns(columns: dict[str, Any], row: int, terms: list[Vector], dimension: int) -> None:
    """Compare a row with exact derivatives, and curvature and torsion with the exact formulas."""
    exact = find_derivatives(terms, dimension, Fraction(0))
    size = max(1.0, *(abs(float(x)) for vector in exact for x in vector))
    for name, vector in zip(NAMES, exact, strict=True):
        assert columns[name][row] == pytest.approx([float(x) for x in vector], abs=1e-12 * size)
    speed = math.hypot(*(float(x) for x in exact[0]))
    if not speed:
        assert columns["degenerate"][row]
        curvature, torsion = find_limits(terms, dimension)
    elif speed > 1e-3:
        assert not columns["degenerate"][row]
        curvature, torsion = find_bends(exact)
    else:
        return  # digits are lost where a curve is almost at rest
    if curvature is not None:
        scale = (size / (speed or 1.0)) ** 2
        assert columns["curvature"][row] == pytest.approx(curvature, rel=1e-9, abs=1e-12 * scale)
    if torsion is not None and speed and abs(curvature or 0) > 1e-3:
        scale = (size / speed / (curvature or 1.0)) ** 3
        assert columns["torsion"][row] == pytest.approx(torsion, rel=1e-9, abs=1e-11 * scale)


@given(bezier_curves(), st.lists(st.integers(0, 64), min_size=1, max_size=4))
def test_bezier_curves_have_the_exact_derivatives(curve: BezierCurve, places: list[int]) -> None:
    parameters = [Fraction(place, 64) for place in places]
    columns = evaluate(curve, [float(t) for t in parameters])
    homogeneous = exact_points(curve.control_points, curve.weights)
    dimension = curve.control_points.shape[1]
    for row, t in enumerate(parameters):
        if t == 1 and columns["degenerate"][row]:
            continue  # the limit from the left has a test of its own
        terms = find_taylor_terms(
            lambda x: curve_point(homogeneous, x), curve.degree, t, Fraction(1)
        )
        check_columns(columns, row, terms, dimension)


@given(bspline_curves(), st.integers(0, 63))
def test_splines_have_derivatives_by_their_own_parameter(curve: BsplineCurve, place: int) -> None:
    points, weights = curve.control_points, curve.weights
    if curve.periodic:
        points = knot.wrap_points(points, curve.degree)
        weights = None if weights is None else knot.wrap_points(weights, curve.degree)
    knots = to_fractions(curve.knot_vector)
    homogeneous = exact_points(points, weights)
    breaks = curve.lower().breaks
    t = Fraction(breaks[0]) + Fraction(breaks[-1] - breaks[0]) * Fraction(place, 64)
    if float(t) != t:
        return
    columns = evaluate(curve, [float(t)])
    # The polynomial of the span that begins at t, or that contains t.
    last = Fraction(breaks[np.searchsorted(breaks, float(t), side="right")])
    terms = find_taylor_terms(
        lambda x: spline_point(homogeneous, knots, curve.degree, x),
        curve.degree,
        t,
        (last - t) * Fraction(63, 64),
    )
    check_columns(columns, 0, terms, points.shape[1])


def test_a_circle_has_the_inverse_of_its_radius_and_a_sign() -> None:
    root = math.sqrt(0.5)
    weights = np.array([1, root, 1])
    quarter = np.array([[2.0, 0], [2, 2], [0, 2]])
    left = evaluate(BezierCurve(quarter, weights), [0, 0.3, 1])["curvature"]
    right = evaluate(BezierCurve(quarter[::-1], weights), [0, 0.3, 1])["curvature"]
    assert left == pytest.approx(0.5, rel=1e-14)
    assert right == pytest.approx(-0.5, rel=1e-14)
    in_space = BezierCurve(np.pad(quarter[::-1], ((0, 0), (0, 1))), weights)
    columns = evaluate(in_space, [0, 0.3, 1])
    assert columns["curvature"] == pytest.approx(0.5, rel=1e-14)
    assert columns["torsion"].tolist() == [0, 0, 0]


def test_the_torsion_of_the_twisted_cubic() -> None:
    """(t, t², t³) has κ = 2 and τ = 3 at 0; its mirror image has τ = −3."""
    cubic = power_curve([0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1])
    columns = evaluate(cubic, [0])
    assert (columns["curvature"][0], columns["torsion"][0]) == pytest.approx((2, 3))
    mirrored = BezierCurve(cubic.control_points * [1, 1, -1])
    assert evaluate(mirrored, [0])["torsion"][0] == pytest.approx(-3)


@pytest.mark.parametrize(
    ("coefficients", "curvature", "torsion"),
    [
        # The twisted cubic and the parabola in t², which are at rest at 0.
        ([[0] * 3, [0] * 3, [1, 0, 0], [0] * 3, [0, 1, 0], [0] * 3, [0, 0, 1]], 2, 3),
        ([[0, 0], [0, 0], [1, 0], [0, 0], [0, 1]], 2, None),
        ([[0, 0], [0, 0], [1, 0], [0, 0], [0, -1]], -2, None),
        # A cusp (t², t³): infinite. (t², t⁵): 0.
        ([[0, 0], [0, 0], [1, 0], [0, 1]], math.nan, None),
        ([[0, 0], [0, 0], [1, 0], [0, 0], [0, 0], [0, 1]], 0, None),
        # An inflection (t, t³, t⁴) is not at rest, but its torsion is a limit: 12/6.
        ([[0] * 3, [1, 0, 0], [0] * 3, [0, 1, 0], [0, 0, 1]], 0, 2),
        # A line at rest has no torsion.
        ([[0] * 3, [0] * 3, [1, 2, 3]], 0, math.nan),
    ],
)
@pytest.mark.parametrize("size", [1.0, 1e-20, 1e20])
def test_limits_where_the_derivative_vanishes(
    coefficients: list[list[float]], curvature: float, torsion: float | None, size: float
) -> None:
    curve = power_curve(*coefficients)
    curve = BezierCurve(curve.control_points * size)
    columns = evaluate(curve, [0])
    assert columns["curvature"][0] * size == pytest.approx(curvature, abs=1e-12, nan_ok=True)
    if torsion is not None:
        assert columns["torsion"][0] * size == pytest.approx(torsion, rel=1e-9, nan_ok=True)
    # The same from the other end: a plane curve then turns to the other side.
    columns = evaluate(BezierCurve(curve.control_points[::-1]), [1])
    sign = -1 if torsion is None else 1
    assert columns["curvature"][0] * size == pytest.approx(sign * curvature, abs=1e-12, nan_ok=True)
    if torsion is not None:
        assert columns["torsion"][0] * size == pytest.approx(torsion, rel=1e-9, nan_ok=True)


def test_rational_curves_have_limits_too() -> None:
    """A quarter of a circle in t² keeps its curvature, also at rest."""
    # w(t) = (1−t)² + √2 t(1−t) + t² at t² = s, in powers of s; then of s = t².
    root = math.sqrt(2)
    powers = np.array([[1.0, 0, 1], [0, root, root - 2], [-1, 2 - root, 2 - root]])
    homogeneous = np.zeros((5, 3))
    homogeneous[0], homogeneous[2], homogeneous[4] = powers
    homogeneous[2, 0], homogeneous[4, 0] = root - 2, 1 - root
    homogeneous[4, 1] = 1 - root
    net = np.array(
        [[math.comb(i, k) / math.comb(4, k) if k <= i else 0.0 for k in range(5)] for i in range(5)]
    )
    net = net @ homogeneous
    curve = BezierCurve(net[:, :2] / net[:, 2:], net[:, 2])
    columns = evaluate(curve, [0, 0.01, 0.5, 1])
    assert columns["degenerate"].tolist() == [True, False, False, False]
    assert columns["curvature"] == pytest.approx(1, rel=1e-9)


def test_repeated_points_have_no_curvature() -> None:
    """A span of equal control points is one point."""
    points = np.array([[0.0, 0], [1, 0], [1, 0], [1, 0], [1, 0], [2, 1]])
    curve = BsplineCurve(points, 3, "uniform")
    columns = evaluate(curve, [1.5], 2)
    assert columns["degenerate"].tolist() == [True]
    assert np.isnan(columns["curvature"]).all()


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_the_order_decides_about_the_columns(order: int) -> None:
    names = [[], ["dt", "degenerate"], ["dtt", "curvature"], ["dttt", "torsion"]]
    expected = [name for names_of_order in names[: order + 1] for name in names_of_order]
    space = BezierCurve(np.array([[0.0, 0, 0], [1, 1, 1]]))
    assert list(evaluate(space, [0.5], order)) == expected
    plane = BezierCurve(np.array([[0.0, 0], [1, 1]]))
    assert list(evaluate(plane, [0.5], order)) == [n for n in expected if n != "torsion"]


def test_numbers_do_not_depend_on_the_other_samples() -> None:
    rng = np.random.default_rng(5)
    curve = BezierCurve(rng.normal(size=(9, 3)), rng.uniform(0.5, 2, 9))
    parameters: FloatArray = np.append(rng.random(500), [0.0, 1.0])
    together = evaluate(curve, parameters.tolist())
    for row in (0, 100, 501):
        alone = evaluate(curve, [float(parameters[row])])
        assert all(np.array_equal(alone[name][0], together[name][row]) for name in together)
