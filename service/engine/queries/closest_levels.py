"""The search for the closest points to some points, level by level; `closest` states its result.

A pair of a point and a cell is open until the cell is farther than a known point of the surface,
has no minimum of its patch, or is settled. Newton's method computes the minima of settled cells,
the nearest first, which shows that most of the others are farther.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.queries import cell_models as columns
from service.engine.queries.cell_models import UNIT
from service.engine.queries.distance_bounds import Minima, cell_bounds, least_change
from service.engine.queries.nearest import ClosestPoints, Nearest
from service.engine.queries.newton import measure_places
from service.engine.queries.patch_tree import PatchTree, sphere_bounds
from service.engine.queries.shares import Share

PAIRS = 1 << 13
"""Pairs of a point and a cell in one chunk."""

MOST_PAIRS, MOST_OPEN = 1000, 1 << 18
"""The most cells that are open at a time: for one point, and for all points together."""

ROUNDING, LEAST = 48 * 2.0**-53, 2.0**-36
"""The least widths of intervals. The first is relative to the distance: rounding alone makes
intervals 14 to 40 units of 2⁻⁵³ wide. The second is in the coordinates of the nets: narrower minima
are never settled."""

COARSE = 0.2
"""Strain above which a cell is halved at once, because its bounds would be too wide."""

STEPS = 8
"""The most steps of Newton's method; then the cell is halved."""

ENOUGH = 1 / 2
"""Width of an interval, in units of the tolerance, at which a cell is no longer halved."""

EXACT = 2.0**-40
"""Distance from the minimum, in the coordinates of the nets, at which Newton's method ends."""


NO_PAIRS = np.zeros(0, np.intp), np.zeros(0, np.intp)


