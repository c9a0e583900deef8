"""Division of cells of several knot spans: flat neighbouring patches stay together in one cell.

A cell of several spans is estimated by the nets of all of its spans (`span_estimate`). So a level
of cells costs as much as its spans do, and no bend between the corners of spans is missed.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.engine.adaptive.cutting.cells import Cells, Leaves, Task
from service.engine.adaptive.cutting.normal_variation import FINEST
from service.engine.adaptive.cutting.span_estimate import AHEAD, estimate_span_cells
from service.engine.adaptive.cutting.span_pieces import BLOCK, NinePoints, count_spans
from service.engine.bounds.faces import SPAN


def divide_spans(task: Task, start: Cells) -> tuple[list[Leaves], list[Cells]]:
    """Leaves of several spans, and the cells of one span that remain to be estimated."""
    leaves: list[Leaves] = []
    rest: list[Cells] = []
    nine_points = NinePoints(task)
    waiting = [start]
    while waiting:
        cells = waiting.pop()
        while waiting and len(cells) + len(waiting[-1]) <= BLOCK:
            cells = Cells.concatenate([cells, waiting.pop()])
        counts = np.cumsum(count_spans(cells))
        fitting = max(1, int(np.searchsorted(counts, BLOCK, side="right")))
        if fitting < len(cells):
            waiting.append(cells.take(slice(fitting, None)))
            cells = cells.take(slice(fitting))
        levels = _build_levels(cells)
        every = Cells.concatenate([level.cells for level in levels])
        is_failing, candidates = estimate_span_cells(task, every, nine_points)
        examined, done = np.arange(len(cells)), []
        for level in levels:
            fails = is_failing[examined]
            done.append(examined[~fails])
            cut = examined[fails]
            along_v = candidates.along_v[cut]
            cut -= level.begin
            if level.halves is None:
                last = level.cells.take(cut)
                both = Cells.concatenate([*last.halve(_choose_cuts(last, along_v))])
                several = count_spans(both) > 1
                rest.append(both.take(~several))
                if several.any():
                    waiting.append(both.take(several))
            else:
                half = cut + 2 * len(level.cells) * along_v
                half = np.concatenate([half, half + len(level.cells)])
                examined = level.number[half]
                rest.append(level.halves.take(half[examined < 0]))
                examined = examined[examined >= 0]
        leaves.append(candidates.take(np.concatenate(done)))
    return leaves, rest


@dataclass(frozen=True, eq=False, slots=True)
class _Level:
    """Cells of several spans, and their halves, of cells that are estimated together.

    Attributes
    ----------
    begin : int
        Number of the first of these cells among the cells that are estimated together.
    cells : Cells
    halves : Cells or None
        All halves: first and second ones across u, then across v; None for the last level.
    number : ndarray of int
        Number of each half among the cells that are estimated together; −1 if it has one span.
    """

    begin: int
    cells: Cells
    halves: Cells | None
    number: Ints


def _build_levels(cells: Cells) -> list[_Level]:
    """Levels of cells, their halves, halves of these, … with at most about `AHEAD` spans together.

    They are estimated together, because a step takes about as long for many cells as for few.
    """
    levels: list[_Level] = []
    begin, total, none = 0, int(count_spans(cells).sum()), np.empty(0, dtype=np.intp)
    while len(cells) and (more := 2 * int(count_spans(cells).sum())) + total <= AHEAD:
        directions = (_choose_cuts(cells, np.full(len(cells), axis == 1)) for axis in (0, 1))
        halves = Cells.concatenate(
            [half for along_v in directions for half in cells.halve(along_v)]
        )
        several = count_spans(halves) > 1
        begin, before = begin + len(cells), begin
        number = np.where(several, begin - 1 + np.cumsum(several), -1)
        levels.append(_Level(before, cells, halves, number))
        cells, total = halves.take(several), total + more
    return [*levels, _Level(begin, cells, None, none)]


def _choose_cuts(cells: Cells, along_v: Bools) -> Bools:
    """The directions of cuts; a cell that is very thin is cut in its longer direction, at knots.

    At a crease along a cell its normals turn however thin it is. Then it is cut into its spans,
    which are estimated one by one.
    """
    thin = cells.box[1::2] - cells.box[::2] <= SPAN * FINEST
    directions: Bools = np.where(thin[0] | thin[1], thin[0], along_v)
    return directions
