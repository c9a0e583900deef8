"""Parameters of points on curves, and the pieces of curves between two points.

The nearest point of a spline is searched among samples of all spans, and then by Newton's method
between them.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import tau

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.decoders.cad.conics import BasisCurve, Conic, Ellipse, Line
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, distance
from service.decoders.cad.newton import SplineRows, search_intervals
from service.decoders.cad.splines import (
    evaluate,
    find_domain,
    find_ends,
    join,
    project_points,
    reverse,
    segment,
)

MORE_SAMPLES = 5
"""Samples of each span in addition to two for each degree."""

LEAST_SAMPLES, MANY_SAMPLES = 4, 2000
"""The fewest samples of each span, and how many samples a curve may have unless it has many
spans."""

CHUNK = 1 << 20
"""The most numbers of control points that are evaluated at once."""

LONGER = 1.5
"""A curve between two neighbouring samples is longer than its chord by at most this factor, unless
its weights differ by powers of ten."""

PARTS = 6
"""The parts into which these intervals are divided."""

MOST_INTERVALS = 24
"""The most intervals between samples that are searched for one point."""

ON_CURVE = 1e-9
"""Points that are this near, as a share of the curve's size, are on it."""

ROUNDING = 1e-15
"""Points that are this near, as a share of their coordinates, are equal."""

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
    all samples are sampled once more, and then searched. For a point on the curve the intervals
    beside the nearest sample are enough.
    """
    samples, sampled, on_curve, spline = _sample(curve)
    found = []
    for point, goal in zip(points, points.tolist(), strict=True):
        away = _lengths(sampled - point)
        best = int(away.argmin())
        near = samples[max(best - 1, 0) : best + 2].tolist()
        nearest = samples.item(best), away.item(best)
        if nearest[1] > 0.0:
            nearest = search_intervals(spline, goal, pairwise(near), nearest)
        if nearest[1] > on_curve:
            chosen = _choose_intervals(sampled[:-1], sampled[1:], point)
            ends = _divide(curve, samples[chosen], samples[chosen + 1], point)
            nearest = search_intervals(spline, goal, ends, nearest)
        found.append(nearest)
    parameters, distances = np.array(found).reshape(-1, 2).T
    return parameters, distances


@lru_cache(maxsize=8)
def _sample(curve: Curve) -> tuple[FloatArray, FloatArray, float, SplineRows]:
    """Samples of a curve for the search of nearest points, taken once for many edges.

    Returns
    -------
    samples : ndarray of float64, shape (m,)
        Parameters in all spans and at their ends. Long curves have fewer samples in each span,
        which is a smaller part of them.
    sampled : ndarray of float64, shape (m, D)
        The points there.
    on_curve : float
        The distance below which points are on the curve.
    spline : SplineRows
    """
    breaks = np.unique(curve.knots)
    spans = len(breaks) - 1
    count = min(2 * curve.degree + MORE_SAMPLES, max(LEAST_SAMPLES, MANY_SAMPLES // spans))
    steps = np.diff(breaks)[:, np.newaxis] * (np.arange(count) / count)
    samples = np.append((breaks[:-1, np.newaxis] + steps).ravel(), breaks[-1])
    # Each sample takes p + 1 control points.
    chunk = max(1, CHUNK // len(curve.points[0]) // (curve.degree + 1))
    chunks = [evaluate(curve, samples[k : k + chunk]) for k in range(0, len(samples), chunk)]
    sampled = np.concatenate(chunks)
    on_curve = ON_CURVE * float(np.ptp(sampled, axis=0).max())
    spline = SplineRows(curve.degree, curve.knots.tolist(), curve.points.tolist())
    return samples, sampled, on_curve, spline


def _divide(
    curve: Curve, low: FloatArray, high: FloatArray, point: FloatArray
) -> list[tuple[float, float]]:
    """Parts of intervals (m,) of a curve that may have its nearest point."""
    samples = low[:, np.newaxis] + (high - low)[:, np.newaxis] * (np.arange(PARTS + 1) / PARTS)
    samples[:, -1] = high
    near = evaluate(curve, samples.ravel()).reshape(*samples.shape, -1)
    dimension = near.shape[-1]
    begins, ends = near[:, :-1].reshape(-1, dimension), near[:, 1:].reshape(-1, dimension)
    chosen = _choose_intervals(begins, ends, point)
    pairs = np.stack([samples[:, :-1].ravel()[chosen], samples[:, 1:].ravel()[chosen]], axis=1)
    return [(first, last) for first, last in pairs.tolist()]


def _choose_intervals(begins: FloatArray, ends: FloatArray, point: FloatArray) -> Ints:
    """Intervals (m,) of a curve, given by their ends, that may have its nearest point."""
    first, last = _lengths(begins - point), _lengths(ends - point)
    least = (first + last - LONGER * _lengths(ends - begins)) / 2
    chosen = np.flatnonzero(least <= np.minimum(first, last).min())
    if len(chosen) > MOST_INTERVALS:
        chosen = chosen[np.argpartition(least[chosen], MOST_INTERVALS)[:MOST_INTERVALS]]
    return chosen


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
        return _cut_line(curve, first, last)
    if not same_sense:
        piece = cut_between(curve, last, first, is_loop=is_loop, tolerance=tolerance)
        return Piece(None if piece.curve is None else reverse(piece.curve), piece.gap)
    if not isinstance(curve, Curve):
        return _cut_conic(curve, first, last, is_loop)
    if curve.points.shape[1] == 4 and _ends_at(curve, first, last):
        return Piece(curve, 0.0)
    return _cut_spline(curve, np.array([first, last]), is_loop, tolerance)


def _cut_line(line: Line, first: Vector, last: Vector) -> Piece:
    """The piece of a line: it is between its vertices, even if these are off the line."""
    if first == last:
        raise InvalidGeometry("an edge on a line has no length")
    gaps = [distance(line.evaluate(line.find_parameter(p)), p) for p in (first, last)]
    return Piece(None, max(gaps))


def _cut_conic(conic: Conic, first: Vector, last: Vector, is_loop: bool) -> Piece:
    """The piece of a conic: of an ellipse counter-clockwise, of others the only one."""
    start, end = conic.find_parameter(first), conic.find_parameter(last)
    gap = max(distance(conic.evaluate(start), first), distance(conic.evaluate(end), last))
    if isinstance(conic, Ellipse):
        return Piece(conic.cut(start, start + tau if is_loop else end), gap)
    if start > end:
        return Piece(reverse(conic.cut(end, start)), gap)
    return Piece(conic.cut(start, end), gap)


def _ends_at(curve: Curve, first: Vector, last: Vector) -> bool:
    """Whether a curve of space begins and ends at two points, up to rounding."""
    for row, point in ((0, first), (-1, last)):
        x, y, z, w = curve.points[row].tolist()
        if distance((x / w, y / w, z / w), point) > ROUNDING * (abs(x) + abs(y) + abs(z)) / w:
            return False
    return True


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
