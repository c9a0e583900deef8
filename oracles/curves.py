"""Points of curves in exact arithmetic, and lengths computed with 20 digits.

A B-spline is evaluated in fractions by the recurrence of Cox and de Boor, without Bézier pieces.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

import mpmath

from oracles.exact import Vector, curve_point
from oracles.splines import spline_point, to_fractions


def exact_points(points: Any, weights: Any = None) -> list[Vector]:
    """The control points as fractions; with weights as homogeneous points, (wx, wy, w)."""
    rows = [tuple(Fraction(float(x)) for x in point) for point in points]
    if weights is None:
        return rows
    point_weights = [Fraction(float(w)) for w in weights]
    return [(*(w * x for x in row), w) for row, w in zip(rows, point_weights, strict=True)]


def project(value: Vector, dimension: int) -> Vector:
    """A point of this dimension, divided by its weight if it has one coordinate more."""
    if len(value) == dimension:
        return value
    return tuple(x / value[-1] for x in value[:-1])


def bezier_point(points: Any, weights: Any, t: Fraction) -> Vector:
    """C(t) by de Casteljau, as fractions."""
    return project(curve_point(exact_points(points, weights), t), len(points[0]))


def bezier_tangent(points: Any, weights: Any, t: Fraction) -> list[float]:
    """The limit of the unit tangent at t from the right; at t = 1 from the left.

    w(t + h) (C(t + h) − C(t)) is a polynomial in h. Its lowest term that does not vanish has the
    direction of the tangent from the right. The tangent from the left has the opposite direction if
    the power of h in this term is even.
    """
    homogeneous = exact_points(points, [1] * len(points) if weights is None else weights)
    point = project(curve_point(homogeneous, t), len(points[0]))
    local = [tuple(x - q[-1] * c for x, c in zip(q[:-1], point, strict=True)) for q in homogeneous]
    for order in range(1, len(points)):
        local = [tuple(b - a for a, b in zip(*pair, strict=True)) for pair in pairwise(local)]
        value = curve_point(local, t)
        if any(value):
            sign = -1 if t == 1 and order % 2 == 0 else 1
            with mpmath.workdps(40):
                parts = [mpmath.mpf(sign * x.numerator) / x.denominator for x in value]
                length = mpmath.sqrt(mpmath.fsum(x * x for x in parts))
                return [float(x / length) for x in parts]
    raise AssertionError("a curve that is one point has no tangent")


def bspline_point(
    points: Any, weights: Any, knots: Sequence[float], degree: int, t: Fraction
) -> Vector:
    """C(t) = Σ N_i(t) P_i as fractions: the limit from the right, but at the end from the left."""
    homogeneous = exact_points(points, weights)
    return project(spline_point(homogeneous, to_fractions(knots), degree, t), len(points[0]))


def bezier_length(points: Any, weights: Any, breaks: Sequence[float] = ()) -> float:
    """∫ |C′| over [0, 1], computed with 20 digits; `breaks` are the parameters where C′ is 0."""
    count, dimension = len(points), len(points[0])
    with mpmath.workdps(20):
        w = [mpmath.mpf(1)] * count if weights is None else [mpmath.mpf(float(x)) for x in weights]
        p = [[mpmath.mpf(float(x)) for x in point] for point in points]
        columns = [w, *([w[i] * p[i][axis] for i in range(count)] for axis in range(dimension))]
        steps = [[(count - 1) * (b - a) for a, b in pairwise(column)] for column in columns]

        def bernstein(n: int, t: Any) -> list[Any]:
            return [math.comb(n, i) * t**i * (1 - t) ** (n - i) for i in range(n + 1)]

        def speed(t: Any) -> Any:
            basis, lower_basis = bernstein(count - 1, t), bernstein(count - 2, t)
            weight, *values = (mpmath.fdot(basis, column) for column in columns)
            weight_slope, *slopes = (mpmath.fdot(lower_basis, step) for step in steps)
            derivative = (
                (d - x / weight * weight_slope) / weight
                for x, d in zip(values, slopes, strict=True)
            )
            return mpmath.sqrt(mpmath.fsum(derivative, squared=True))

        return float(mpmath.quad(speed, [0, *breaks, 1]))
