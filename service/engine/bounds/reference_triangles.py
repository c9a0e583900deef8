"""The triangles that parts of the surface are measured against, each in a frame of its own.

In the frame of a host its vertices are A = (0, 0), B = (b, 0), C = (x, y) with b, y ≥ 0, all at
height 0 but for rounding; what rounding leaves there is the host's `tilt`. Edge k runs from vertex
k to the next, the host on its left.

The **lens**. A mesh goes on beyond the edges of a triangle. Over edge k, beyond which there is a
known neighbour N, let the flat tent be the triangle in the host's plane with angles α and β at the
ends of the edge. Folded about the edge by the dihedral angle θ it lies in the plane of N, and, if
α and β are no larger than the angles of N there, in N itself: a point of the tent at height δ over
the edge is 2 δ sin(θ/2) away from the mesh. If the tents that meet at a vertex have, together with
the host's own angle, at most π there, the host and its tents are one convex set K.

Angles are handled as directions (cos, sin), up to a factor: no arcs, no tangents.
"""

from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.bounds.vectors import Vectors, cross, dot, length

Direction: TypeAlias = tuple[FloatArray, FloatArray]

SHRUNK = 1.0 - 2.0**-40
"""Tents are made lower by this, more than their angles may be wrong by."""

STEEPEST = 16.0
"""Slope of a tent at the most."""

NEXT, BEFORE = [1, 2, 0], [2, 0, 1]
"""The edge after each edge, and the one before it."""

THIN = 2.0**-20
"""Triangles that are thinner than this share of their length have no tents: all they could gain is
less than their height."""


@dataclass(frozen=True, eq=False, slots=True)
class ReferenceTriangles:
    """m triangles and their tents.

    Attributes
    ----------
    origin : ndarray of float64, shape (3, m)
        Vertex A.
    axes : ndarray of float64, shape (3, 3, m)
        Orthonormal: along A B, across it towards C, and the normal.
    corners : ndarray of float64, shape (3, 2, m)
        The vertices in the plane.
    tangents : ndarray of float64, shape (3, 2, m)
        Unit vectors along the edges, (1, 0) where an edge is a point.
    lengths : ndarray of float64, shape (3, m)
    tilt : ndarray of float64, shape (m,)
        No vertex is further than this from its place in the plane.
    begins, ends : ndarray of float64, shape (3, m)
        Slopes of the tent over each edge; 0 where there is none.
    folds : ndarray of float64, shape (3, m)
        2 sin(θ/2).
    """

    origin: FloatArray
    axes: FloatArray
    corners: FloatArray
    tangents: FloatArray
    lengths: FloatArray
    tilt: FloatArray
    begins: FloatArray
    ends: FloatArray
    folds: FloatArray

    def take(self, rows: Ints) -> "ReferenceTriangles":
        """Some of the hosts."""
        return ReferenceTriangles(*(getattr(self, field.name)[..., rows] for field in fields(self)))

    def at(self, shares: FloatArray) -> FloatArray:
        """Places in the plane with these barycentric coordinates (k, 3, m): shape (k, 2, m)."""
        a, b, c = self.corners
        places: FloatArray = shares[:, :1] * a + shares[:, 1:2] * b + shares[:, 2:] * c
        return places

    def framed(self, nets: FloatArray) -> FloatArray:
        """Nets (m, 3, …), or (m, 4, …) times their weights, in the frames; weights remain."""
        flat = nets.reshape(*nets.shape[:2], -1)
        origin, turn = self.origin.T[..., np.newaxis], self.axes.transpose(2, 0, 1)
        if nets.shape[1] == 4:
            turned = turn @ (flat[:, :3] - flat[:, 3:] * origin)
            turned = np.concatenate([turned, flat[:, 3:]], axis=1)
        else:
            turned = turn @ (flat - origin)
        made: FloatArray = turned.reshape(nets.shape)
        return made


def hosts_of(vertices: FloatArray, across: FloatArray, joined: Bools) -> ReferenceTriangles:
    """The hosts with these vertices (3, 3, m), axis 1 their coordinates.

    Parameters
    ----------
    across : ndarray of float64, shape (3, 3, m)
        The vertex opposite each edge in the triangle beyond it, if it is `joined`, shape (3, m).
    """
    origin = vertices[0]
    sides = vertices[1:] - origin
    axes = _frame(sides[0], sides[1])
    seen = in_frame(np.concatenate([sides, across - origin]), axes)
    (b, low, up_b), (_, y, up_c) = seen[:2]
    tilt = np.maximum(np.abs(up_b), np.abs(up_c)) + np.abs(low)
    corners = np.zeros((3, 2, len(b)))
    corners[1, 0], corners[2] = b, seen[1, :2]
    along = corners[NEXT] - corners
    lengths = np.sqrt(along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1])
    point = lengths == 0
    tangents = along / np.where(point, 1.0, lengths)[:, np.newaxis]
    tangents[:, 0][point] = 1.0
    joined = joined & (y > THIN * lengths.max(axis=0))
    begins, ends, folds = _tents(corners, tangents, lengths, seen[2:], joined)
    return ReferenceTriangles(origin, axes, corners, tangents, lengths, tilt, begins, ends, folds)


