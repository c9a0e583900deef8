"""The triangles of the mesh from which distances of the surface are measured, in local frames.

In its frame a triangle T has the vertices A = (0, 0), B = (b, 0), C = (x, y) with b, y ≥ 0, all at
height 0 except for rounding, which is bounded by `tilt`. Edge k runs from vertex k to the next, T
on its left. Beyond an edge lies a *wedge*, a triangle that folds onto the neighbour; T and its
wedges are one convex set. An angle is stored as a vector (cos, sin) of any length, so no inverse
trigonometric function is needed.

Proof in docs/proofs.md: "Wedges beyond edges".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.vectors import BEFORE, NEXT, Items, Vectors, cross, dot, length

SHRUNK = 1.0 - 2.0**-40
"""Factor that lowers wedges by more than the error of their angles."""

STEEPEST = 16.0
"""Largest slope of a wedge. Without it slopes would not be finite, because angles of neighbours may
be 90° or more; 16 is the slope of 86°."""

THIN = 2.0**-20
"""A triangle in which C is nearer to the line A B than this share of the longest edge gets no
wedges, because they would lower the bound by less than this distance."""


@dataclass(frozen=True, eq=False, slots=True)
class ReferenceTriangles(Items):
    """m triangles and their wedges.

    Attributes
    ----------
    origin : ndarray of float64, shape (3, m)
        Vertex A.
    axes : ndarray of float64, shape (3, 3, m)
        Orthonormal: along A B, across it towards C, and the normal.
    corners : ndarray of float64, shape (3, 2, m)
        The vertices in the plane of the triangle.
    tangents : ndarray of float64, shape (3, 2, m)
        Unit vectors along the edges, (1, 0) where an edge is a point.
    lengths : ndarray of float64, shape (3, m)
        Lengths of the edges.
    tilt : ndarray of float64, shape (m,)
        No vertex is further than this from its place in the plane.
    begins, ends : ndarray of float64, shape (3, m)
        Slopes (tan α, tan β) of the wedge at both ends of each edge; 0 for an edge without a wedge.
    folds : ndarray of float64, shape (3, m)
        2 sin(θ/2) of each edge; any number for an edge without a wedge.
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
        """Nets (m, 3, …), or homogeneous nets (m, 4, …), in the frames; weights do not change.

        `scale` (m,), powers of two, converts the coordinates of the nets to the units of the
        triangles. Both are relative to the same point.
        """
        flat = nets.reshape(*nets.shape[:2], -1)
        origin, turn = self.origin.T[..., np.newaxis], self.axes.transpose(2, 0, 1)
        points, weights = flat[:, :3] * scale[:, np.newaxis, np.newaxis], flat[:, 3:]
        turned = np.empty(flat.shape)
        points -= weights * origin if nets.shape[1] == 4 else origin
        np.matmul(turn, points, out=turned[:, :3])
        turned[:, 3:] = weights
        return turned.reshape(nets.shape)


def build_reference_triangles(
    vertices: FloatArray, far: FloatArray, joined: Bools
) -> ReferenceTriangles:
    """The triangles with these vertices (3, 3, m), axis 1 their coordinates.

    `far` (3, 3, m) has the vertex opposite to each edge in the triangle beyond it; `joined` (3, m)
    marks edges with a triangle beyond.
    """
    origin = vertices[0]
    # B, C and the vertices beyond the edges, relative to A; then in the frame.
    relative = np.concatenate([vertices[1:], far]) - origin
    axes = _build_axes(relative[:2])
    local = relative[:, :1] * axes[:, 0]
    local += relative[:, 1:2] * axes[:, 1]
    local += relative[:, 2:] * axes[:, 2]
    # B and C in the frame; without rounding `low`, `up_b` and `up_c` would be 0.
    (b, low, up_b), (_, y, up_c) = local[:2]
    tilt = np.maximum(np.abs(up_b), np.abs(up_c)) + np.abs(low)
    corners = np.zeros((3, 2, len(b)))
    corners[1, 0], corners[2] = b, local[1, :2]
    along = corners[NEXT] - corners
    lengths = np.sqrt(along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1])
    is_point = lengths == 0
    tangents = along / np.where(is_point, 1.0, lengths)[:, np.newaxis]
    tangents[:, 0][is_point] = 1.0
    joined = joined & (y > THIN * lengths.max(axis=0))
    if joined.any():
        wedges = _build_wedges(corners, tangents, lengths, local[2:], joined)
    else:
        wedges = (np.zeros(joined.shape),) * 3
    return ReferenceTriangles(origin, axes, corners, tangents, lengths, tilt, *wedges)


