"""Heights of cells over the triangles that may replace them.

A cell is replaced by two triangles, on either side of one of its diagonals, or by a fan of four
triangles around its middle. The heights are those of a biquadratic surface through nine points of
the cell over the triangles, and those of the control points over this surface.

If the goal has two sides, distances at equal parameters count too, but only half of each, because
the goal allows twice the deviation from the mesh to the surface.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.cells import build_quadratic_matrix
from service.engine.bounds.distance import maximize_both_ways
from service.engine.vectors import BEFORE, NEXT, Vectors, cross, dot, length

THIN = 1e-9
"""A triangle has no plane if its area is below this share of its longest side's square."""

NEARLY = 1.0 - 1e-9
"""The least ratio of numbers that count as equal, so that rounding does not decide between the two
sides of a symmetric cell."""

# The nine points of a cell have the numbers 3 i + j for S(i/2, j/2). The corners a, b, c, d,
# counter-clockwise, are 0, 6, 8, 2; the middles of ab, bc, cd, da are 3, 7, 5, 1; the middle of the
# cell is 4.
STEPS = np.array([[6, 8, 2, 0, 8, 2], [0, 6, 8, 2, 0, 6]])
"""The points at the ends (first row) and at the beginnings of the steps ab, bc, cd, da, ac, bd."""

FACTORS = 3 * np.array([[0, 3, 3, 1, 4], [4, 4, 0, 5, 5]])[..., np.newaxis]
"""The first and the second factors of the vector products that are the normals of abc, acd, abd,
bcd, and of the cell: numbers of steps, times 3 coordinates."""

CYCLES = FACTORS + NEXT, FACTORS + BEFORE
"""Rows of the coordinates that are multiplied in these vector products."""

TRIANGLE_SIDES = np.array([[0, 1, 4], [2, 3, 4], [0, 3, 5], [1, 2, 5]])
"""The steps that are the sides of abc, acd, abd, bcd."""

HALFWAY = np.array([[3, 4, 3, 7], [7, 5, 4, 5], [4, 1, 1, 4]])
"""The points at the middles of these sides; row k has side k of all four triangles."""

TRIANGLE_CORNERS = np.array([0, 0, 6, 6])
"""A corner of each of these triangles, from which heights are measured."""

BENDS = np.array([[3, 7, 5, 1, 4, 4], [0, 6, 8, 2, 1, 3], [6, 8, 2, 0, 7, 5]])
"""Columns: the middle and both ends of the lines ab, bc, cd, da, and of the lines along u and along
v through the middle of the cell."""

FAN_CORNERS = np.array([[0, 6, 8, 2], [6, 8, 2, 0]])
"""Both ends of ab, bc, cd, da, on which the triangles of a fan stand."""

NO_DIFFERENCE = np.zeros(1, dtype=np.intp)
"""`CellPlanes.worse` if all triangles have an area."""


@dataclass(frozen=True, eq=False, slots=True)
class CellPlanes:
    """Unit normals of the two triangles on either side of each diagonal of m cells.

    Attributes
    ----------
    normals : ndarray of float64, shape (4, 3, m)
        Two for the rising diagonal ac, then two for the falling diagonal bd. A triangle without
        area has the normal of the other triangle of the pair.
    flat : ndarray of bool, shape (m,)
        Whether no triangle of the cell has an area.
    worse : ndarray of int, shape (m,) or (1,)
        Number of triangles without area at the rising diagonal, less the number at the falling one.
    """

    normals: FloatArray
    flat: Bools
    worse: Ints


