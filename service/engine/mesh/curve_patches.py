"""Leaves out patches that are curves: they have no area, so a mesh omits them.

A patch is a curve if, on each line of control points from one long side to the other long side, all
control points and weights are equal. (A knot span of width 0 lowers to patches like this.) The two
long sides are one edge. Triangles between them would have no area, and more than two triangles
would use the edge.

The mesh omits the patch if another patch of the same part has this edge; or, for a patch that is
one point, this corner. Then every point of the patch is also a point of the other patch, which the
bound of the deviation covers. If all patches of a part are curves on patches of other parts, the
mesh omits them, too; the part then has no triangles, and no bound.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.triangle_polynomials import exponents, row_number
from service.engine.mesh.connectivity import Connectivity
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import Domain, PatchModel
from service.surface.repatched import rebuild, surfaces_of


def leave_out_curves(model: PatchModel, connectivity: Connectivity) -> PatchModel:
    """The model without the patches that a mesh omits."""
    first = np.cumsum([0, *(batch.count for batch in model.batches)])
    thin_numbers = []
    for which, rows, line in find_thin(model.batches, connectivity):
        points, weights = flatten_nets(model.batches[which], rows)
        is_curve = (points == points[:, line]).all(axis=(1, 2))
        if weights is not None:
            is_curve &= (weights == weights[:, line]).all(axis=1)
        thin_numbers.append(first[which] + rows[is_curve])
    thin = np.concatenate(thin_numbers)
    side = connectivity.thin_sides[thin]
    edge = connectivity.edge[thin, np.where(side == 2, 0, 2)]
    # A patch that is one point may be a corner of other patches.
    is_point = connectivity.collapsed[thin, np.where(side == 2, 0, 2)]
    keys = np.where(is_point, -1 - connectivity.corner[thin, 0], edge)
    is_kept = np.ones(model.patch_count, dtype=bool)
    is_kept[thin] = False
    part = model.part_numbers
    keys_of_patches = np.concatenate([connectivity.edge, -1 - connectivity.corner], axis=1)
    is_kept[thin] = ~np.isin(keys, keys_of_patches[is_kept])
    has_kept_patch = np.bincount(part[is_kept], minlength=len(model.parts)) > 0
    width = int(np.ptp(keys_of_patches)) + 1
    in_part = np.isin(
        keys + width * part[thin], (keys_of_patches + width * part[:, np.newaxis])[is_kept]
    )
    is_kept[thin] |= has_kept_patch[part[thin]] & ~in_part
    return model if is_kept.all() else _take_patches(model, is_kept)


def find_thin(
    batches: Sequence[Patches], connectivity: Connectivity
) -> Iterator[tuple[int, Ints, Ints]]:
    """Yields the patches that may be curves, grouped by batch and by the side that is a point.

    Yields
    ------
    batch : int
    rows : ndarray of int
        The patches, numbered within the batch.
    line : ndarray of int, shape (n,)
        For each control point of a net, the control point on a long side that is on the same line
        across the patch.
    """
    first = 0
    for number, batch in enumerate(batches):
        sides = connectivity.thin_sides[first : first + batch.count]
        first += batch.count
        for side in np.unique(sides[sides >= 0]).tolist():
            yield number, np.flatnonzero(sides == side), _find_lines(batch, side)


def flatten_nets(batch: Patches, rows: Ints) -> tuple[FloatArray, FloatArray | None]:
    """Control points (m, n, 3) and weights (m, n) of some patches; a net has n points."""
    weights = None if batch.weights is None else batch.weights[rows].reshape(len(rows), -1)
    return batch.points[rows].reshape(len(rows), -1, 3), weights


def _find_lines(batch: Patches, side: int) -> Ints:
    """The result `line` of `find_thin`; the lines are parallel to the side that is a point."""
    if isinstance(batch, TensorPatches):
        p, q = batch.degree
        number = np.arange((p + 1) * (q + 1)).reshape(p + 1, q + 1)
        begin = number[:1] if side == 2 else number[:, :1]
        return np.broadcast_to(begin, number.shape).ravel()
    n = batch.side_degrees[0]
    i, j, k = exponents(n)
    # k, j or i is constant on a line, which begins on the side s = 0 or on the side t = 0.
    return row_number(n, *((0 * j, k), (j, 0 * k), (n - i, 0 * k))[(2, 0, 1).index(side)])


def _take_patches(model: PatchModel, is_kept: Bools) -> PatchModel:
    """The model with the patches for which `is_kept` (P,); surfaces become one or more grids."""
    domains: list[Domain] = []
    numbers: list[Ints] = []
    count = 0
    for surface in surfaces_of(model):
        rows, columns = len(surface.u) - 1, len(surface.v) - 1
        grid = surface.first + np.arange(rows * columns).reshape(rows, columns)
        for (top, bottom), (left, right) in _rectangles(is_kept[grid]):
            block = grid[top:bottom, left:right].ravel()
            u, v = surface.u[top : bottom + 1], surface.v[left : right + 1]
            domains.append(Domain(u, v, count))
            numbers.append(block)
            count += len(block)
    owner = np.concatenate(numbers)
    ends = np.cumsum([0, *(batch.count for batch in model.batches)])
    pieces: list[list[Patches]] = []
    for batch, (first, last) in zip(model.batches, pairwise(ends.tolist()), strict=True):
        kept_rows = owner[(owner >= first) & (owner < last)] - first
        pieces.append([batch.take(kept_rows)] if len(kept_rows) else [])
    return rebuild(model, pieces, owner, tuple(domains))


def _rectangles(cells: Bools) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Yields (first, last) rows and columns of rectangles that cover each true cell (m, n) once."""
    for top, bottom in _runs((cells[1:] != cells[:-1]).any(axis=1)):
        row = cells[top]
        for left, right in _runs(row[1:] != row[:-1]):
            if row[left]:
                yield (top, bottom), (left, right)


def _runs(changes: Bools) -> Iterator[tuple[int, int]]:
    """Yields runs (first, last) of equal lines; `changes` says which lines differ from the next."""
    return pairwise([0, *(np.flatnonzero(changes) + 1).tolist(), len(changes) + 1])
