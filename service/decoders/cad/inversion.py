"""Parameters of points on curves, and the pieces of curves between two points.

The nearest point of a spline is searched among samples of all spans, and then by Newton's method on
(C(t) − P) · C′(t) = 0 between them. A step that leaves the interval becomes a bisection.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., section 6.1.
"""

from dataclasses import dataclass
from math import tau

import numpy as np

from service.bases.arrays import FloatArray, Ints
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

LONGER = 1.5
"""A curve between two neighbouring samples is longer than its chord by at most this factor, unless
its weights differ by powers of ten."""

PARTS = 6
"""The parts into which these intervals are divided."""

MOST_INTERVALS = 24
"""The most intervals between samples that are searched for one point."""

STEPS = 12
"""The most steps of Newton's method: it begins in a small part of one span."""

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

    Between two samples A and B the curve is not nearer to P than (|PA| + |PB| − ℓ) / 2, where ℓ is
    its length there, which is estimated from the chord. Intervals that may have nearer points than
    all samples are sampled once more, and then searched.
    """
    breaks = np.unique(curve.knots)
    count = 2 * curve.degree + MORE_SAMPLES
    inner = np.arange(count) / count
    samples = np.append(
        (breaks[:-1, np.newaxis] + np.diff(breaks)[:, np.newaxis] * inner).ravel(), breaks[-1]
    )
    sampled = evaluate(curve, samples)
    shares = np.arange(PARTS + 1) / PARTS
    parameters, distances = np.empty((2, len(points)))
    owners, lows, highs = [], [], []
    for row, point in enumerate(points):
        chosen = _choose_intervals(sampled[:-1], sampled[1:], point)
        low, high = samples[chosen], samples[chosen + 1]
        finer = low[:, np.newaxis] + (high - low)[:, np.newaxis] * shares
        finer[:, -1] = high
        near = evaluate(curve, finer.ravel()).reshape(*finer.shape, -1)
        away = _lengths(near - point).ravel()
        best = away.argmin()
        parameters[row], distances[row] = finer.ravel()[best], away[best]
        begins, ends = (
            near[:, part].reshape(-1, near.shape[-1]) for part in (np.s_[:-1], np.s_[1:])
        )
        chosen = _choose_intervals(begins, ends, point)
        owners.append(np.full(len(chosen), row))
        lows.append(finer[:, :-1].ravel()[chosen])
        highs.append(finer[:, 1:].ravel()[chosen])
    owner = np.concatenate(owners)
    t, found = _search(curve, points[owner], np.concatenate(lows), np.concatenate(highs))
    # The last of equal indices counts: the nearest.
    order = np.argsort(-found, kind="stable")
    order = order[found[order] < distances[owner[order]]]
    parameters[owner[order]], distances[owner[order]] = t[order], found[order]
    return parameters, distances


def _choose_intervals(begins: FloatArray, ends: FloatArray, point: FloatArray) -> Ints:
    """Intervals (m,) of a curve, given by their ends, that may have its nearest point."""
    first, last = _lengths(begins - point), _lengths(ends - point)
    least = (first + last - LONGER * _lengths(ends - begins)) / 2
    chosen = np.flatnonzero(least <= np.minimum(first, last).min())
    if len(chosen) > MOST_INTERVALS:
        chosen = chosen[np.argpartition(least[chosen], MOST_INTERVALS)[:MOST_INTERVALS]]
    return chosen


def _search(
    curve: Curve, points: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The nearest parameters that Newton's method meets in intervals (m,), and the distances."""
    t = (low + high) / 2
    near = 1e-15 * (curve.knots[-1] - curve.knots[0])
    best, least = t, np.full(len(t), np.inf)
    for _ in range(STEPS):
        point, first, second = evaluate_derivatives(curve, t)
        away = point - points
        distances = _lengths(away)
        best = np.where(distances < least, t, best)
        least = np.minimum(distances, least)
        slope = (away * first).sum(axis=1)
        curvature = (away * second).sum(axis=1) + np.square(first).sum(axis=1)
        high, low = np.where(slope > 0, t, high), np.where(slope > 0, low, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            after = t - slope / curvature
        is_newton = (curvature > 0) & (after >= low) & (after <= high)
        after = np.where(is_newton, after, (low + high) / 2)
        is_done = (slope == 0) | (np.abs(after - t) <= near)
        if is_done.all():
            break
        t = np.where(is_done, t, after)
    return best, least


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
