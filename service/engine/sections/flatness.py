"""Bounds of the distance of a piece of a section from its chord, by the convex hull.

The piece lies in a rectangle of parameters, on the plane n · p = d, between the points A and B of
the plane. Let e be the unit vector from A to B, g = n × e, and h(S) = n · S − d. For all λ and μ,
each point X of the piece has

    |g · (X − A)| ≤ max |g · (P_ij − A) − λ h(P_ij)|,
    min ≤ e · (X − A) ≤ max of e · (P_ij − A) − μ h(P_ij)

for the control points P_ij of the rectangle. λ and μ are chosen so that the linear terms in the
parameters cancel, or are 0, if that is better.

Proof in docs/proofs.md: "Flat pieces of a section".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.engine.bounds.chords import bound_chord_deviations
from service.engine.cells.cells import Cells
from service.engine.nets.blossoms import restrict
from service.engine.nets.nets import Nets
from service.engine.sections.cells import LocalPlanes
from service.engine.vectors import cross, dot, length, normalize, project

SLACK = 2.0**-44
"""A bound of the rounding errors of control points for p + q ≤ 64, in the coordinates of the
nets."""

MAX_NUMBERS = 1 << 19
"""How many coordinates of control points one chunk has, to bound the memory."""


SHARES = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]])
"""The part of its chord that a piece advances along u, and along v, for the three values of `axis`
in `Pieces`."""


@dataclass(frozen=True, eq=False, slots=True)
class Pieces(Cells):
    """The m pieces of sections; each is a graph of one parameter over the other.

    Attributes
    ----------
    rectangle : ndarray of float64, shape (4, m)
        A rectangle of parameters that contains the piece.
    plane, net : ndarray of int, shape (m,)
    begin, end : ndarray of float64, shape (2, m)
        The parameters (u, v) of both ends; the parameter over which the piece is a graph ascends.
    axis : ndarray of int, shape (m,)
        0 for a graph over u, 1 over v; 2 if the piece is monotone in both, so that its ends are
        corners of the rectangle.
    """

    rectangle: FloatArray
    plane: Ints
    net: Ints
    begin: FloatArray
    end: FloatArray
    axis: Ints


def bound_pieces(
    group: Nets, planes: LocalPlanes, pieces: Pieces, *, tries_both: bool = False
) -> FloatArray:
    """Bound the distances of pieces of nets of one group from their chords: shape (2, m).

    The first row does not include rounding, and decreases when the rectangles are halved. The
    second row is the slack for rounding; it is large where the surface is almost parallel to the
    plane, unless `tries_both`: then λ and μ are 0 where that gives a smaller sum.
    """
    bounds = np.empty((2, len(pieces)))
    for rows in row_slices(len(pieces), group.nets[0].size, MAX_NUMBERS):
        bounds[:, rows] = _bound(group, planes, pieces.take(rows), tries_both)
    return bounds


def _bound(group: Nets, planes: LocalPlanes, pieces: Pieces, tries_both: bool) -> FloatArray:
    """Bound the distances of some pieces; the result is as in `bound_pieces`."""
    nets = group.nets[pieces.net - group.first]
    first, last = _evaluate(nets, pieces.begin), _evaluate(nets, pieces.end)
    normal = planes.normals[pieces.plane]
    chord = last - first
    chord -= dot(chord, normal, -1)[:, np.newaxis] * normal
    lengths = length(chord, -1)
    direction_along = chord / np.where(lengths > 0, lengths, 1.0)[:, np.newaxis]
    rows_without_chord = np.flatnonzero(lengths == 0)
    if len(rows_without_chord):
        # Both ends are equal: take any direction in the plane.
        direction = np.eye(3)[np.abs(normal[rows_without_chord]).argmin(axis=1)]
        direction = cross(normal[rows_without_chord], direction, -1)
        direction_along[rows_without_chord] = normalize(direction, -1)
    direction_across = cross(normal, direction_along, -1)
    # x = e · (P − A), y = g · (P − A) and the height h of all control points P.
    points = project(_restrict(nets, pieces.rectangle), -1)
    difference = points - first[:, np.newaxis, np.newaxis]
    x = np.matmul(difference, direction_along[:, np.newaxis, :, np.newaxis])[..., 0]
    y = np.matmul(difference, direction_across[:, np.newaxis, :, np.newaxis])[..., 0]
    h = planes.heights(pieces.plane, points)
    h_slope = _find_slopes(h)
    squared_slope = dot(h_slope, h_slope)
    # λ and μ are 0 where the slope of h is only rounding.
    squared_slope[squared_slope <= bound_rounding(group.nets) ** 2] = np.inf
    # λ is `slide_y` and μ is `slide_x`. They bring the slopes of y near 0, and those of x near
    # `target`: |AB| along the axis of the graph, or half of this along both axes.
    sense = np.where(pieces.end >= pieces.begin, 1.0, -1.0)
    target = SHARES[:, pieces.axis] * lengths * sense
    slide_y = dot(_find_slopes(y), h_slope) / squared_slope
    slide_x = dot(_find_slopes(x) - target, h_slope) / squared_slope
    distance_beside = np.abs(y - slide_y[:, np.newaxis, np.newaxis] * h).max(axis=(1, 2))
    position = x - slide_x[:, np.newaxis, np.newaxis] * h
    length_beyond = np.maximum(position.max(axis=(1, 2)) - lengths, -position.min(axis=(1, 2)))
    rounding = bound_rounding(group.nets)
    if tries_both:
        beside = np.abs(y).max(axis=(1, 2))
        is_less = beside < distance_beside + rounding * np.abs(slide_y)
        distance_beside, slide_y = np.where(
            is_less, [beside, 0 * beside], [distance_beside, slide_y]
        )
        beyond = np.maximum(x.max(axis=(1, 2)) - lengths, -x.min(axis=(1, 2)))
        is_less = beyond < length_beyond + rounding * np.abs(slide_x)
        length_beyond, slide_x = np.where(is_less, [beyond, 0 * beyond], [length_beyond, slide_x])
    slack = rounding * (1 + np.abs(slide_x) + np.abs(slide_y))
    return np.stack([np.hypot(distance_beside, np.maximum(length_beyond, 0.0)), slack])


def bound_sides(group: Nets, net: Ints, rectangle: FloatArray, axis: int) -> FloatArray:
    """Bound the distances (m,) of sides of cells from their chords.

    The rectangles (4, m) are sides: they have a length along `axis` alone.
    """
    lines = _restrict(group.nets[net - group.first], rectangle)
    lines = lines[:, :, 0] if axis == 0 else lines[:, 0]
    bounds = bound_chord_deviations(lines, project(lines[:, [0, -1]], -1))
    return bounds + bound_rounding(group.nets)


def bound_sizes(group: Nets, net: Ints, rectangle: FloatArray) -> FloatArray:
    """Bound the diameters (m,) of the pieces of surface over rectangles (4, m)."""
    sizes = np.empty(len(net))
    for rows in row_slices(len(sizes), group.nets[0].size, MAX_NUMBERS):
        cells = _restrict(group.nets[net[rows] - group.first], rectangle[:, rows])
        points = project(cells, -1).reshape(len(cells), -1, 3)
        sides = points.max(axis=1) - points.min(axis=1)
        sizes[rows] = length(sides, -1) + bound_rounding(group.nets)
    return sizes


def bound_rounding(nets: FloatArray) -> float:
    """A bound of the rounding of control points of rectangles of nets (m, p+1, q+1, 3 or 4)."""
    _, rows, columns, _ = nets.shape
    return float(SLACK * max(1.0, (rows + columns - 2) / 64))


def _restrict(nets: FloatArray, rectangle: FloatArray) -> FloatArray:
    """Nets (m, p+1, q+1, 3 or 4) over rectangles (4, m)."""
    corners = rectangle.reshape(2, 2, -1).swapaxes(0, 1)
    return restrict(nets.transpose(0, 3, 1, 2), corners).transpose(0, 2, 3, 1)


def _evaluate(nets: FloatArray, parameters: FloatArray) -> FloatArray:
    """Points (m, 3) of nets (m, p+1, q+1, 3 or 4), each at its `parameters` (2, m)."""
    m, rows, columns, width = nets.shape
    basis_u = bernstein(rows - 1, parameters[0])[:, np.newaxis]
    basis_v = bernstein(columns - 1, parameters[1])[:, np.newaxis]
    lines = np.matmul(basis_u, nets.reshape(m, rows, -1)).reshape(m, columns, width)
    return project(np.matmul(basis_v, lines)[:, 0], -1)


def _find_slopes(values: FloatArray) -> FloatArray:
    """Mean differences (2, m) along u and v of the corner values of arrays (m, p+1, q+1)."""
    a, b, c, d = values[:, 0, 0], values[:, 0, -1], values[:, -1, 0], values[:, -1, -1]
    return np.stack([(c + d - a - b) / 2, (b + d - a - c) / 2])
