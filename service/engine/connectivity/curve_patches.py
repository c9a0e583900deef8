"""Thin patches: they become curves, and a mesh omits patches that are curves, without area.

Beside a side that is one point, a patch has two *long* sides. The patch is a curve if, on each line
of control points from one long side to the other, all control points and weights are equal. (A knot
span of width 0 lowers to patches like this.) The two long sides are then one edge. Triangles
between them would have no area, and more than two triangles would use the edge.

A patch is *thin* if it is about as narrow as the distance of points that count as equal, as from a
knot span about as short. After near points were made equal (`service.engine.joining.snap`), the
control points of its two long sides are equal in pairs, and both sides are one edge, where the two
neighbours of the patch meet. So on each line of control points from side to side, all control
points and weights become those of one side.

The mesh omits the patch if another patch of the same part has this edge; or, for a patch that is
one point, this corner. Then every point of the patch is also a point of the other patch, which the
bound of the deviation covers. If all patches of a part are curves on patches of other parts, the
mesh omits them, too; the part then has no triangles, and no bound.

Proofs in docs/proofs.md: "Missing triangles" and "Moved control points".
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import split_runs
from service.bases.triangle import exponents, find_index
from service.engine.connectivity.incidence import Connectivity
from service.engine.vectors import length
from service.surface.batches import Patches, TensorPatches
from service.surface.lowered import Domain, PatchModel
from service.surface.multipatch import rebuild, surfaces_of

WIDTH = 2.0
"""The largest distance of control points from the side, in units of `distance`, and the largest
difference of logarithms of weights, in units of `weight_tolerance`. Points of one edge are at most
1 unit apart, and points between two sides of a knot span lie between the sides, up to rounding."""


def leave_out_curves(model: PatchModel, connectivity: Connectivity) -> PatchModel:
    """The model without the patches that a mesh omits."""
    first_patches = np.cumsum([0, *(batch.count for batch in model.batches)])
    curve_numbers = []
    for batch_number, rows, line in _find_thin(model.batches, connectivity):
        points, weights = _flatten_nets(model.batches[batch_number], rows)
        is_curve = (points == points[:, line]).all(axis=(1, 2))
        if weights is not None:
            is_curve &= (weights == weights[:, line]).all(axis=1)
        curve_numbers.append(first_patches[batch_number] + rows[is_curve])
    curves = np.concatenate(curve_numbers)
    # Sides 0 and 1 are u = 0 and u = 1; sides 2 and 3 are v = 0 and v = 1. If the side that is one
    # point is side 2, side 0 is a long side, else side 2 is.
    long_side = np.where(connectivity.thin_sides[curves] == 2, 0, 2)
    edge = connectivity.edge[curves, long_side]
    # A patch that is one point may be a corner of other patches.
    is_point = connectivity.collapsed[curves, long_side]
    # A key is the number of an edge, from 0, or −1 minus the number of a corner, below 0.
    keys = np.where(is_point, -1 - connectivity.corner[curves, 0], edge)
    is_kept = np.ones(model.patch_count, dtype=bool)
    is_kept[curves] = False
    part = model.part_numbers
    # The keys of all edges and corners of each patch, (P, 8).
    keys_of_patches = np.concatenate([connectivity.edge, -1 - connectivity.corner], axis=1)
    # First, a curve is omitted if any patch that is no curve has its key.
    is_kept[curves] = ~np.isin(keys, keys_of_patches[is_kept])
    # But if its part keeps any patch, one of the kept patches of this part must have its key.
    has_kept_patch = np.bincount(part[is_kept], minlength=len(model.parts)) > 0
    # Adding `key_count` times the number of the part makes equal keys of different parts differ.
    key_count = int(np.ptp(keys_of_patches)) + 1
    is_on_own_part = np.isin(
        keys + key_count * part[curves],
        (keys_of_patches + key_count * part[:, np.newaxis])[is_kept],
    )
    is_kept[curves] |= has_kept_patch[part[curves]] & ~is_on_own_part
    return model if is_kept.all() else _take_patches(model, is_kept)


def collapse_thin_patches(
    batches: Sequence[Patches], connectivity: Connectivity, distance: float, weight_tolerance: float
) -> tuple[list[Patches], float]:
    """The batches with thin patches as curves, and a bound of the distance that any point moved.

    Parameters
    ----------
    connectivity : Connectivity
        Sides that are one edge of it must have equal control points, bit for bit.
    distance, weight_tolerance : float
        Points, and logarithms of weights, at most this far apart count as equal.
    """
    new_batches, max_distance = list(batches), 0.0
    # `rows` are patches whose long sides are one edge. For each control point of a net, `line` has
    # the control point on a long side that is on the same line from side to side.
    for batch_number, rows, line in _find_thin(batches, connectivity):
        batch = new_batches[batch_number]
        nets, net_weights = _flatten_nets(batch, rows)
        points, weights = batch.points.copy(), batch.weights
        bound = length(nets - nets[:, line], -1).max(axis=1)
        is_thin = bound <= WIDTH * distance
        if net_weights is not None and weights is not None:
            change = np.ptp(np.log(net_weights / net_weights[:, line]), axis=1)
            is_thin &= change <= WIDTH * weight_tolerance
            bound += np.expm1(change) * np.linalg.norm(np.ptp(nets, axis=1), axis=1) / 2
            weights = weights.copy()
            weights.reshape(batch.count, -1)[rows[is_thin]] = net_weights[is_thin][:, line]
        points.reshape(batch.count, -1, 3)[rows[is_thin]] = nets[is_thin][:, line]
        new_batches[batch_number] = replace(batch, points=points, weights=weights)
        max_distance = max(max_distance, float(bound[is_thin].max(initial=0.0)))
    return new_batches, max_distance


def _find_thin(
    batches: Sequence[Patches], connectivity: Connectivity
) -> Iterator[tuple[int, Ints, Ints]]:
    """Yields the patches that may be curves, grouped by batch and by the side that is a point.

    Yields
    ------
    batch : int
    rows : ndarray of int
        The patches, numbered within the batch.
    line : ndarray of int, shape (n,)
        For each control point of a net, a control point on a long side: both are on one line of
        control points across the patch.
    """
    first = 0
    for batch_number, batch in enumerate(batches):
        sides = connectivity.thin_sides[first : first + batch.count]
        first += batch.count
        for side in np.unique(sides[sides >= 0]).tolist():
            yield batch_number, np.flatnonzero(sides == side), _find_lines(batch, side)


def _flatten_nets(batch: Patches, rows: Ints) -> tuple[FloatArray, FloatArray | None]:
    """Control points (m, n, 3) and weights (m, n) of some patches; a net has n points."""
    weights = None if batch.weights is None else batch.weights[rows].reshape(len(rows), -1)
    return batch.points[rows].reshape(len(rows), -1, 3), weights


def _find_lines(batch: Patches, side: int) -> Ints:
    """The result `line` of `_find_thin`; the lines are parallel to the side that is a point."""
    if isinstance(batch, TensorPatches):
        p, q = batch.degree
        number = np.arange((p + 1) * (q + 1)).reshape(p + 1, q + 1)
        first_on_line = number[:1] if side == 2 else number[:, :1]
        return np.broadcast_to(first_on_line, number.shape).ravel()
    n = batch.side_degrees[0]
    i, j, k = exponents(n)
    # The exponents (j, k) of the first control point of each line. If the point is side 2, 0 or 1,
    # then k, j or i is constant on a line, which begins on the side s = 0 or on the side t = 0.
    first_exponents = {2: (0 * j, k), 0: (j, 0 * k), 1: (n - i, 0 * k)}[side]
    return find_index(n, *first_exponents)


def _take_patches(model: PatchModel, is_kept: Bools) -> PatchModel:
    """The model with the patches for which `is_kept` (P,); surfaces become one or more grids."""
    domains: list[Domain] = []
    numbers: list[Ints] = []
    count = 0
    for surface in surfaces_of(model):
        grid = surface.first + np.arange(surface.patch_count).reshape(len(surface.u) - 1, -1)
        for rows, columns in _find_rectangles(is_kept[grid]):
            block = grid[rows, columns].ravel()
            u, v = (
                surface.u[rows.start : rows.stop + 1],
                surface.v[columns.start : columns.stop + 1],
            )
            domains.append(Domain(u, v, count))
            numbers.append(block)
            count += len(block)
    old_numbers = np.concatenate(numbers)
    ends = np.cumsum([0, *(batch.count for batch in model.batches)])
    kept_batches: list[list[Patches]] = []
    for batch, (begin, end) in zip(model.batches, pairwise(ends.tolist()), strict=True):
        kept_rows = old_numbers[(old_numbers >= begin) & (old_numbers < end)] - begin
        kept_batches.append([batch.take(kept_rows)] if len(kept_rows) else [])
    return rebuild(model, kept_batches, old_numbers, tuple(domains))


def _find_rectangles(cells: Bools) -> Iterator[tuple[slice, slice]]:
    """Yields rows and columns of rectangles that cover each true cell (m, n) once."""
    for rows in split_runs((cells[1:] != cells[:-1]).any(axis=1)):
        row = cells[rows.start]
        for columns in split_runs(row[1:] != row[:-1]):
            if row[columns.start]:
                yield rows, columns
