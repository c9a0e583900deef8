"""Estimates for cells of several knot spans, from their pieces: one piece in each span."""

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.bases.row_batches import row_slices
from service.engine.adaptive.cutting.cells import FaceCells, Leaves, Task
from service.engine.adaptive.cutting.estimate import (
    build_forms,
    choose_directions,
    find_allowed,
)
from service.engine.adaptive.cutting.heights import (
    NEARLY,
    find_planes,
    measure_remainder,
    measure_sag,
)
from service.engine.adaptive.cutting.normal_variation import (
    estimate_normals,
    find_chord,
    find_height_limit,
)
from service.engine.adaptive.cutting.span_pieces import (
    NinePoints,
    SpanPieces,
    build_nets,
    split_cells,
)
from service.engine.vectors import Vectors, dot, length, project

RUN_PIECES = 1 << 13
"""The number of pieces whose heights are measured together: nine points of each take 2 MB. The
first cell of a spline has a piece for each of its patches, up to 1,000,000."""


def estimate_span_cells(
    task: Task, cells: FaceCells, nine_points: NinePoints
) -> tuple[Bools, Leaves]:
    """Which cells must be cut, and all cells as leaves; each cell has several spans."""
    pieces, goal = split_cells(cells), task.goal
    piece_cells, cell = pieces.as_cells, pieces.cell
    patch = task.find_patches(piece_cells)
    middles = task.patch_nets.middles
    # From the middle of the face's first patch to the middle of the piece's patch.
    offset = middles.take(patch, axis=1) - middles.take(task.faces.first[piece_cells.face], axis=1)
    points = nine_points.evaluate(piece_cells, patch)
    # The same points (9, 3, N), about the middle of the face's first patch.
    face_points = (points + offset).reshape(9, 3, -1)
    # Of the nine points of each cell (3 × 3, u outermost) only the corners are filled.
    # The pieces of a cell are numbered from `start` to `end`, in lines along v of `width` pieces.
    corner = np.zeros((9, 3, len(cells)))
    corner[0], corner[8] = face_points[0][:, pieces.start], face_points[8][:, pieces.end]
    corner[6] = face_points[6][:, pieces.end - pieces.width + 1]
    corner[2] = face_points[2][:, pieces.start + pieces.width - 1]
    planes, normal, steps, squares = find_planes(corner)
    allowed = _find_allowed(task, pieces)
    if goal.angle < np.pi:
        # Rows 4 and 5 of `squares` belong to the two diagonals of each cell.
        diagonal = np.sqrt(np.maximum(squares[4], squares[5]))
        allowed = np.minimum(allowed, find_height_limit(goal.angle, diagonal))
    # 1 for cells without planes, ½ for other cells if the goal has two sides, otherwise 0.
    distance_share = np.where(planes.flat, 1.0, 0.5 if goal.two_sided else 0.0)[cell]
    box, box_size = cells.rectangle.take(cell, axis=1), cells.extents
    low, high = (
        (piece_cells.rectangle[k::2] - box[::2]) / box_size.take(cell, axis=1) for k in (0, 1)
    )
    # Parameters of the cell, from 0 to 1, at the ends and the middle of each piece: (2, 3, N).
    shares = np.array([low, (low + high) * 0.5, high]).swapaxes(0, 1)

    corners, largest = corner[[0, 6, 8, 2]], np.empty((2, len(cell)))
    for run in row_slices(len(cell), 1, RUN_PIECES):
        (x, y), cell_of_piece = shares[..., run], cell[run]
        largest[:, run] = _measure_heights(
            face_points[..., run],
            (np.repeat(x, 3, axis=0), np.tile(y, (3, 1))),
            corners.take(cell_of_piece, axis=-1),
            planes.normals.take(cell_of_piece, axis=-1),
            distance_share[run],
        )
    heights = pieces.find_largest(largest)
    # The diagonal with fewer triangles without area is better; if both have equally many, the
    # heights decide.
    is_rising = np.where(planes.worse == 0, heights[0] < heights[1] * NEARLY, planes.worse < 0)
    best = np.where(is_rising, heights[0], heights[1])
    fails = best > allowed
    if goal.angle < np.pi:
        fails |= _find_turning(pieces, face_points, normal, goal.angle)

    signed, bends, lengths = _measure_bends(
        pieces, face_points, shares[:, 1], normal, distance_share
    )
    if not fails.all():
        chosen = np.where(is_rising, planes.normals[:2], planes.normals[2:])
        # The heights of control points over the biquadratic part of the piece; the heights of nets
        # over chords along u and along v.
        remainder, *sags = _measure_remainders(
            task, pieces, points, chosen, flat=planes.flat, cells=~fails
        )
        fails_by_remainder = ~fails & (best + remainder > allowed)
        fails |= fails_by_remainder
        bends = np.where(fails_by_remainder, sags, bends)
    form = build_forms(steps, normal, -signed, allowed)
    # Row 4 of `Leaves.form` is b, and 8 b is (S_00 − S_10 + S_11 − S_01) · n of the corners.
    along_v = choose_directions(bends, lengths, form[4] * 8.0, allowed)
    is_fan = np.zeros(len(cells), dtype=bool)
    return fails, Leaves(cells.rectangle, cells.face, along_v, is_rising, is_fan, form)