class ClosestLevels:
    """The search for the closest points to some points.

    Parameters
    ----------
    patches : PatchTree
    points : ndarray of float64, shape (m, 3)
    share : Share
        The pairs whose bounds may be computed.
    tolerance : float
        How wide intervals may be.
    each : int
        The most pairs of one point in the tree of patches.
    can_split : bool
        Whether to end as soon as too many pairs are open, so that the caller can split the points.
        The tree of patches ends in this case even if false.

    Attributes
    ----------
    is_crowded : bool
        Whether the search ended because too many pairs were open.
    most_open : int
        The most pairs that were open at a time.
    in_tree : ndarray of int, shape (m,)
        The pairs of each point that the tree of patches left.
    """

    def __init__(
        self,
        patches: PatchTree,
        points: FloatArray,
        share: Share,
        tolerance: float,
        each: int,
        *,
        can_split: bool,
    ) -> None:
        self.can_split, self.is_crowded, self.most_open = can_split, False, 0
        self.each, self.in_tree = each, np.zeros(len(points), np.intp)
        self.share, self.cells, self.patches = share, patches.cells, patches
        self.enough = max(ENOUGH * tolerance, LEAST)
        self.x = np.ascontiguousarray(points.T)
        self.nearest = Nearest(self.cells, self.x, tolerance)
        self.settled: list[tuple[Ints, Ints, Minima]] = []
        self.waiting = NO_PAIRS

    def search(self) -> ClosestPoints | None:
        """All levels, until no pair is left; None if the tree of patches is too crowded."""
        candidates = self.patches.candidates(self.x, self.each)
        if candidates is None:
            return None
        for ended_point, ended_cell, low, upper in candidates.ended:
            self.nearest.add_centers(ended_point, ended_cell, upper)
            self.nearest.end_open_cells(ended_point, ended_cell, low)
        point_lists = [candidates.point, *(ended[0] for ended in candidates.ended)]
        self.in_tree = np.bincount(np.concatenate(point_lists), minlength=self.x.shape[1])
        self.most_open = candidates.widest
        point, cell = candidates.point, candidates.cell
        while len(point):
            checkpoint()
            next_pairs = [self.step(point, cell)]
            if sum(len(pairs[0]) for pairs in self.settled) >= len(next_pairs[0][0]):
                # Minima are computed first, because they show that most open cells are farther.
                next_pairs.append(self.polish())
            next_pairs.append(self.waiting)
            self.waiting = NO_PAIRS
            point, cell = _join_pairs(next_pairs)
        return self.nearest.answer()

    def step(self, point: Ints, cell: Ints) -> tuple[Ints, Ints]:
        """The pairs of the next level; pairs that are settled on this level are stored."""
        low = np.empty(len(point))
        for part in row_slices(len(point), 1, PAIRS):
            model = self.cells.models[:5].take(cell[part], axis=1)
            low[part], upper = sphere_bounds(model, self.x.take(point[part], axis=1))
            self.nearest.add_centers(point[part], cell[part], upper)
        near = self.affordable(np.flatnonzero(low <= self.nearest.limit(point)), point, cell, low)
        is_open = self.cells.is_coarse(cell[near], COARSE)
        looked = np.flatnonzero(~is_open)
        for part in row_slices(len(looked), 1, PAIRS):
            chosen = looked[part]
            rows = near[chosen]
            is_open[chosen], low[rows] = self.look(point[rows], cell[rows], low[rows])
        rows = near[is_open]
        return self.halve(point[rows], cell[rows], low[rows])

    def affordable(self, near: Ints, point: Ints, cell: Ints, low: FloatArray) -> Ints:
        """The rows of `near` whose points continue; the other points wait or end."""
        goes, ends = self.share.allot(np.bincount(point[near], minlength=self.x.shape[1]))
        if goes.all():
            return near
        rows = near[ends[point[near]]]
        self.nearest.end_open_cells(point[rows], cell[rows], low[rows])
        rows = near[~(goes | ends)[point[near]]]
        self.waiting = point[rows], cell[rows]
        return near[goes[point[near]]]

    def look(self, point: Ints, cell: Ints, low: FloatArray) -> tuple[Bools, FloatArray]:
        """Computes bounds of pairs: which pairs stay open, and squares of their lower bounds."""
        bounds = cell_bounds(
            self.cells.models.take(cell, axis=1),
            self.cells.place.take(cell, axis=1),
            self.cells.point_sides.take(cell, axis=1),
            self.x.take(point, axis=1),
            self.enough / 8,
        )
        low = np.maximum(bounds.low, low)
        is_near = low <= self.nearest.limit(point)
        rows = np.flatnonzero(is_near & bounds.settled)
        if len(rows):
            self.settled.append((point[rows], cell[rows], bounds.minima(rows)))
        return is_near & ~(bounds.empty | bounds.settled), low

    def halve(self, point: Ints, cell: Ints, low: FloatArray) -> tuple[Ints, Ints]:
        """The children of open pairs; those beyond the budget end."""
        best = np.sqrt(self.nearest.best)
        stop = best[point] - np.sqrt(np.maximum(low, 0.0)) <= self.enough_at(best[point])
        stop |= np.bincount(point, minlength=len(best))[point] > MOST_PAIRS
        stop |= ~self.cells.can_halve(cell)
        if stop.any():
            self.nearest.end_open_cells(point[stop], cell[stop], low[stop])
            point, cell = point[~stop], cell[~stop]
        self.most_open = max(self.most_open, len(point))
        if len(point) > MOST_OPEN and self.can_split:
            self.is_crowded = True
            point, cell = point[:0], cell[:0]
        if not len(point):
            return point, cell
        children, parents = self.cells.children(cell)
        return point[parents], children

    def enough_at(self, distance: FloatArray) -> FloatArray:
        """Widths of intervals that are narrow enough at these distances."""
        return np.maximum(self.enough, ROUNDING * distance)

    def polish(self) -> tuple[Ints, Ints]:
        """Newton's method in settled cells, the nearest first; returns the pairs that stay open."""
        if not self.settled:
            return NO_PAIRS
        point = np.concatenate([point for point, _, _ in self.settled])
        cell = np.concatenate([cell for _, cell, _ in self.settled])
        bounds = Minima.join([bounds for _, _, bounds in self.settled])
        self.settled = []
        order = np.lexsort((cell, bounds.estimate, point))
        is_first = np.diff(point[order], prepend=-1) > 0
        left = []
        for chosen in (order[is_first], order[~is_first]):
            rows = chosen[bounds.low[chosen] <= self.nearest.limit(point[chosen])]
            if len(rows):
                left.append(rows[~self.descend(point[rows], cell[rows], bounds.take(rows))])
        rows = np.concatenate(left) if left else np.zeros(0, np.intp)
        rows = rows[np.lexsort((cell[rows], point[rows]))]
        return self.halve(point[rows], cell[rows], bounds.low[rows])

    def descend(self, point: Ints, cell: Ints, minima: Minima) -> Bools:
        """Computes the minima of settled pairs; returns which pairs ended."""
        ended = np.zeros(len(point), bool)
        rows, net, at = np.arange(len(point)), self.cells.net[cell], minima.start
        place = self.cells.place.take(cell, axis=1)
        errors = self.cells.models[columns.SLOPE_A : columns.LEAST_B + 1].take(cell, axis=1)
        x = self.x.take(point, axis=1)
        for remaining in range(STEPS, 0, -1):
            reached = measure_places(self.cells, net, place, at, x)
            wrong = errors[:2] * reached.distance + errors[2:] + 4 * UNIT * np.abs(reached.gradient)
            change = 2 * least_change(reached.gradient, minima.convexity, at)
            low = reached.low * reached.low + change - 4 * wrong.sum(axis=0) - minima.loss
            is_far = low > self.nearest.limit(point)
            is_narrow = reached.high - np.sqrt(np.maximum(low, 0.0)) <= self.enough_at(reached.high)
            if (
                remaining > 1
            ):  # one more step makes the place exact; the distance changes too little to show this
                is_narrow &= change >= -EXACT * EXACT
            is_narrow &= ~is_far
            is_done = np.flatnonzero(is_narrow | (remaining == 1))
            self.nearest.add_places(point[is_done], net[is_done], reached.take(is_done))
            self.nearest.end_cells(point[is_narrow], low[is_narrow])
            is_narrow |= is_far
            ended[rows[is_narrow]] = True
            remaining_rows = np.flatnonzero(~is_narrow)
            if remaining == 1 or not len(remaining_rows):
                break
            at = reached.next(at, minima.sides).take(remaining_rows, axis=1)
            rows, net, point, minima = (
                rows[remaining_rows],
                net[remaining_rows],
                point[remaining_rows],
                minima.take(remaining_rows),
            )
            place, errors, x = (each.take(remaining_rows, axis=1) for each in (place, errors, x))
        return ended


def _join_pairs(pairs: Sequence[tuple[Ints, Ints]]) -> tuple[Ints, Ints]:
    """Pairs of a point and a cell, in the order of points."""
    filled = [each for each in pairs if len(each[0])]
    if len(filled) < 2:
        return filled[0] if filled else NO_PAIRS
    point, cell = (np.concatenate(each) for each in zip(*filled, strict=True))
    order = np.argsort(point, kind="stable")
    return point[order], cell[order]