def in_frame(vectors: FloatArray, axes: FloatArray) -> FloatArray:
    """Coordinates (k, 3, m) of vectors (k, 3, m) along axes (3, 3, m)."""
    made = vectors[:, :1] * axes[:, 0]
    made += vectors[:, 1:2] * axes[:, 1]
    made += vectors[:, 2:] * axes[:, 2]
    return made


def _frame(first: Vectors, second: Vectors) -> FloatArray:
    """Orthonormal axes (3, 3, m): along the first side, towards the second, and their product.

    The second axis is made orthogonal twice, which leaves it so to the last places however small
    the angle is; where nothing is left any direction will do, for the height that the third vertex
    then has counts as tilt.
    """
    size, other = length(first), length(second)
    point = size == 0
    if point.any():
        first, size = np.where(point, second, first), np.where(point, other, size)
    one = first / np.where(size > 0, size, 1.0)
    one[0][size == 0] = 1.0
    two = second
    for _ in range(2):
        two = two - dot(two, one) * one
    size = length(two)
    # A second side along the first gives no direction; a coordinate axis does.
    lost = size <= 2.0**-48 * other
    if lost.any():
        least = np.abs(one).argmin(axis=0)
        any_other = (np.arange(3)[:, np.newaxis] == least).astype(np.float64)
        for _ in range(2):
            any_other = any_other - dot(any_other, one) * one
        two = np.where(lost, any_other, two)
        size = length(two)
    two = two / size
    return np.array([one, two, cross(one, two)])


def _tents(
    corners: FloatArray,
    tangents: FloatArray,
    lengths: FloatArray,
    far: FloatArray,
    joined: Bools,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Slopes at the beginning and at the end of each edge, and the chords of the folds."""
    gone = far[:, :2] - corners
    s = gone[:, 0] * tangents[:, 0] + gone[:, 1] * tangents[:, 1]
    out = gone[:, 0] * tangents[:, 1] - gone[:, 1] * tangents[:, 0]
    high = far[:, 2]
    reach = np.sqrt(out * out + high * high)
    joined = joined & (reach > 0)
    reach = np.where(joined, reach, 0.0)
    unit = np.where(joined, reach, 1.0)
    folds = np.sqrt((out / unit - 1.0) ** 2 + (high / unit) ** 2)
    # The neighbour's angles at the beginning of edge k, and at the end of the edge before it.
    cosines = np.array([np.where(joined, s, 1.0), np.where(joined, lengths - s, 1.0)[BEFORE]])
    angle = cosines, np.array([reach, reach[BEFORE]])
    before = tangents[BEFORE]
    rest = (
        before[:, 0] * tangents[:, 0] + before[:, 1] * tangents[:, 1],
        np.maximum(before[:, 0] * tangents[:, 1] - before[:, 1] * tangents[:, 0], 0.0),
    )
    half = 1.0 + rest[0], rest[1]
    # What the other tent at the vertex leaves, or half of what there is.
    other = angle[0][::-1], angle[1][::-1]
    begins, ends = _slope(_smaller(angle, _larger(half, _difference(rest, other))))
    return begins, ends[NEXT], folds


def _slope(angle: Direction) -> FloatArray:
    """The tangent of an angle of at most π, up to the steepest that there is."""
    steep = angle[0] * STEEPEST <= angle[1]
    slope: FloatArray = np.where(steep, STEEPEST, angle[1] / np.where(steep, 1.0, angle[0]))
    return slope * SHRUNK


def _difference(first: Direction, second: Direction) -> Direction:
    return (
        first[0] * second[0] + first[1] * second[1],
        first[1] * second[0] - first[0] * second[1],
    )


def _smaller(first: Direction, second: Direction) -> Direction:
    chosen = first[0] * second[1] >= first[1] * second[0]
    return np.where(chosen, first[0], second[0]), np.where(chosen, first[1], second[1])


def _larger(first: Direction, second: Direction) -> Direction:
    chosen = first[0] * second[1] <= first[1] * second[0]
    return np.where(chosen, first[0], second[0]), np.where(chosen, first[1], second[1])
