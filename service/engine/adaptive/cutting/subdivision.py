"""Faces cut into cells, until each cell is near enough to two triangles or to a fan.

A cell is a box of places of a face (`FaceCells.halve` cuts it). Flat neighbouring patches stay one
cell. The division of a cell depends on that cell alone.

A cell of several spans is estimated by the nets of all of its spans (`span_estimate`). So a level
of cells costs as much as its spans do, and no bend between the corners of spans is missed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.cells import (
    NO_LEAVES,
    SHORTEST,
    FaceCells,
    Leaves,
    Task,
    restrict_to_cells,
)
from service.engine.adaptive.cutting.estimate import estimate_cells
from service.engine.adaptive.cutting.normal_variation import FINEST, Scale
from service.engine.adaptive.cutting.span_estimate import estimate_span_cells
from service.engine.adaptive.cutting.span_pieces import BLOCK as SPAN_BLOCK
from service.engine.adaptive.cutting.span_pieces import NinePoints, count_spans
from service.engine.bounds.faces import SPAN
from service.engine.nets.nets import Nets
from service.engine.nets.subdivision import halve

BLOCK = 1 << 18
"""Numbers in the nets of one block, approximately; it limits memory."""

OVERHEAD = 20
"""Multiplications for every number of a net, in addition to halving."""

AHEAD = 1 << 13
"""Cells and their halves are estimated in one step if their nets have at most this many numbers."""

NORMALS = 2500
"""Multiplications to compare the normals of one cell."""


def divide_cells(task: Task, start: FaceCells, ahead: int = 0) -> Leaves:
    """The leaves of cells, cut until every leaf passes its estimate.

    Parameters
    ----------
    start : FaceCells
        Faces, or cells after cutting.
    ahead : int
        The most numbers in the nets of cells that are estimated in one step with their halves:
        `AHEAD` for whole faces; 0 for cells of which most need no further cut.

    Returns
    -------
    Leaves
        In the order of face, u0, v0. The bits of the leaves of a cell do not depend on other cells.

    Raises
    ------
    TooLarge, InvalidRequest
        The errors of `MeshLimits` and `build_depth_error`.
    """
    leaves: list[Leaves] = []
    several = np.any(start.extents > SPAN, axis=0)
    if several.any():
        leaves, single = _divide_several_spans(task, start.take(several))
        start = FaceCells.join([start.take(~several), *single])
    for nets, rows in task.patch_nets.split_by_group(task.find_patches(start)):
        leaves += _divide_single_spans(task, start.take(rows), nets, ahead)
    every = Leaves.join(leaves or [NO_LEAVES])
    return every.take(np.lexsort((every.rectangle[2], every.rectangle[0], every.face)))


def _divide_several_spans(task: Task, start: FaceCells) -> tuple[list[Leaves], list[FaceCells]]:
    """Leaves of several spans, and the cells of one span that remain to be estimated."""
    leaves: list[Leaves] = []
    single: list[FaceCells] = []
    nine_points, waiting = NinePoints(task), [start]
    while waiting:
        cells = waiting.pop()
        while waiting and len(cells) + len(waiting[-1]) <= SPAN_BLOCK:
            cells = FaceCells.join([cells, waiting.pop()])
        # The first cells, with up to `SPAN_BLOCK` spans together; the others wait.
        fitting = int(np.searchsorted(np.cumsum(count_spans(cells)), SPAN_BLOCK, side="right"))
        if 0 < fitting < len(cells):
            waiting.append(cells.take(slice(fitting, None)))
            cells = cells.take(slice(fitting))
        # `candidates` are all cells as leaves; those that do not fail become leaves.
        fails, candidates = estimate_span_cells(task, cells, nine_points)
        leaves.append(candidates.take(~fails))
        cut = cells.take(fails)
        # A very thin cell is cut in its longer direction: where it contains a crease, its normals
        # turn however thin it is. That direction has several spans, and `halve` cuts at a knot.
        # In the end the spans are estimated one by one.
        thin = cut.extents <= SPAN * FINEST
        halves = cut.halve(np.where(thin[0] | thin[1], thin[0], candidates.along_v[fails]))
        several = count_spans(halves) > 1
        single.append(halves.take(~several))
        if several.any():
            waiting.append(halves.take(several))
    return leaves, single


@dataclass(frozen=True, eq=False, slots=True)
class SpanCells(FaceCells):
    """m cells of one span each, with their patches (m,) and nets (p+1, q+1, D, m), p, q ≥ 2."""

    patch: Ints
    nets: FloatArray


def _divide_single_spans(task: Task, start: FaceCells, nets: Nets, ahead: int) -> Iterator[Leaves]:
    """Leaves of cells of one span and one degree, deepest first, block by block."""
    degrees = max(nets.degree[0], 2), max(nets.degree[1], 2)
    numbers = (degrees[0] + 1) * (degrees[1] + 1) * nets.values.shape[2]
    block = max(16, BLOCK // numbers)
    has_angle = task.goal.angle < np.pi
    patches, leaves = task.find_patches(start), 0
    for first in range(0, len(start), block):
        chosen, patch = start.take(slice(first, first + block)), patches[first : first + block]
        restricted = restrict_to_cells(nets, task.patch_nets.row[patch], chosen)
        waiting = [SpanCells(chosen.rectangle, chosen.face, patch, restricted)]
        while waiting:
            cells, sizes = _add_halves(_take_block(waiting, block), ahead)
            work = cells.nets.size * (sum(degrees) + OVERHEAD)
            task.limits.spend(work + NORMALS * len(cells) if has_angle else work)
            extents = cells.extents / SPAN
            scale = Scale(extents, task.patch_nets.sizes[cells.patch]) if has_angle else None
            fails, candidates = estimate_cells(
                *(cells, cells.nets, task.goal),
                eye=task.find_eyes(cells.patch),
                scale=scale,
                at_border=task.find_border_sides(cells),
            )
            done, cut = _choose_leaves(fails, candidates.along_v, sizes)
            if len(done):
                yield candidates.take(done)
                leaves += len(done)
                task.limits.count(leaves)
            if len(cut):
                halves = _halve_cells(cells, candidates.along_v, cut)
                waiting += [halves.take(slice(k, k + block)) for k in range(0, len(halves), block)]


def _take_block(waiting: list[SpanCells], block: int) -> SpanCells:
    """The last of the waiting cells, which may be few: up to `block` cells in one step."""
    parts = [waiting.pop()]
    total = len(parts[0])
    while waiting and total + len(waiting[-1]) <= block:
        parts.append(waiting.pop())
        total += len(parts[-1])
    return SpanCells.join(parts)


def _choose_leaves(is_failing: Bools, along_v: Bools, sizes: list[int]) -> tuple[Ints, Ints]:
    """Rows of the leaves, and of the cells to be cut, among cells and their halves by levels."""
    leaves, level = [], np.arange(sizes[0])
    for size in sizes:
        fails = is_failing[level]
        leaves.append(level[~fails])
        cut = level[fails]
        # `_add_halves` puts four blocks of `size` halves behind the level; a cut along v uses the
        # last two.
        half = cut + size * (1 + 2 * along_v[cut])
        level = np.concatenate([half, half + size])
    return np.concatenate(leaves), cut


def _halve_cells(cells: SpanCells, along_v: Bools, cut: Ints) -> SpanCells:
    """Halves of the cells `cut`: all first halves, then all second ones.

    Among each, those of cells whose u is halved come before those of cells whose v is halved.
    """
    cut = cut[along_v[cut].argsort(kind="stable")]
    along_v, whole = along_v[cut], cells.take(cut)
    # The last two axes: first or second half, cell.
    nets = np.empty((*cells.nets.shape[:3], 2, len(cut)))
    middle = len(cut) - int(np.count_nonzero(along_v))
    for axis, rows in enumerate((slice(0, middle), slice(middle, None))):
        if len(cut[rows]):
            halve(whole.nets[..., rows], axis, nets[..., rows])
    halves, patch = whole.halve(along_v), np.concatenate([whole.patch, whole.patch])
    return SpanCells(halves.rectangle, halves.face, patch, nets.reshape(*nets.shape[:3], -1))


def _add_halves(cells: SpanCells, ahead: int) -> tuple[SpanCells, list[int]]:
    """Cells, followed level by level by all their halves, and the sizes of the levels.

    A step takes as long for a hundred cells as for one. So several levels are estimated at once, if
    their nets have at most `ahead` numbers. After a level come the first halves along u, the second
    halves along u, and those along v.
    """
    sizes, total = [len(cells)], len(cells)
    size, short = cells.nets[..., 0].size, int(cells.extents.min(initial=SPAN))
    while (total + 4 * sizes[-1]) * size <= ahead and short >> len(sizes) >= SHORTEST:
        sizes.append(4 * sizes[-1])
        total += sizes[-1]
    if len(sizes) == 1:
        return cells, sizes
    shape = cells.nets.shape[:3]
    every_net, rectangles = np.empty((*shape, total)), np.empty((4, total), dtype=np.intp)
    every_net[..., : sizes[0]], rectangles[:, : sizes[0]] = cells.nets, cells.rectangle
    end = 0
    for size in sizes[:-1]:
        begin, end = end, end + size
        low, high = rectangles[::2, begin:end], rectangles[1::2, begin:end]
        # Axes: row of the rectangle, half (two along u, two along v), cell. All halves begin as the
        # whole cell; then one end of each is moved to the middle.
        halves = rectangles[:, end : end + 4 * size].reshape(4, 4, size)
        halves[::2], halves[1::2] = low[:, np.newaxis], high[:, np.newaxis]
        halves[1, 0] = halves[0, 1] = (low[0] + high[0]) // 2
        halves[3, 2] = halves[2, 3] = (low[1] + high[1]) // 2
        nets = every_net[..., end : end + 4 * size].reshape(*shape, 2, 2, size)
        for axis in (0, 1):
            halve(every_net[..., begin:end], axis, nets[..., axis, :, :])
    origin = np.arange(total) % sizes[0]  # the cell of `cells` that each rectangle is in
    return SpanCells(rectangles, cells.face[origin], cells.patch[origin], every_net), sizes
