"""Patches that are curves: they have no area, so they are left out of a mesh.

A tensor-product patch is a curve if all lines of its net along one direction are equal, and their
weights are: as a patch over a knot span of no width would be. Its two long sides are one edge. The
triangles between them would have no area, and the edge would have more triangles than the two of
its neighbours.

It is left out if another patch of its part has the edge, or the corner if the patch is one point:
every point of it is a point of that patch, which the bound of the deviation covers.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.mesh.connectivity import Connectivity
from service.surface.batches import Patches
from service.surface.lowered import Domain, PatchModel
from service.surface.repatched import rebuild, surfaces_of


def leave_out_curves(model: PatchModel, connectivity: Connectivity) -> PatchModel:
    """The model without patches that are curves and edges of other patches of their parts."""
    first = np.cumsum([0, *(batch.count for batch in model.batches)])
    found, keys = [], []
    for which, axis, rows in find_thin(model.batches, connectivity):
        batch = model.batches[which]
        nets = batch.points[rows]
        is_curve = (nets == np.take(nets, [0], axis=1 + axis)).all(axis=(1, 2, 3))
        if batch.weights is not None:
            own = batch.weights[rows]
            is_curve &= (own == np.take(own, [0], axis=1 + axis)).all(axis=(1, 2))
        patches = first[which] + rows[is_curve]
        # A patch of one point is the corner of others.
        is_point = connectivity.collapsed[patches, 2 * axis]
        edge, corner = connectivity.edge[patches, 2 * axis], connectivity.corner[patches, 0]
        found.append(patches)
        keys.append(np.where(is_point, -1 - corner, edge))
    thin = np.concatenate(found)
    stays = np.ones(model.patch_count, dtype=bool)
    stays[thin] = False
    part = model.part_numbers
    there = np.concatenate([connectivity.edge, -1 - connectivity.corner], axis=1)
    low, high = int(there.min()), int(there.max())
    there += part[:, np.newaxis] * (high - low + 1)
    own = np.concatenate(keys) + part[thin] * (high - low + 1)
    stays[thin] = ~np.isin(own, there[stays])
    return model if stays.all() else _take_patches(model, stays)


def find_thin(
    batches: Sequence[Patches], connectivity: Connectivity
) -> Iterator[tuple[int, int, Ints]]:
    """Where the `thin` patches of a connectivity are.

    Yields
    ------
    number : int
        Of a batch.
    axis : int
        0 if the sides u = 0 and u = 1 are one edge, 1 if v = 0 and v = 1 are.
    rows : ndarray of int
        The patches, numbered within the batch.
    """
    ends = np.cumsum([0, *(batch.count for batch in batches)])
    for axis, patches in enumerate(connectivity.thin):
        cuts = np.searchsorted(patches, ends).tolist()
        for which, (begin, end) in enumerate(pairwise(cuts)):
            if begin < end:
                yield which, axis, patches[begin:end] - ends[which]


def _take_patches(model: PatchModel, stays: Bools) -> PatchModel:
    """The model of some of its patches (P,); each surface becomes grids of those that stay."""
    domains: list[Domain] = []
    numbers: list[Ints] = []
    count = 0
    for surface in surfaces_of(model):
        rows, columns = len(surface.u) - 1, len(surface.v) - 1
        grid = surface.first + np.arange(rows * columns).reshape(rows, columns)
        for (top, bottom), (left, right) in _rectangles(stays[grid]):
            block = grid[top:bottom, left:right].ravel()
            u, v = surface.u[top : bottom + 1], surface.v[left : right + 1]
            domains.append(Domain(u, v, count))
            numbers.append(block)
            count += len(block)
    owner = np.concatenate(numbers)
    ends = np.cumsum([0, *(batch.count for batch in model.batches)])
    pieces: list[list[Patches]] = []
    for batch, (first, last) in zip(model.batches, pairwise(ends.tolist()), strict=True):
        own = owner[(owner >= first) & (owner < last)] - first
        pieces.append([batch.take(own)] if len(own) else [])
    return rebuild(model, pieces, owner, tuple(domains))


def _rectangles(cells: Bools) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Rows and columns of rectangles that cover the true cells (m, n), each once."""
    for top, bottom in _runs((cells[1:] != cells[:-1]).any(axis=1)):
        row = cells[top]
        for left, right in _runs(row[1:] != row[:-1]):
            if row[left]:
                yield (top, bottom), (left, right)


def _runs(changes: Bools) -> Iterator[tuple[int, int]]:
    """Runs of lines that are alike, given (n − 1,) at which of them the next one differs."""
    return pairwise([0, *(np.flatnonzero(changes) + 1).tolist(), len(changes) + 1])
