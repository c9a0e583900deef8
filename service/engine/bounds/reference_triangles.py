"""The triangles of the mesh from which distances of the surface are measured, in local frames.

In its frame a triangle T has the vertices A = (0, 0), B = (b, 0), C = (x, y) with b, y ≥ 0, all at
height 0 except for rounding, which is bounded by `tilt`. Edge k runs from vertex k to the next, T
on its left.

**Edge wedges.** A mesh goes on beyond the edges of a triangle. Over edge k, beyond which there is a
known neighbour N, let the wedge be the flat triangle in the plane of T with angles α and β at the
ends of the edge. Folded about the edge by the dihedral angle θ it lies in the plane of N, and, if
α and β are no larger than the angles of N there, in N itself: a point of the wedge at height δ over
the edge is 2 δ sin(θ/2) away from the mesh. If the wedges that meet at a vertex have, together with
the angle of T, at most π there, T and its wedges are one convex set K.

Angles are vectors (cos, sin) up to a factor; no inverse trigonometric function is computed.

**Rounding.** Coordinates are at most 1 (`local_frames`), so errors of vertices are at most a few u
= 2^-53, and those of wedges at most 8 u times the length of their edge; wedges are made lower by
2^-40 of this length.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.bounds.blossoms import BEFORE, NEXT
from service.engine.bounds.vectors import Columns, Vectors, cross, dot, length

SHRUNK = 1.0 - 2.0**-40
"""Factor that lowers wedges by more than the error of their angles."""

STEEPEST = 16.0
"""Largest slope of a wedge."""

THIN = 2.0**-20
"""Triangles thinner than this share of their length get no wedges: these would gain less than the
height of the triangle."""


@dataclass(frozen=True, eq=False, slots=True)
class ReferenceTriangles(Columns):
    """m triangles and their wedges.

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
        Slopes of the wedge over each edge; 0 where there is none.
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

    def to_frames(self, nets: FloatArray, scale: FloatArray) -> FloatArray:
        """Nets (m, 3, …), or homogeneous ones (m, 4, …), in the frames; weights do not change.

        Coordinates are multiplied by `scale` (m,), powers of two, first.
        """
        flat = nets.reshape(*nets.shape[:2], -1)
        origin, turn = self.origin.T[..., np.newaxis], self.axes.transpose(2, 0, 1)
        points, weights = flat[:, :3] * scale[:, np.newaxis, np.newaxis], flat[:, 3:]
        if nets.shape[1] == 4:
            turned = np.concatenate([turn @ (points - weights * origin), weights], axis=1)
        else:
            points -= origin
            turned = turn @ points
        framed: FloatArray = turned.reshape(nets.shape)
        return framed


def build_reference_triangles(
    vertices: FloatArray, across: FloatArray, joined: Bools
) -> ReferenceTriangles:
    """The triangles with these vertices (3, 3, m), axis 1 their coordinates.

    Parameters
    ----------
    across : ndarray of float64, shape (3, 3, m)
        The vertex opposite each edge in the triangle beyond it, if it is `joined`, shape (3, m).
    """
    origin = vertices[0]
    away = np.concatenate([vertices[1:], across]) - origin
    axes = _build_axes(away[:2])
    seen = away[:, :1] * axes[:, 0]
    seen += away[:, 1:2] * axes[:, 1]
    seen += away[:, 2:] * axes[:, 2]
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
    wedges = _build_wedges(corners, tangents, lengths, seen[2:], joined)
    return ReferenceTriangles(origin, axes, corners, tangents, lengths, tilt, *wedges)


def _build_axes(sides: Vectors) -> FloatArray:
    """Orthonormal axes (3, 3, m): along the first of two sides, towards the second, their product.

    The second axis is made orthogonal twice, so it is orthogonal to a few units in the last place
    however small the angle is. If the second side is parallel to the first, any direction will do:
    the height of the third vertex then counts as tilt.
    """
    (first, second), (size, other) = sides, length(sides)
    point = size == 0
    if point.any():
        first, size = np.where(point, second, first), np.where(point, other, size)
    one = first / np.where(size > 0, size, 1.0)
    one[0][size == 0] = 1.0
    two = _orthogonalize(second, one)
    size = length(two)
    # A second side along the first gives no direction; a coordinate axis does.
    lost = size <= 2.0**-48 * other
    if lost.any():
        least = np.abs(one).argmin(axis=0)
        axis = (np.arange(3)[:, np.newaxis] == least).astype(np.float64)
        two = np.where(lost, _orthogonalize(axis, one), two)
        size = length(two)
    two = two / size
    return np.array([one, two, cross(one, two)])


def _orthogonalize(vectors: Vectors, unit: Vectors) -> Vectors:
    """The components of vectors that are orthogonal to unit vectors."""
    for _ in range(2):
        vectors = vectors - dot(vectors, unit) * unit
    return vectors


def _build_wedges(
    corners: FloatArray,
    tangents: FloatArray,
    lengths: FloatArray,
    far: FloatArray,
    joined: Bools,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Slopes at the beginning and at the end of each edge, and the chords of the folds."""
    (x, y), (along, across) = (far[:, :2] - corners).swapaxes(0, 1), tangents.swapaxes(0, 1)
    s, out, high = x * along + y * across, x * across - y * along, far[:, 2]
    reach = np.sqrt(out * out + high * high)
    joined = joined & (reach > 0)
    reach = np.where(joined, reach, 0.0)
    unit = np.where(joined, reach, 1.0)
    folds = np.sqrt((out / unit - 1.0) ** 2 + (high / unit) ** 2)
    # Directions (2, 2, 3, m): the neighbour's angles at the beginning of edge k, and at the end of
    # the edge before it.
    angle = np.empty((2, 2, *s.shape))
    angle[0, 0], angle[0, 1] = np.where(joined, s, 1.0), np.where(joined, lengths - s, 1.0)[BEFORE]
    angle[1, 0], angle[1, 1] = reach, reach[BEFORE]
    x, y = tangents[BEFORE].swapaxes(0, 1)
    cosine, sine = x * along + y * across, np.maximum(x * across - y * along, 0.0)
    # The angle that the other wedge at the vertex leaves, or half of the angle to be shared.
    other, left = angle[:, ::-1], np.empty_like(angle)
    left[0] = cosine * other[0] + sine * other[1]
    left[1] = sine * other[0] - cosine * other[1]
    half = np.array([1.0 + cosine, sine])[:, np.newaxis]
    left = np.where(half[0] * left[1] <= left[0] * half[1], half, left)
    angle = np.where(angle[0] * left[1] >= left[0] * angle[1], angle, left)
    # Tangents of angles of at most π.
    steep = angle[0] * STEEPEST <= angle[1]
    slope = np.where(steep, STEEPEST, angle[1] / np.where(steep, 1.0, angle[0])) * SHRUNK
    return slope[0], slope[1][NEXT], folds
