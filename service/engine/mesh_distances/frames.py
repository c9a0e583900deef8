"""Distances of points from triangles, each measured in the frame of its triangle.

In the frame of a triangle T the plane of T is z = 0; its vertices are A = (0, 0), B = (b, 0) and C.
A point (x, y, z) has the distance √(z² + d²) from T, where d is 0 if (x, y) is inside T, and
else the least of its distances from the three edges. A point that is nearer to the line of an edge
than a margin larger than all rounding does not count as inside. So segments and points, which are
triangles without an inside, are measured as segments and points, and needles need no special care.

Proof in docs/proofs.md: "Distances of points from triangles".
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.bounds.reference_triangles import build_reference_triangles
from service.engine.vectors import NEXT, UNIT, Vectors, length

CHUNK = 1 << 12
"""The most pairs of a point and a triangle that are measured at once, so that their data stay in
the processor's cache."""

BLOCK = 1 << 14
"""The most triangles whose frames are built at once; it limits memory."""

MARGIN = 64 * UNIT
"""In relation to the size of the coordinates: the least distance from the lines of all edges at
which a point counts as inside."""

ALLOWANCE = 256 * UNIT
"""In relation to the size of the coordinates: a bound of all errors of a distance."""

LEAST = 2.0**-500
"""A bound of the part of an error that underflow adds."""


class TriangleFrames:
    """n triangles with their frames.

    Parameters
    ----------
    corners : ndarray of float64, shape (3, 3, n)
        Axis 0 counts the vertices, axis 1 their coordinates.

    Attributes
    ----------
    corners : ndarray of float64, shape (3, 3, n)
    table : ndarray of float64, shape (22, n)
        Of each triangle: A; the axes along A B, across it and normal to it; B and C; the unit
        vectors along B C and C A; the lengths of B C and C A.
    reach : float
        The largest distance of a vertex from the origin.
    tilt : float
        No vertex is further than this from its place in the plane of its frame.
    """

    def __init__(self, corners: FloatArray) -> None:
        self.corners = corners
        self.table = np.empty((22, corners.shape[2]))
        self.tilt = 0.0
        for rows in row_slices(corners.shape[2], 1, BLOCK):
            part, table = corners[..., rows], self.table[:, rows]
            is_joined = np.zeros((3, part.shape[2]), np.bool_)
            frames = build_reference_triangles(part, np.zeros_like(part), is_joined)
            table[:3], table[3:12] = frames.origin, frames.axes.reshape(9, -1)
            table[12:16] = frames.corners[1:].reshape(4, -1)
            table[16:20] = frames.tangents[1:].reshape(4, -1)
            table[20:] = frames.lengths[1:]
            # A triangle that is a point has no inside.
            table[16][table[20] == 0] = -1.0
            self.tilt = max(self.tilt, float(frames.tilt.max(initial=0.0)))
        self.reach = float(length(corners).max(initial=0.0))

    def bound_error(self, reach: float) -> float:
        """A bound of the errors of distances of points that are at most `reach` from the origin."""
        return ALLOWANCE * (reach + self.reach) + self.tilt + LEAST

    def _find_margin(self, reach: float) -> float:
        """The least distance from the lines of edges of points that count as inside."""
        return MARGIN * (reach + self.reach) + LEAST

    def measure_squares(self, points: Vectors, triangle: Ints, reach: float) -> FloatArray:
        """The squares (m,) of the distances of points (3, m) from the triangles `triangle` (m,).

        No point is further than `reach` from the origin.
        """
        squares = np.empty(len(triangle))
        margin = self._find_margin(reach)
        for rows in row_slices(len(triangle), 1, CHUNK):
            table = self.table.take(triangle[rows], axis=1)
            x, y, z = _to_frames(points[:, rows], table)
            _, least, worst = _measure_edge(x, y, table, 0)
            for edge in (1, 2):
                _, square, out = _measure_edge(x, y, table, edge)
                np.minimum(least, square, out=least)
                np.maximum(worst, out, out=worst)
            least *= worst > -margin
            z *= z
            np.add(least, z, out=squares[rows])
        return squares

    def find_feet(self, points: Vectors, triangle: Ints, reach: float) -> FloatArray:
        """The places of the triangles `triangle` (m,) that are nearest to points (3, m).

        Returns
        -------
        ndarray of float64, shape (3, m)
            The weights of the three vertices, not negative.
        """
        table = self.table.take(triangle, axis=1)
        x, y, _ = _to_frames(points, table)
        edges = [_measure_edge(x, y, table, edge) for edge in range(3)]
        feet, squares, out = (np.array(values) for values in zip(*edges, strict=True))
        rows, nearest = np.arange(len(triangle)), squares.argmin(axis=0)
        lengths = np.concatenate([table[12:13], table[20:]])[nearest, rows]
        share = feet[nearest, rows] / np.where(lengths > 0, lengths, 1.0)
        weights = np.zeros((3, len(triangle)))
        weights[nearest, rows], weights[NEXT[nearest], rows] = 1.0 - share, share
        inside = (out.max(axis=0) <= -self._find_margin(reach)).nonzero()[0]
        (b, _, c_x, c_y), x, y = table[12:16, inside], x[inside], y[inside]
        third = np.minimum(y / c_y, 1.0)
        second = np.clip((x - third * c_x) / b, 0.0, 1.0 - third)
        weights[:, inside] = 1.0 - second - third, second, third
        return weights

    def place(self, triangle: Ints, weights: FloatArray) -> Vectors:
        """The points (3, m) of the triangles `triangle` (m,) with weights (3, m)."""
        first, second, third = self.corners.take(triangle, axis=2)
        place: Vectors = first + weights[1] * (second - first) + weights[2] * (third - first)
        return place

    def measure_heights(self, points: Vectors, triangle: Ints) -> FloatArray:
        """Heights (m,) of points (3, m) over the planes of the triangles `triangle` (m,)."""
        height: FloatArray = _to_frames(points, self.table.take(triangle, axis=1))[2]
        return height

    def measure_outside(self, points: Vectors, triangle: Ints, edge: int) -> FloatArray:
        """How far points (3, m) are outside of an edge of the triangles `triangle` (m,): (m,)."""
        table = self.table.take(triangle, axis=1)
        x, y, _ = _to_frames(points, table)
        return _measure_edge(x, y, table, edge)[2]


