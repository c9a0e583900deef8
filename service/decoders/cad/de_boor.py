"""De Boor's algorithm in homogeneous coordinates, for many parameters at once.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., sections 3.3 and 5.2.
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.decoders.cad.content import Curve


def differentiate(curve: Curve) -> Curve:
    """The derivative in homogeneous coordinates, of degree p − 1: p (P_i+1 − P_i) / ΔU."""
    degree, knots = curve.degree, curve.knots
    width = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    # Steps over no length belong to no span.
    factor = degree / np.where(width > 0, width, np.inf)
    steps = np.diff(curve.points, axis=0) * factor[:, np.newaxis]
    return Curve(degree - 1, knots[1:-1], steps)


def interpolate(curve: Curve, t: FloatArray) -> FloatArray:
    """Homogeneous points (k, D + 1) at parameters (k,)."""
    degree, knots = curve.degree, curve.knots
    t, span = _find_spans(degree, knots, t)
    rows = curve.points[span[:, np.newaxis] + np.arange(-degree, 1)]
    return _interpolate(degree, knots, rows, t, span)


def interpolate_rows(degree: int, knots: FloatArray, nets: FloatArray, t: FloatArray) -> FloatArray:
    """Homogeneous points (k, D + 1) of k curves with nets (k, n, D + 1), one parameter each."""
    t, span = _find_spans(degree, knots, t)
    columns = span[:, np.newaxis] + np.arange(-degree, 1)
    rows = np.take_along_axis(nets, columns[..., np.newaxis], axis=1)
    return _interpolate(degree, knots, rows, t, span)


def _find_spans(degree: int, knots: FloatArray, t: FloatArray) -> tuple[FloatArray, Ints]:
    """Parameters in the domain, and their spans."""
    t = np.clip(t, knots[degree], knots[-degree - 1])
    # The last knot belongs to the last span of some length.
    last = int(np.searchsorted(knots, knots[-degree - 1], side="left")) - 1
    return t, np.minimum(np.searchsorted(knots, t, side="right") - 1, last)


def _interpolate(
    degree: int,
    knots: FloatArray,
    rows: FloatArray,
    t: FloatArray,
    span: Ints,
) -> FloatArray:
    """De Boor's algorithm on control points (k, p + 1, D)."""
    for level in range(1, degree + 1):
        at = span[:, np.newaxis] + np.arange(level - degree, 1)
        low, high = knots[at], knots[at + degree - level + 1]
        share = ((t[:, np.newaxis] - low) / (high - low))[..., np.newaxis]
        rows = (1.0 - share) * rows[:, :-1] + share * rows[:, 1:]
    result: FloatArray = rows[:, 0]
    return result
