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
from service.engine.adaptive.vectors import cross, dot, length

Direction: TypeAlias = tuple[FloatArray, FloatArray]

SHRUNK = 1.0 - 2.0**-40
"""Tents are made lower by this, more than their angles may be wrong by."""

STEEPEST = 16.0
"""Slope of a tent at the most."""

THIN = 2.0**-20
"""Hosts that are thinner than this share of their length have no tents: all they could gain is
less than their height."""


@dataclass(frozen=True, eq=False, slots=True)
class Hosts:
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

    def take(self, rows: Ints) -> "Hosts":
        """Some of the hosts."""
        return Hosts(*(getattr(self, field.name)[..., rows] for field in fields(self)))

    def at(self, shares: FloatArray) -> FloatArray:
        """Places in the plane with these barycentric coordinates (k, 3, m): shape (k, 2, m)."""
        a, b, c = self.corners
        places: FloatArray = (
            shares[:, 0, np.newaxis] * a
            + shares[:, 1, np.newaxis] * b
            + shares[:, 2, np.newaxis] * c
        )
        return places

    def framed(self, nets: FloatArray) -> FloatArray:
        """Points (…, 3, m), or (…, 4, m) times their weights, in the frames; weights remain."""
        homogeneous = nets.shape[-2] == 4
        away = np.empty((3, *nets.shape[:-2], nets.shape[-1]))
        for c in range(3):
            start = self.origin[c]
            if homogeneous:
                start = nets[..., 3, :] * start
            np.subtract(nets[..., c, :], start, out=away[c])
        made = np.empty(nets.shape)
        for k in range(3):
            axis, target = self.axes[k], made[..., k, :]
            np.multiply(away[0], axis[0], out=target)
            target += away[1] * axis[1]
            target += away[2] * axis[2]
        if homogeneous:
            made[..., 3, :] = nets[..., 3, :]
        return made


def hosts_of(vertices: FloatArray, across: FloatArray, joined: Bools) -> Hosts:
    """The hosts with these vertices (3, 3, m), axis 1 their coordinates.

    Parameters
    ----------
    across : ndarray of float64, shape (3, 3, m)
        The vertex opposite each edge in the triangle beyond it, if it is `joined`, shape (3, m).
    """
    origin = vertices[0]
    sides = vertices[1] - origin, vertices[2] - origin
    axes = _frame(*sides)
    (b, low, up_b), (x, y, up_c) = (_in_frame(side, axes) for side in sides)
    tilt = np.maximum(np.abs(up_b), np.abs(up_c)) + np.abs(low)
    corners = np.zeros((3, 2, len(b)))
    corners[1, 0], corners[2, 0], corners[2, 1] = b, x, y
    along = corners[[1, 2, 0]] - corners
    lengths = np.sqrt(along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1])
    point = lengths == 0
    tangents = along / np.where(point, 1.0, lengths)[:, np.newaxis]
    tangents[:, 0][point] = 1.0
    beyond = across - origin
    far = np.stack([_in_frame(side, axes) for side in beyond])  # (edge, coordinate of the frame, m)
    joined = joined & (y > THIN * lengths.max(axis=0))
    begins, ends, folds = _tents(corners, tangents, lengths, far, joined)
    return Hosts(origin, axes, corners, tangents, lengths, tilt, begins, ends, folds)


def _frame(first: FloatArray, second: FloatArray) -> FloatArray:
    """Orthonormal axes (3, 3, m): along the first side, towards the second, and their product.

    The second axis is made orthogonal twice, which leaves it so to the last places however small
    the angle is; where nothing is left any direction will do, for the height that the third vertex
    then has counts as tilt.
    """
    size = length(first)
    chosen = np.where(size > 0, first, second)
    size = np.where(size > 0, size, length(second))
    one = chosen / np.where(size > 0, size, 1.0)
    one[0][size == 0] = 1.0
    two = second
    for _ in range(2):
        two = two - dot(two, one) * one
    # A second side along the first gives no direction; a coordinate axis does.
    lost = length(two) <= 2.0**-48 * length(second)
    least = np.abs(one).argmin(axis=0)
    other = (np.arange(3)[:, np.newaxis] == least).astype(np.float64)
    for _ in range(2):
        other = other - dot(other, one) * one
    two = np.where(lost, other, two)
    two = two / length(two)
    three = cross(one, two)
    return np.stack([one, two, three])


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
    one = np.where(joined, s, 1.0), reach
    two = np.where(joined, lengths - s, 1.0)[[2, 0, 1]], reach[[2, 0, 1]]
    before = tangents[[2, 0, 1]]
    rest = (
        before[:, 0] * tangents[:, 0] + before[:, 1] * tangents[:, 1],
        np.maximum(before[:, 0] * tangents[:, 1] - before[:, 1] * tangents[:, 0], 0.0),
    )
    half = 1.0 + rest[0], rest[1]
    begins = _slope(_smaller(one, _larger(half, _difference(rest, two))))
    ends = _slope(_smaller(two, _larger(half, _difference(rest, one))))
    return begins, ends[[1, 2, 0]], folds


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


def _in_frame(side: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return dot(side, axes[0]), dot(side, axes[1]), dot(side, axes[2])
