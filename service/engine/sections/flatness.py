"""How far a piece of a section is from its chord: proved, by the convex hull.

The piece lies in a rectangle of parameters, on the plane n · p = d, between the points A and B of
the plane. Let e be the unit vector from A to B, g = n × e, and h(S) = n · S − d.

Theorem. For every number λ, each point X of the piece has |g · (X − A)| ≤ max |g · (P_ij − A) −
λ h(P_ij)| over the control points P_ij of the rectangle. For every number μ, e · (X − A) lies
between the least and the greatest of e · (P_ij − A) − μ h(P_ij).

Proof. On the piece h = 0, so that g · (X − A) = g · (X − A) − λ h(X), an affine function of X. X is
a mean of the P_ij (weights are positive), and an affine function of a mean is the mean of its
values. ∎

So the distance of X to the chord AB is at most the hypotenuse of the first bound and of what the
second interval has beyond [0, |AB|]. λ and μ may be anything; they are chosen to cancel what is
linear in the parameters: both bounds are of the second order in the size of the rectangle.

Rounding. Control points of the rectangle are right to a few u (p + q), coordinates being about 1:
`SLACK`, times 1 + |λ| + |μ|, is more.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.bounds.chords import bound_deviations
from service.engine.queries.nets import NetGroup
from service.engine.sections.heights import LocalPlanes, points_of, restricted
from service.engine.vectors import cross, dot

SLACK = 2.0**-44

ROOM = 1 << 19
"""Numbers of control points that are worked on at a time."""


@dataclass(frozen=True, eq=False, slots=True)
class Pieces:
    """Pieces of sections, m in number: the graph of one parameter over the other.

    Attributes
    ----------
    plane, net : ndarray of int, shape (m,)
    begin, end : ndarray of float64, shape (m, 2)
        Parameters of the ends, in ascending order of the one over which the piece is a graph.
    low, high : ndarray of float64, shape (m, 2)
        Corners of a rectangle that holds the piece.
    axis : ndarray of int, shape (m,)
        0 for a graph over u, 1 over v; 2 where the piece is monotone in both, so that its ends are
        corners of the rectangle.
    """

    plane: Ints
    net: Ints
    begin: FloatArray
    end: FloatArray
    low: FloatArray
    high: FloatArray
    axis: Ints


def piece_bounds(group: NetGroup, planes: LocalPlanes, pieces: Pieces) -> FloatArray:
    """Bounds of the distances of pieces of nets of one group from their chords, (2, m).

    First without rounding, which halving makes smaller, then what rounding adds. That is large
    where the surface is almost parallel to the plane.
    """
    found = np.empty((2, len(pieces.net)))
    for rows in row_slices(len(pieces.net), group.nets[0].size, ROOM):
        checkpoint()
        found[:, rows] = _bounds(
            group,
            planes,
            Pieces(*(getattr(pieces, name)[rows] for name in Pieces.__dataclass_fields__)),
        )
    return found


def _bounds(group: NetGroup, planes: LocalPlanes, pieces: Pieces) -> FloatArray:
    nets = group.nets[pieces.net - group.first]
    first, last = _points_at(nets, pieces.begin), _points_at(nets, pieces.end)
    normal = planes.normals[pieces.plane]
    chord = last - first
    chord -= dot(chord, normal)[:, np.newaxis] * normal
    length = np.sqrt(dot(chord, chord))
    along = chord / np.where(length > 0, length, 1.0)[:, np.newaxis]
    no_chord = np.flatnonzero(length == 0)
    if len(no_chord):  # any direction in the plane serves
        some = np.eye(3)[np.abs(normal[no_chord]).argmin(axis=1)]
        some = cross(normal[no_chord], some)
        along[no_chord] = some / np.sqrt(dot(some, some))[:, np.newaxis]
    across = cross(normal, along)
    points = points_of(restricted(nets, pieces.low, pieces.high))
    away = points - first[:, np.newaxis, np.newaxis]
    x = np.matmul(away, along[:, np.newaxis, :, np.newaxis])[..., 0]
    y = np.matmul(away, across[:, np.newaxis, :, np.newaxis])[..., 0]
    h = planes.heights(pieces.plane, points)
    h_slope = _slopes(h)
    steep = dot(h_slope, h_slope)
    steep[steep == 0] = np.inf
    wanted = np.zeros((len(length), 2))
    sense = np.where(pieces.end >= pieces.begin, 1.0, -1.0)
    for axis, share in enumerate(np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5]])):
        wanted[:, axis] = share[pieces.axis] * length * sense[:, axis]
    slide_y = dot(_slopes(y), h_slope) / steep
    slide_x = dot(_slopes(x) - wanted, h_slope) / steep
    beside = np.abs(y - slide_y[:, np.newaxis, np.newaxis] * h).max(axis=(1, 2))
    place = x - slide_x[:, np.newaxis, np.newaxis] * h
    beyond = np.maximum(place.max(axis=(1, 2)) - length, -place.min(axis=(1, 2)))
    slack = SLACK * (1 + np.abs(slide_x) + np.abs(slide_y))
    return np.stack([np.hypot(beside, np.maximum(beyond, 0.0)), slack])


def side_bounds(
    group: NetGroup, net: Ints, low: FloatArray, high: FloatArray, axis: int
) -> FloatArray:
    """Bounds (m,) of the distances of sides of rectangles from their chords.

    `low` and `high` (m, 2) differ along `axis` alone.
    """
    lines = restricted(group.nets[net - group.first], low, high)
    lines = lines[:, :, 0] if axis == 0 else lines[:, 0]
    return bound_deviations(lines, points_of(lines[:, [0, -1]])) + SLACK


def cell_sizes(group: NetGroup, net: Ints, low: FloatArray, high: FloatArray) -> FloatArray:
    """Lengths (m,) that the diameters of the pieces of surface over rectangles do not exceed."""
    found = np.empty(len(net))
    for rows in row_slices(len(found), group.nets[0].size, ROOM):
        cells = restricted(group.nets[net[rows] - group.first], low[rows], high[rows])
        points = points_of(cells).reshape(len(cells), -1, 3)
        sides = points.max(axis=1) - points.min(axis=1)
        found[rows] = np.sqrt(dot(sides, sides)) + SLACK
    return found


def _points_at(nets: FloatArray, place: FloatArray) -> FloatArray:
    """Points (m, 3) of nets (m, p+1, q+1, 3 or 4) at places (m, 2) of their own."""
    m, rows, columns, width = nets.shape
    basis_u = bernstein(rows - 1, place[:, 0])[:, np.newaxis]
    basis_v = bernstein(columns - 1, place[:, 1])[:, np.newaxis]
    lines = np.matmul(basis_u, nets.reshape(m, rows, -1)).reshape(m, columns, width)
    return points_of(np.matmul(basis_v, lines)[:, 0])


def _slopes(values: FloatArray) -> FloatArray:
    """Mean differences (m, 2) of values (m, p+1, q+1) at the corners, along u and v."""
    a, b, c, d = values[:, 0, 0], values[:, 0, -1], values[:, -1, 0], values[:, -1, -1]
    return np.stack([(c + d - a - b) / 2, (b + d - a - c) / 2], axis=1)


def is_zero(rows: FloatArray) -> Bools:
    """Which rows (m, n+1) are zero: sides of cells that lie in the plane."""
    return np.asarray(~rows.any(axis=1))
