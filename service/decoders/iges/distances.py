"""How far two curves of space are apart, whatever their parameters are.

Curves with equal knots and weights are at most as far apart as their control points, because they
are in the convex hull of their difference. Other curves are compared at many points.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., sections 3.2 (convex hull) and 6.1 (point inversion).
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.cad.splines import (
    evaluate,
    evaluate_derivatives,
    find_domain,
    project_points,
    reverse,
)
from service.decoders.iges.shapes import is_line

SAMPLES = 16
"""Points on a span."""

MOST_SAMPLES = 400
"""The most points on a curve."""

STEPS = 3
"""Newton steps from the nearest sample to the nearest point."""

SAME_KNOTS = 1e-9


def bound_distance(first: Curve, second: Curve, is_opposite: bool, tolerance: float) -> float:
    """How far the points of one curve are from the other one, at most; infinite if far apart.

    Parameters
    ----------
    is_opposite : bool
        Whether the curves run in opposite directions.
    tolerance : float
        Curves that are further apart than this need no exact distance.
    """
    if is_line(first) and is_line(second):
        ends = project_points(second.points)
        steps = project_points(first.points) - (ends[::-1] if is_opposite else ends)
        return float(np.sqrt(np.square(steps).sum(axis=1).max()))
    if is_opposite:
        second = reverse(second)
    if _have_same_basis(first, second):
        steps = project_points(first.points) - project_points(second.points)
        distance = float(np.sqrt(np.square(steps).sum(axis=1).max()))
        if distance <= tolerance:
            return distance
    points = _sample(first)
    others = _sample(second)
    middle = points[len(points) // 2]
    spacing = np.sqrt(np.square(np.diff(others, axis=0)).sum(axis=1).max())
    if np.sqrt(np.square(others - middle).sum(axis=1).min()) > spacing + tolerance:
        return np.inf
    there = _measure(points, second, tolerance)
    if there > tolerance:
        return np.inf
    back = _measure(others, first, tolerance)
    return max(there, back) if back <= tolerance else np.inf


def are_opposite(first: Curve, second: Curve) -> bool:
    """Whether two closed curves that begin at one point run in opposite directions."""
    own, start, end = (
        _find_direction(first, 0),
        _find_direction(second, 0),
        _find_direction(second, -1),
    )
    return float(own @ start) < float(own @ end)


def _find_direction(curve: Curve, end: int) -> FloatArray:
    """The direction, of length 1, from an end of a curve into it."""
    points = project_points(curve.points)
    steps = points - points[end]
    lengths = np.sqrt(np.square(steps).sum(axis=1))
    far = np.flatnonzero(lengths > 1e-9 * lengths.max())
    chosen = far[0] if end == 0 else far[-1]
    direction: FloatArray = steps[chosen] / lengths[chosen]
    return direction


def _have_same_basis(first: Curve, second: Curve) -> bool:
    if first.degree != second.degree or len(first.points) != len(second.points):
        return False
    (low, high), (other_low, other_high) = find_domain(first), find_domain(second)
    knots = (first.knots - low) / (high - low)
    if np.abs(knots - (second.knots - other_low) / (other_high - other_low)).max() > SAME_KNOTS:
        return False
    weights = first.points[:, 3] / first.points[0, 3]
    return bool(np.abs(weights - second.points[:, 3] / second.points[0, 3]).max() <= SAME_KNOTS)


def _list_parameters(curve: Curve) -> FloatArray:
    breaks = np.unique(curve.knots)
    count = min(MOST_SAMPLES, SAMPLES * (len(breaks) - 1))
    positions = np.linspace(0, len(breaks) - 1, count + 1)
    return np.interp(positions, np.arange(len(breaks)), breaks)


def _sample(curve: Curve) -> FloatArray:
    return evaluate(curve, _list_parameters(curve))


def _measure(points: FloatArray, curve: Curve, tolerance: float) -> float:
    """The greatest distance of points (k, 3) from a curve."""
    parameters = _list_parameters(curve)
    samples = evaluate(curve, parameters)
    squares = np.square(points[:, np.newaxis] - samples[np.newaxis]).sum(axis=2)
    t = parameters[squares.argmin(axis=1)]
    best = np.sqrt(squares.min(axis=1))
    low, high = find_domain(curve)
    is_closed = bool(np.abs(samples[0] - samples[-1]).max() <= tolerance)
    for _ in range(STEPS):
        if best.max() <= 0.01 * tolerance:
            break
        at, first, second = evaluate_derivatives(curve, t)
        away = at - points
        slope = (away * first).sum(axis=1)
        curvature = (away * second).sum(axis=1) + np.square(first).sum(axis=1)
        step = np.divide(slope, curvature, out=np.zeros_like(slope), where=curvature > 0)
        t = t - step
        if is_closed:  # a point may be nearest to a point beyond the end
            t = low + (t - low) % (high - low)
        t = np.clip(t, low, high)
        best = np.minimum(best, np.sqrt(np.square(evaluate(curve, t) - points).sum(axis=1)))
    return float(best.max())
