"""Rows of samples along curves, numbered and joined to faces."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, IndexArray, Ints
from service.cancellation import checkpoint
from service.engine.options import Faces


@dataclass(frozen=True, eq=False)
class SweptGrids:
    """Grids of samples along K curves, joined to faces.

    Attributes
    ----------
    positions, normals : ndarray of float64, shape (N, 3)
    uvs : ndarray of float64, shape (N, 2)
        u is the fraction of the length along the curve, v the fraction of the width or of the turn
        around the curve; on caps, both are coordinates on a disc.
    same_position : ndarray of int, shape (N,)
        For each sample, one sample at its position, the same for all samples there.
    triangles, quads : ndarray of uint32, shapes (T, 3) and (Q, 4)
        Numbers of samples, counter-clockwise seen from the normal's tip. Each curve has the same
        number of faces.
    grids : tuple of ndarray of uint32, shapes (K, rows, columns)
        The samples of each run of stations that faces connect.
    """

    positions: FloatArray
    normals: FloatArray
    uvs: FloatArray
    same_position: Ints
    triangles: IndexArray
    quads: IndexArray
    grids: tuple[IndexArray, ...]


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of samples, one after another along each of K curves.

    Attributes
    ----------
    positions, normals : ndarray of float64, shape (K, rows, columns, 3)
    uvs : ndarray of float64, shape (K, rows, columns, 2)
    has_faces : ndarray of bool, shape (rows − 1,)
        Whether there are faces between each row and the next.
    is_point : ndarray of bool, shape (rows,)
        Whether each row is one point.
    equal_row : ndarray of int, shape (rows,)
        For each row, an earlier row with the same positions, or the row itself.
    is_ring : bool
        Whether the last column has the positions of the first.
    """

    positions: FloatArray
    normals: FloatArray
    uvs: FloatArray
    has_faces: Bools
    is_point: Bools
    equal_row: Ints
    is_ring: bool


def join_rows(rows: Rows, faces: Faces) -> SweptGrids:
    """Grids of the samples, which are numbered curve by curve and row by row."""
    count, height, width = rows.positions.shape[:3]
    number = np.arange(height * width).reshape(height, width)
    on_one_curve = number[_find_first_equal_rows(rows.equal_row)]
    on_one_curve[rows.is_point] = on_one_curve[rows.is_point, :1]
    if rows.is_ring:
        on_one_curve[:, -1] = on_one_curve[:, 0]
    first_samples = np.arange(count)[:, None] * (height * width)
    same_position = (first_samples + on_one_curve.ravel()).ravel()
    # Samples that are equal up to rounding become equal.
    positions = rows.positions.reshape(-1, 3)[same_position]
    checkpoint()
    triangles, quads = _faces(number, rows, faces)
    checkpoint()
    return SweptGrids(
        positions,
        rows.normals.reshape(-1, 3),
        rows.uvs.reshape(-1, 2),
        same_position,
        _repeat(triangles, first_samples),
        _repeat(quads, first_samples),
        tuple(
            _repeat(number[run].reshape(1, -1), first_samples).reshape(count, -1, width)
            for run in _runs(rows.has_faces)
        ),
    )


def _find_first_equal_rows(equal_row: Ints) -> Ints:
    """For each row the first row with the same positions, after following all references."""
    while (equal_row[equal_row] != equal_row).any():
        equal_row = equal_row[equal_row]
    return equal_row


def _faces(number: Ints, rows: Rows, faces: Faces) -> tuple[Ints, Ints]:
    """Triangles (T, 3) and quads (Q, 4) between the rows of one curve, as numbers of samples."""
    corner = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    is_low_point, is_high_point = rows.is_point[:-1], rows.is_point[1:]
    is_quad = rows.has_faces & ~is_low_point & ~is_high_point
    cells = np.stack([c[is_quad] for c in corner], axis=-1).reshape(-1, 4)
    fans = [
        np.stack([corner[k][is_fan] for k in corner_numbers], axis=-1).reshape(-1, 3)
        for is_fan, corner_numbers in (
            (rows.has_faces & is_low_point & ~is_high_point, (0, 1, 2)),
            (rows.has_faces & ~is_low_point & is_high_point, (0, 1, 3)),
        )
    ]
    if faces == "quads":
        return np.concatenate(fans), cells
    half_cells = cells[:, [0, 1, 3, 1, 2, 3]].reshape(-1, 3)
    return np.concatenate([half_cells, *fans]), np.empty((0, 4), dtype=np.intp)


def _repeat(pattern: Ints, first_samples: Ints) -> IndexArray:
    """The pattern of one curve, repeated for all curves."""
    repeated: IndexArray = (
        (first_samples[:, :, None] + pattern).reshape(-1, pattern.shape[1]).astype(np.uint32)
    )
    return repeated


def _runs(has_faces: Bools) -> Sequence[slice]:
    """Runs of two or more rows with faces between them."""
    ends = [0, *(np.flatnonzero(~has_faces) + 1).tolist(), len(has_faces) + 1]
    return [slice(a, b) for a, b in pairwise(ends) if b - a > 1]
