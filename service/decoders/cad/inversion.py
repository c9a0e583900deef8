"""Parameters of points on curves, and the pieces of curves between two points.

The nearest point of a spline is searched among samples of all spans, and then by Newton's method on
(C(t) − P) · C′(t) = 0. A step that leaves the interval around the best sample is a bisection.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., section 6.1.
"""

from dataclasses import dataclass
from math import tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import BasisCurve, Ellipse, Line
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, distance
from service.decoders.cad.splines import (
    evaluate,
    evaluate_derivatives,
    find_domain,
    find_ends,
    join,
    project_points,
    reverse,
    segment,
)

MORE_SAMPLES = 5
"""Samples of each span in addition to two for each degree."""

STEPS = 40
"""The most steps of Newton's method; bisections alone reach the last digit in these."""

AT_END = 1e-6
"""Points are ends of a curve if they are nearer to them than this share of the curve's size."""

BETTER = 0.5
"""A point is moved from the end of a curve into it only if it is nearer by this factor there."""

SAME_PARAMETER = 1e-9
"""Parameters that differ by at most this share of the domain are equal."""


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """The part of a curve between two points.

    Attributes
    ----------
    curve : Curve or None
        From the first point to the second; None for a line.
    gap : float
        The larger of the distances of the two points from the curve.
    """

    curve: Curve | None
    gap: float


def find_parameters(curve: Curve, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The parameters (k,) of the nearest points of a curve to points (k, D), and the distances.

    Between two samples a curve of many turns may come nearer than at its nearest sample; a curve
    that CAD systems write does not.
    """
    breaks = np.unique(curve.knots)
    count = 2 * curve.degree + MORE_SAMPLES
    inner = np.arange(count) / count
    samples = np.append(
        (breaks[:-1, np.newaxis] + np.diff(breaks)[:, np.newaxis] * inner).ravel(), breaks[-1]
    )
    sampled = evaluate(curve, samples)
    best = np.empty(len(points), np.intp)
    for row, point in enumerate(points):
        best[row] = np.square(sampled - point).sum(axis=1).argmin()
    low = samples[np.maximum(best - 1, 0)]
    high = samples[np.minimum(best + 1, len(samples) - 1)]
    t = samples[best]
    for _ in range(STEPS):
        point, first, second = evaluate_derivatives(curve, t)
        away = point - points
        slope = (away * first).sum(axis=1)
        curvature = (away * second).sum(axis=1) + np.square(first).sum(axis=1)
        high, low = np.where(slope > 0, t, high), np.where(slope > 0, low, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            after = t - slope / curvature
        is_newton = (curvature > 0) & (after >= low) & (after <= high)
        after = np.where(is_newton, after, (low + high) / 2)
        after = np.where(slope == 0, t, after)
        is_same = np.abs(after - t) <= 1e-15 * (breaks[-1] - breaks[0])
        t = after
        if is_same.all():
            break
    found = np.sqrt(np.square(evaluate(curve, t) - points).sum(axis=1))
    sampled_distance = np.sqrt(np.square(sampled[best] - points).sum(axis=1))
    is_worse = sampled_distance < found
    return np.where(is_worse, samples[best], t), np.minimum(found, sampled_distance)


def cut_between(
    curve: BasisCurve,
    first: Vector,
    last: Vector,
    *,
    same_sense: bool = True,
    is_loop: bool = False,
    tolerance: float = 0.0,
) -> Piece:
    """The piece of a curve from one vertex to another.

    Parameters
    ----------
    first, last : tuple of three floats
        The vertices, which are on the curve or near it.
    same_sense : bool
        Whether the piece runs in the direction of the curve. It decides for closed curves; on an
        open curve there is only one piece between two points.
    is_loop : bool
        Whether both vertices are one: then the piece is the whole closed curve.
    tolerance : float
        Points are at the ends of a spline if they are at most this far from them.

    Raises
    ------
    InvalidGeometry
        The piece has no length, or the curve is open and `is_loop` says it is closed.
    """
    if isinstance(curve, Line):
        if is_loop or first == last:
            raise InvalidGeometry("an edge on a line has no length")
        gaps = [distance(curve.evaluate(curve.find_parameter(p)), p) for p in (first, last)]
        return Piece(None, max(gaps))
    if not same_sense:
        piece = cut_between(curve, last, first, is_loop=is_loop, tolerance=tolerance)
        return Piece(None if piece.curve is None else reverse(piece.curve), piece.gap)
    if isinstance(curve, Curve):
        return _cut_spline(curve, np.array([first, last]), is_loop, tolerance)
    start, end = curve.find_parameter(first), curve.find_parameter(last)
    gap = max(distance(curve.evaluate(start), first), distance(curve.evaluate(end), last))
    if isinstance(curve, Ellipse):
        return Piece(curve.cut(start, start + tau if is_loop else end), gap)
    if start > end:
        return Piece(reverse(curve.cut(end, start)), gap)
    return Piece(curve.cut(start, end), gap)


def _cut_spline(curve: Curve, ends: FloatArray, is_loop: bool, tolerance: float) -> Piece:
    """The piece of a spline from one point to the other, in the direction of the spline."""
    points = project_points(curve.points)
    size = float(np.ptp(points, axis=0).max())
    near = max(AT_END * size, tolerance)
    own = find_ends(curve)
    is_closed = bool(_lengths(own[1] - own[0]) <= near)
    from_ends = _lengths(ends - own)
    if is_closed and not is_loop:  # a short piece at the seam is not the whole curve
        near = min(near, AT_END * size)
    if (from_ends <= near).all() and (is_loop or is_closed or not _is_point(ends)):
        return Piece(curve, float(from_ends.max()))
    low, high = find_domain(curve)
    parameters, distances = find_parameters(curve, ends)
    # Vertices may be away from a curve's end by more than the tolerance, and nearest to a point
    # shortly before it.
    for side, value in ((0, low), (1, high)):
        if from_ends[side] <= max(near, distances[side] / BETTER) and not is_closed:
            parameters[side], distances[side] = value, from_ends[side]
    start, end = parameters.tolist()
    gap = float(distances.max())
    same = SAME_PARAMETER * (high - low)
    if is_closed:
        return Piece(_cut_closed(curve, start, end, is_loop, near), gap)
    if is_loop:
        raise InvalidGeometry("the curve of an edge with one vertex is not closed")
    if abs(end - start) <= same:
        raise InvalidGeometry("a piece of a spline has no length")
    if start > end:
        return Piece(reverse(segment(curve, end, start)), gap)
    return Piece(segment(curve, start, end), gap)


def _cut_closed(curve: Curve, start: float, end: float, is_loop: bool, tolerance: float) -> Curve:
    """The piece of a closed spline from one parameter forwards to another, over its seam too."""
    low, high = find_domain(curve)
    same = SAME_PARAMETER * (high - low)
    if start >= high - same:
        start = low
    if end <= low + same:
        end = high
    if is_loop:
        end = start
    if end - start > same:
        return segment(curve, start, end)
    if start <= low + same:
        return curve
    pieces = [segment(curve, start, high)]
    if end > low + same and end < high - same:
        pieces.append(segment(curve, low, end))
    return join(pieces, tolerance)


def _is_point(ends: FloatArray) -> bool:
    """Whether two points are equal."""
    return bool((ends[0] == ends[1]).all())


def _lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (…, D)."""
    lengths: FloatArray = np.sqrt(np.square(vectors).sum(axis=-1))
    return lengths