def _to_frames(points: Vectors, table: FloatArray) -> list[FloatArray]:
    """The coordinates x, y and z (m,) of points (3, m) in the frames of their triangles."""
    relative = points - table[:3]
    coordinates = []
    for axis in (3, 6, 9):
        coordinate = relative[0] * table[axis]
        coordinate += relative[1] * table[axis + 1]
        coordinate += relative[2] * table[axis + 2]
        coordinates.append(coordinate)
    return coordinates


def _measure_edge(
    x: FloatArray, y: FloatArray, table: FloatArray, edge: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The nearest places on one edge of triangles, for points (m,) in their planes.

    Returns
    -------
    foot, square, out : ndarray of float64, shape (m,)
        The place of the nearest point of the edge, as a distance from where the edge begins; the
        square of the distance from it; the distance from the line of the edge, positive outside.
    """
    if edge == 0:
        along, out, end = x, -y, table[12]
    else:
        (begin_x, begin_y), (t_x, t_y) = table[10 + 2 * edge :][:2], table[14 + 2 * edge :][:2]
        x, y, end = x - begin_x, y - begin_y, table[19 + edge]
        along = x * t_x
        along += y * t_y
        out = x * t_y
        out -= y * t_x
    foot = np.maximum(along, 0.0)
    np.minimum(foot, end, out=foot)
    square = along - foot
    square *= square
    square += out * out
    return foot, square, out