def find_planes(points: FloatArray) -> tuple[CellPlanes, Vectors, FloatArray, FloatArray]:
    """Planes of cells, given nine points (9, 3, m) of each.

    Returns
    -------
    planes : CellPlanes
    normal : ndarray of float64, shape (3, m)
        Unit normals of the cells, orthogonal to both diagonals; or zero.
    steps : ndarray of float64, shape (6, 3, m)
        The vectors of `STEPS`.
    squares : ndarray of float64, shape (6, m)
        The squares of the lengths of these vectors.
    """
    steps = points.take(STEPS[0], axis=0)
    steps -= points.take(STEPS[1], axis=0)
    squares = dot(steps, steps)
    # The vector products of `FACTORS`, for all at once; each row is one coordinate of one step.
    rows = steps.reshape(-1, steps.shape[2])
    crossed = rows.take(CYCLES[0][0], axis=0) * rows.take(CYCLES[1][1], axis=0)
    crossed -= rows.take(CYCLES[1][0], axis=0) * rows.take(CYCLES[0][1], axis=0)
    size = length(crossed)
    has_no_area = size[:4] <= THIN * np.maximum.reduce(squares.take(TRIANGLE_SIDES, axis=0), axis=1)
    size[4] = np.maximum(size[4], np.finfo(float).tiny)
    if not has_no_area.any():
        crossed /= size[:, np.newaxis]
        return CellPlanes(crossed[:4], has_no_area[0], NO_DIFFERENCE), crossed[4], steps, squares
    size[:4] = np.where(has_no_area, 1.0, size[:4])
    crossed /= size[:, np.newaxis]
    normals = np.where(has_no_area[:, np.newaxis], crossed[[1, 0, 3, 2]], crossed[:4])
    worse = has_no_area[:2].sum(axis=0) - has_no_area[2:].sum(axis=0)
    return CellPlanes(normals, has_no_area.all(axis=0), worse), crossed[4], steps, squares


