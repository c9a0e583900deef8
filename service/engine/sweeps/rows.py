"""Rows of samples along curves, numbered and joined to faces."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, IndexArray, Ints
from service.bases.row_batches import split_runs
from service.cancellation import checkpoint
from service.engine.clustering import find_components
from service.engine.options import Faces
from service.engine.plans.faces import drop_slivers


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
        Numbers of samples, counter-clockwise seen from the normal's tip.
    grids : tuple of ndarray of uint32, shapes (K, rows, columns)
        The samples of each run of frames that faces connect.
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
    is_repeated : ndarray of bool, shape (K, rows − 1, columns)
        Whether each sample, up to rounding, has the position of the sample before it: the one of
        the same column in the row before.
    equal_row : ndarray of int, shape (rows,)
        For each row, another row with the same positions, or the row itself. All rows with the
        same positions lead to one row.
    is_ring : bool
        Whether the last column has the positions of the first.
    """

    positions: FloatArray
    normals: FloatArray
    uvs: FloatArray
    has_faces: Bools
    is_point: Bools
    is_repeated: Bools
    equal_row: Ints
    is_ring: bool


def join_rows(rows: Rows, faces: Faces) -> SweptGrids:
    """Grids of the samples, which are numbered curve by curve and row by row."""
    count, row_count, columns = rows.positions.shape[:3]
    number = np.arange(row_count * columns).reshape(row_count, columns)
    equal_row = rows.equal_row
    while (equal_row[equal_row] != equal_row).any():  # some rows lead to rows that lead further
        equal_row = equal_row[equal_row]
    # A closed curve of one division has the same row twice, and no faces between.
    rows = replace(rows, has_faces=rows.has_faces & (equal_row[1:] != equal_row[:-1]))
    # For each sample of one curve, the number of a sample at the same position.
    equal_sample = number[equal_row]
    equal_sample[rows.is_point] = equal_sample[rows.is_point, :1]
    if rows.is_ring:
        equal_sample[:, -1] = equal_sample[:, 0]
    first_samples = np.arange(count)[:, None] * (row_count * columns)
    same_position = (first_samples + equal_sample.ravel()).ravel()
    # Samples that are equal up to rounding become equal.
    positions = rows.positions.reshape(-1, 3)[same_position]
    checkpoint()
    triangles, quads = _faces(number, rows, faces)
    checkpoint()
    grids = SweptGrids(
        positions,
        rows.normals.reshape(-1, 3),
        rows.uvs.reshape(-1, 2),
        same_position,
        _repeat(triangles, first_samples),
        _repeat(quads, first_samples),
        tuple(
            _repeat(number[run].reshape(1, -1), first_samples).reshape(count, -1, columns)
            for run in _list_runs(rows)
            if len(run) > 1
        ),
    )
    if not rows.is_repeated.any():
        return grids
    curve, row, column = np.nonzero(rows.is_repeated)
    samples = (curve * row_count + row) * columns + column
    return unite_samples(grids, samples, samples + columns)


def _list_runs(rows: Rows) -> list[Ints]:
    """The rows of each run that faces connect, without rows that repeat the row before."""
    is_new = np.append(True, ~rows.is_repeated.all(axis=(0, 2)))
    row = np.arange(len(is_new))
    return [row[run][is_new[run]] for run in split_runs(~rows.has_faces)]


def unite_samples(grids: SweptGrids, first: Ints, second: Ints) -> SweptGrids:
    """The grids after samples `first` (n,) and `second` (n,), at the ends of edges, become one.

    Faces that then have no area are left out, and a quad with one such edge becomes a triangle. A
    closed surface stays closed.
    """
    count = len(grids.positions)
    same_position = find_components(
        count,
        np.concatenate([np.arange(count), first]),
        np.concatenate([grids.same_position, second]),
    )
    counts = np.array([[len(grids.triangles)], [len(grids.quads)]])
    triangles, quads, _ = drop_slivers(grids.triangles, grids.quads, counts, same_position)
    return replace(
        grids,
        positions=grids.positions[same_position],
        same_position=same_position,
        triangles=triangles,
        quads=quads,
    )


def _faces(number: Ints, rows: Rows, faces: Faces) -> tuple[Ints, Ints]:
    """Triangles (T, 3) and quads (Q, 4) between the rows of one curve, as numbers of samples."""
    # The corners of all quads: 0 and 3 on the lower row, 1 and 2 on the upper row.
    corner = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    is_low_point, is_high_point = rows.is_point[:-1], rows.is_point[1:]
    is_quad = rows.has_faces & ~is_low_point & ~is_high_point
    quads = np.stack([c[is_quad] for c in corner], axis=-1).reshape(-1, 4)
    # If one of the two rows is a point, each quad becomes a triangle.
    triangles_at_points = [
        np.stack([corner[k][is_triangle] for k in corner_numbers], axis=-1).reshape(-1, 3)
        for is_triangle, corner_numbers in (
            (rows.has_faces & is_low_point & ~is_high_point, (0, 1, 2)),
            (rows.has_faces & ~is_low_point & is_high_point, (0, 1, 3)),
        )
    ]
    if faces == "quads":
        return np.concatenate(triangles_at_points), quads
    halves_of_quads = quads[:, [0, 1, 3, 1, 2, 3]].reshape(-1, 3)
    return np.concatenate([halves_of_quads, *triangles_at_points]), np.empty((0, 4), dtype=np.intp)


def _repeat(pattern: Ints, first_samples: Ints) -> IndexArray:
    """The pattern of one curve, repeated for all curves."""
    return (first_samples[:, :, None] + pattern).reshape(-1, pattern.shape[1]).astype(np.uint32)


def join_grids(grids: Sequence[SweptGrids]) -> SweptGrids:
    """One value of several, with their samples one after another."""
    counts = [len(each.positions) for each in grids]
    starts = np.cumsum([0, *counts[:-1]], dtype=np.uint32)
    shifted = [
        replace(
            each,
            same_position=each.same_position + start,
            triangles=each.triangles + start,
            quads=each.quads + start,
            grids=tuple(grid + start for grid in each.grids),
        )
        for each, start in zip(grids, starts, strict=True)
    ]
    return SweptGrids(
        positions=np.concatenate([each.positions for each in shifted]),
        normals=np.concatenate([each.normals for each in shifted]),
        uvs=np.concatenate([each.uvs for each in shifted]),
        same_position=np.concatenate([each.same_position for each in shifted]),
        triangles=np.concatenate([each.triangles for each in shifted]),
        quads=np.concatenate([each.quads for each in shifted]),
        grids=tuple(grid for each in shifted for grid in each.grids),
    )
