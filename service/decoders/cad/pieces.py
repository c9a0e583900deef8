"""Pieces of curves between two points, such as the vertices of an edge."""

from dataclasses import dataclass
from math import tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import BasisCurve, Conic, Ellipse, Line
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, distance
from service.decoders.cad.inversion import find_parameters, measure_lengths
from service.decoders.cad.splines import (
    find_domain,
    find_ends,
    join,
    project_points,
    reverse,
    segment,
)

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
    is_closed = bool(measure_lengths(own[1] - own[0]) <= near)
    from_ends = measure_lengths(ends - own)
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