def measure_heights(
    points: FloatArray, planes: CellPlanes, normal: Vectors, two_sided: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Heights of nine points (9, 3, m) of cells over planes and along unit normals (3, m).

    Returns
    -------
    over : ndarray of float64, shape (2, m)
        Largest heights over the triangles of the rising diagonal, and over those of the falling
        one; distances at equal parameters if a cell has no plane, and at least half of these if the
        goal has two sides.
    signed : ndarray of float64, shape (6, m)
        Heights of the middles of `BENDS` over the middles of the chords, along the normal of the
        cell.
    bends : ndarray of float64, shape (6, m)
        The same heights, of any sign; but distances if a cell has no plane, and the larger of the
        absolute height and half the distance if the goal has two sides.
    """
    difference = points.take(HALFWAY, axis=0)
    difference -= points.take(TRIANGLE_CORNERS, axis=0)
    highs = maximize_heights(dot(difference, planes.normals))
    over = np.maximum(highs[::2], highs[1::2])
    # Vectors from the middles of the chords to the middles of the lines.
    bends = points.take(BENDS[1], axis=0)
    bends += points.take(BENDS[2], axis=0)
    bends *= -0.5
    bends += points.take(BENDS[0], axis=0)
    signed = heights = dot(bends, normal)
    if two_sided or planes.flat.any():
        distances = length(bends)
        # The same vectors for the two diagonals.
        across = points[4] - (points[[0, 6]] + points[[8, 2]]) * 0.5
        largest = np.maximum(distances[:4].max(axis=0), length(across))
        over = _include_lengths(over, largest, planes.flat, two_sided)
        heights = _include_lengths(np.abs(signed), distances, planes.flat, two_sided)
    return over, signed, heights


def measure_fans(points: FloatArray, two_sided: bool) -> FloatArray:
    """Largest heights (m,) of cells over fans: four triangles between a side and the middle.

    The spokes of a fan are the lines from its middle to the corners. Half-way along a spoke of a
    quadratic cell, the height over the spoke is 1/4 of the height of the middle over the diagonal.

    Parameters
    ----------
    points : ndarray of float64, shape (9, 3, m)
        Nine points of each cell.
    two_sided : bool
        Whether half of each distance at equal parameters counts too.
    """
    corners, after = points.take(FAN_CORNERS[0], axis=0), points.take(FAN_CORNERS[1], axis=0)
    middle = points[4]
    normals = cross(after - corners, middle - corners)
    normals /= np.maximum(length(normals), np.finfo(float).tiny)[:, np.newaxis]
    sides = points.take(BENDS[0, :4], axis=0) - (corners + after) * 0.5
    # The corners opposite to each corner, and the spokes at the next corner.
    spokes = (middle - (corners + after[[1, 2, 3, 0]]) * 0.5) * 0.25
    bends = np.array([sides, spokes[[1, 2, 3, 0]], spokes])
    heights: FloatArray = np.maximum.reduce(maximize_heights(dot(bends, normals)), axis=0)
    if two_sided:
        # `bends[2]` has the vectors of `bends[1]` in another order.
        heights = np.maximum(heights, 0.5 * length(bends[:2]).max(axis=(0, 1)))
    return heights


def maximize_heights(m: FloatArray) -> FloatArray:
    """Largest |4 (m_0 λ_0 λ_1 + m_1 λ_1 λ_2 + m_2 λ_2 λ_0)| on a triangle.

    `m` (3, …) are the heights over the middles of its sides; λ are barycentric coordinates.
    """
    return np.maximum(*maximize_both_ways(m))


def measure_remainder(
    net: FloatArray, points: FloatArray, normals: FloatArray, flat: Bools, two_sided: bool
) -> FloatArray:
    """The largest heights (m,) of control points of nets less their biquadratic parts.

    Parameters
    ----------
    net : ndarray of float64, shape (p+1, q+1, 3, m)
    points : ndarray of float64, shape (3, 3, 3, m)
        Nine points of each cell.
    normals : ndarray of float64, shape (2, 3, m)
        Normals of both triangles.
    flat : ndarray of bool, shape (m,)
        Cells without normals, for which lengths count instead of heights.
    two_sided : bool
        Whether half of each length counts too.
    """
    normals = normals[:, np.newaxis, np.newaxis]
    heights: FloatArray
    heights = np.maximum.reduce(
        np.abs(_subtract_biquadratic(dot(net, normals), dot(points, normals))), axis=(0, 1, 2)
    )
    if flat.any() or two_sided:
        # The axis of the coordinates comes first.
        remainder = _subtract_biquadratic(
            net.swapaxes(0, 2).swapaxes(1, 2), points.swapaxes(0, 2).swapaxes(1, 2)
        )
        lengths = np.sqrt(np.add.reduce(remainder * remainder, axis=0).max(axis=(0, 1)))
        heights = _include_lengths(heights, lengths, flat, two_sided)
    return heights


def measure_sag(net: FloatArray, normals: FloatArray, flat: Bools, two_sided: bool) -> FloatArray:
    """Bounds (2, m) of the heights of nets over chords along u and along v, by second differences.

    The parameters are those of `measure_remainder`.
    """
    sag = np.empty((2, net.shape[3]))
    for axis in (0, 1):
        degree = net.shape[axis] - 1
        step = net.swapaxes(0, axis)
        step = step[1:] - step[:-1]
        bend = step[1:] - step[:-1]
        size = np.abs(dot(bend, normals[:, np.newaxis, np.newaxis])).max(axis=(0, 1, 2))
        if flat.any() or two_sided:
            lengths = np.sqrt(dot(bend, bend).max(axis=(0, 1)))
            size = _include_lengths(size, lengths, flat, two_sided)
        sag[axis] = size * (degree * (degree - 1) / 8)
    return sag


def _include_lengths(
    heights: FloatArray, lengths: FloatArray, flat: Bools, two_sided: bool
) -> FloatArray:
    """The lengths where cells are `flat`; elsewhere heights, or half of the lengths if larger."""
    return np.where(flat, lengths, np.maximum(heights, lengths * (0.5 if two_sided else 0.0)))


def _subtract_biquadratic(nets: FloatArray, values: FloatArray) -> FloatArray:
    """Nets (k, p+1, q+1, m) less those of biquadratic functions with values (k, 3, 3, m)."""
    along_u, along_v = (build_quadratic_matrix(n - 1)[..., np.newaxis] for n in nets.shape[1:3])
    row = along_u[:, 0, np.newaxis] * values[:, np.newaxis, 0]
    row += along_u[:, 1, np.newaxis] * values[:, np.newaxis, 1]
    row += along_u[:, 2, np.newaxis] * values[:, np.newaxis, 2]
    rest = nets - along_v[:, 0] * row[:, :, np.newaxis, 0]
    rest -= along_v[:, 1] * row[:, :, np.newaxis, 1]
    rest -= along_v[:, 2] * row[:, :, np.newaxis, 2]
    return rest