def _measure_heights(
    points: FloatArray,
    shares: tuple[FloatArray, FloatArray],
    corners: FloatArray,
    normals: FloatArray,
    distance_share: FloatArray,
) -> FloatArray:
    """Largest heights (2, N) of points (k, 3, N) over both pairs of triangles for their cells.

    Parameters
    ----------
    shares : (x, y)
        Parameters (k, N) of the points in their cells, from 0 to 1.
    corners, normals : ndarray of float64, shape (4, 3, N)
        The corners a, b, c, d of the cells, and the normals of the triangles (`CellPlanes`).
    distance_share : ndarray of float64, shape (N,)
        The larger of a height and this share of the distance at equal parameters counts.
    """
    x, y = shares
    a, b, c, d = corners
    heights = np.empty((2, points.shape[2]))
    # A corner of both triangles, and which points are below the diagonal: ac, then bd.
    for pair, (start, below) in enumerate(((a, y <= x), (b, x + y <= 1.0))):
        difference = points - start
        height_below = dot(difference, normals[2 * pair])
        height_above = dot(difference, normals[2 * pair + 1])
        height = np.abs(np.where(below, height_below, height_above))
        if distance_share.any():
            # The points of the triangles at the same parameters.
            s, t = x[:, np.newaxis], y[:, np.newaxis]
            if start is a:
                lower, upper = a + s * (b - a) + t * (c - b), a + t * (d - a) + s * (c - d)
            else:
                lower = a + s * (b - a) + t * (d - a)
                upper = c + (1.0 - s) * (d - c) + (1.0 - t) * (b - c)
            offset = points - np.where(below[:, np.newaxis], lower, upper)
            distance = distance_share * length(offset)
            # Cells without planes have distances, no heights.
            height = np.maximum(np.where(distance_share == 1.0, 0.0, height), distance)
        heights[pair] = height.max(axis=0)
    return heights


def _measure_bends(
    pieces: SpanPieces,
    points: FloatArray,
    middle: FloatArray,
    normal: Vectors,
    distance_share: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Heights of middles of pieces over chords, and lengths of chords; rows are for u and for v.

    A chord joins the middles of the outer sides of the first and the last piece of a line of
    pieces; `middle` (2, N) is the share of the chord at which the middle of each piece is. `points`
    (9, 3, N) are the nine points of each piece; `distance_share` (N,) is as in `_measure_heights`.

    Returns
    -------
    signed : ndarray of float64, shape (2, m)
        The height with the largest absolute value, along the normal of each cell.
    bends : ndarray of float64, shape (2, m)
        The largest absolute height, or share of the distance (`distance_share`).
    lengths : ndarray of float64, shape (2, m)
        The largest length of a chord.
    """
    signed, bends, lengths = np.empty((3, 2, len(pieces.start)))
    for axis, (first, last) in enumerate(pieces.find_line_ends()):
        begin = points[(1, 3)[axis]][:, first]
        chord = points[(7, 5)[axis]][:, last] - begin
        difference = points[4] - (begin + middle[axis] * chord)
        height = dot(difference, normal[:, pieces.cell])
        above, below = pieces.find_largest(height), pieces.find_largest(-height)
        signed[axis] = np.where(above >= below, above, -below)
        bends[axis] = np.maximum(above, below)
        if distance_share.any():
            distance = pieces.find_largest(distance_share * length(difference))
            bends[axis] = np.maximum(bends[axis], distance)
        lengths[axis] = pieces.find_largest(length(chord))
    return signed, bends, lengths


def _find_turning(pieces: SpanPieces, points: FloatArray, normal: Vectors, angle: float) -> Bools:
    """Which cells have a normal that differs by more than half the angle from the cell's normal.

    In all other cells no two normals differ by more than the angle.
    """
    normals = estimate_normals(points.reshape(3, 3, 3, -1))
    distances = np.where(
        dot(normals, normals) == 0.0, 0.0, length(normals - normal[:, pieces.cell])
    )
    return pieces.find_largest(distances.max(axis=(0, 1))) > find_chord(angle / 2.0)


def _find_allowed(task: Task, pieces: SpanPieces) -> FloatArray:
    """The deviations (m,) allowed at the piece of each cell that is nearest to the eye."""
    if task.goal.view is None:
        return np.full(len(pieces.start), task.goal.tolerance)
    allowed = np.empty(len(pieces.cell))
    for net, rows in build_nets(task, pieces.as_cells, np.arange(len(pieces.cell))):
        eye = task.find_eyes(task.find_patches(pieces.as_cells.take(rows)))
        allowed[rows] = find_allowed(net, task.goal, eye)
    return -pieces.find_largest(-allowed)


def _measure_remainders(
    task: Task,
    pieces: SpanPieces,
    points: FloatArray,
    normals: FloatArray,
    *,
    flat: Bools,
    cells: Bools,
) -> FloatArray:
    """The largest `measure_remainder` and `measure_sag` of the pieces of these cells: (3, m).

    Parameters
    ----------
    points : ndarray of float64, shape (3, 3, 3, N)
        Nine points of each piece.
    normals : ndarray of float64, shape (2, 3, m)
        Normals of the triangles of cells.
    flat : ndarray of bool, shape (m,)
        Cells without normals.
    cells : ndarray of bool, shape (m,)
        Marks cells to be measured; the values of other cells are 0.
    """
    two_sided = task.goal.two_sided
    values = np.zeros((3, len(pieces.cell)))
    for net, rows in build_nets(task, pieces.as_cells, cells[pieces.cell].nonzero()[0]):
        cell, projected = pieces.cell[rows], project(net)
        under, no_plane = normals.take(cell, axis=-1), flat[cell]
        values[0, rows] = measure_remainder(
            projected, points.take(rows, axis=-1), under, no_plane, two_sided
        )
        values[1:, rows] = measure_sag(projected, under, no_plane, two_sided)
    return pieces.find_largest(values)