def _build_axes(sides: Vectors) -> FloatArray:
    """Orthonormal axes (3, 3, m): along the first of two sides, towards the second, their product.

    The second axis is made orthogonal twice, so it is orthogonal to a few units in the last place
    however small the angle between the sides is. If the second side is parallel to the first, the
    second axis may have any direction: the height of the third vertex then counts as tilt.
    """
    (first, second), (first_length, second_length) = sides, length(sides)
    # A first side that is a point is replaced by the second; if both are points, by the x-axis.
    is_point = first_length == 0
    if is_point.any():
        first = np.where(is_point, second, first)
        first_length = np.where(is_point, second_length, first_length)
    along = first / np.where(first_length > 0, first_length, 1.0)
    along[0][first_length == 0] = 1.0
    across = _orthogonalize(second, along)
    across_length = length(across)
    # A second side that is parallel to the first is replaced by the coordinate axis with the
    # largest angle to the first.
    is_parallel = across_length <= 2.0**-48 * second_length
    if is_parallel.any():
        least = np.abs(along).argmin(axis=0)
        axis = (np.arange(3)[:, np.newaxis] == least).astype(np.float64)
        across = np.where(is_parallel, _orthogonalize(axis, along), across)
        across_length = length(across)
    across = across / across_length
    return np.array([along, across, cross(along, across)])


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
    """Slopes of wedges at the beginning and at the end of each edge, and 2 sin(θ/2): (3, m) each.

    `far` (3, 3, m) has the vertices beyond the edges, in the frames of the triangles.
    """
    (x, y), (tx, ty) = (far[:, :2] - corners).swapaxes(0, 1), tangents.swapaxes(0, 1)
    # The vertex beyond an edge: s along the edge, `out` away from T, `high` above its plane.
    s, out, high = x * tx + y * ty, x * ty - y * tx, far[:, 2]
    # Its distance from the line of the edge; 0 without a wedge.
    away = np.sqrt(out * out + high * high)
    joined = joined & (away > 0)
    away = np.where(joined, away, 0.0)
    divisor = np.where(joined, away, 1.0)
    # |(cos θ − 1, sin θ)| = 2 sin(θ/2)
    folds = np.sqrt((out / divisor - 1.0) ** 2 + (high / divisor) ** 2)
    # Directions (2, 2, 3, m), axis 0 (cos, sin): at vertex k, where edge k begins and the edge
    # before it ends, the angles of the neighbours beyond these two edges.
    angle = np.empty((2, 2, *s.shape))
    angle[0, 0], angle[0, 1] = np.where(joined, s, 1.0), np.where(joined, lengths - s, 1.0)[BEFORE]
    angle[1, 0], angle[1, 1] = away, away[BEFORE]
    # Two wedges at a vertex share π less the angle of T: the angle (cosine, sine) from the edge
    # before to edge k. Each may have half of it, or `most`: all that the other wedge does not need,
    # if this is more. Cross products compare angles.
    before_x, before_y = tangents[BEFORE].swapaxes(0, 1)
    cosine = before_x * tx + before_y * ty
    sine = np.maximum(before_x * ty - before_y * tx, 0.0)
    other, most = angle[:, ::-1], np.empty_like(angle)
    most[0] = cosine * other[0] + sine * other[1]
    most[1] = sine * other[0] - cosine * other[1]
    half = np.array([1.0 + cosine, sine])[:, np.newaxis]
    most = np.where(half[0] * most[1] <= most[0] * half[1], half, most)
    angle = np.where(angle[0] * most[1] >= most[0] * angle[1], angle, most)
    # Slopes of angles in [0, π], at most `STEEPEST`, also where the cosine is not positive.
    steep = angle[0] * STEEPEST <= angle[1]
    slope = np.where(steep, STEEPEST, angle[1] / np.where(steep, 1.0, angle[0])) * SHRUNK
    # `slope[1]` has, at vertex k, the end of the edge before; edge k ends at the next vertex.
    return slope[0], slope[1][NEXT], folds
