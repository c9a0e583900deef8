"""Newton's method for the nearest point of a spline, in intervals of its parameter.

A step on (C(t) − P) · C′(t) = 0 that leaves the interval becomes a bisection. Points are single, so
that Python's floats take less time than arrays.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., sections 4.3 and 6.1; Ramshaw, Blossoms are polar forms,
CAGD 6 (1989).
"""

from bisect import bisect_right
from collections.abc import Iterable
from math import hypot, inf
from operator import mul, sub
from typing import NamedTuple

from service.decoders.cad.content import Curve

STEPS = 12
"""The most steps of Newton's method: it begins in a small part of one span."""

SAME = 1e-15
"""Newton's method ends with a step that is shorter than this share of the domain."""


class SplineRows(NamedTuple):
    """A curve as lists of floats, for de Boor's algorithm at single parameters."""

    degree: int
    knots: list[float]
    rows: list[list[float]]

    def find_jet(self, t: float, span: int) -> tuple[list[float], list[float], list[float]]:
        """The point and two derivatives of the polynomial piece of a span, without weights."""
        p, knots = self.degree, self.knots
        rows = self.rows[span - p : span + 1]
        width = knots[span + 1] - knots[span]
        second = [0.0] * len(rows[0])
        first = second
        for level in range(1, p + 1):
            if level == p - 1:
                # Differences of g(x, y), where g is the blossom with p − 2 arguments t.
                after = p * (p - 1) / (width * (knots[span + 2] - knots[span]))
                before = p * (p - 1) / (width * (knots[span + 1] - knots[span - 1]))
                second = [(z - y) * after - (y - x) * before for x, y, z in zip(*rows, strict=True)]
            if level == p:
                first = [(y - x) * (p / width) for x, y in zip(*rows, strict=True)]
            at = span - p + level
            mixed = []
            for k in range(p - level + 1):
                low = knots[at + k]
                share = (t - low) / (knots[at + k + p - level + 1] - low)
                rest = 1.0 - share
                mixed.append(
                    [rest * x + share * y for x, y in zip(rows[k], rows[k + 1], strict=True)]
                )
            rows = mixed
        return _project_jet(rows[0], first, second)


def _project_jet(
    a: list[float], da: list[float], dda: list[float]
) -> tuple[list[float], list[float], list[float]]:
    """A point and derivatives from homogeneous ones, as in `evaluate_derivatives`."""
    w, dw, ddw = a[-1], da[-1], dda[-1]
    point = [x / w for x in a[:-1]]
    first = [(x - dw * y) / w for x, y in zip(da, point, strict=False)]
    second = [(x - 2.0 * dw * y - ddw * z) / w for x, y, z in zip(dda, first, point, strict=False)]
    return point, first, second


def search_intervals(
    spline: SplineRows,
    goal: list[float],
    intervals: Iterable[tuple[float, float]],
    nearest: tuple[float, float],
) -> tuple[float, float]:
    """The nearest parameter in intervals, and its distance, or `nearest` if none is nearer."""
    knots = spline.knots
    near = SAME * (knots[-1] - knots[0])
    for begin, end in intervals:
        low, high, t = begin, end, (begin + end) / 2
        span = bisect_right(knots, t) - 1
        for _ in range(STEPS):
            point, first, second = spline.find_jet(t, span)
            away = list(map(sub, point, goal))
            found = hypot(*away)
            if found < nearest[1]:
                nearest = t, found
            slope = sum(map(mul, away, first))
            curvature = sum(map(mul, away, second)) + sum(map(mul, first, first))
            if slope > 0.0:
                high = t
            else:
                low = t
            after = t - slope / curvature if curvature > 0.0 else inf
            if not low <= after <= high:
                after = (low + high) / 2
            if abs(after - t) <= near:
                break
            t = after
    return nearest


def find_middle(curve: Curve) -> list[float]:
    """A point inside a curve: that in the middle of the span with the middle parameter."""
    knots = curve.knots.tolist()
    span = bisect_right(knots, (knots[0] + knots[-1]) / 2) - 1
    first = span - curve.degree
    rows = curve.points[first : span + 1].tolist()
    near = knots[first : span + curve.degree + 2]
    spline = SplineRows(curve.degree, near, rows)
    return spline.find_jet((knots[span] + knots[span + 1]) / 2, curve.degree)[0]
