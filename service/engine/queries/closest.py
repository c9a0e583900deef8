"""Closest points of a surface to points, each with an interval that holds the distance.

All points and all patches together, level by level: each pair of a point and a cell of a patch
(`cells`) is looked at once. A pair ends where the cell is farther than a point of the surface that
was found already, where it has no minimum of its patch, or where its minimum is settled
(`distance_bounds`); otherwise its cell is halved. In settled cells Newton's method finds the
minimum, and Theorem 2 proves how near it is: a distance that Newton's method did not reach only
makes an interval wider, and then the cell is halved again.

The interval of a point begins with the least lower bound of all its pairs that were not proved to
be farther, and ends with the distance of the point that was found. Its work has a budget: a pair
that is left when it is used up is part of the interval, as it is.

Most points need 20 to 70 pairs to be looked at closely; near the centre of a sphere one needs
25,000. So the points of a request share a number of pairs (`MOST_CLOSE`, `shares`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import fields

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.queries import cell_models as columns
from service.engine.queries.cell_models import UNIT
from service.engine.queries.cells import CellTree
from service.engine.queries.distance_bounds import (
    CellBounds,
    cell_bounds,
    least_change,
    sphere_bounds,
)
from service.engine.queries.nearest import ClosestPoints, Nearest
from service.engine.queries.nets import QueryNets
from service.engine.queries.newton import measure
from service.engine.queries.patch_tree import PatchTree
from service.engine.queries.shares import Share

CHUNK, FEWEST = 4096, 16
"""Points that are looked at together: what is computed of them stays in a processor's cache. Fewer
where their cells take much memory."""

PAIRS = 1 << 14
"""Pairs of a point and a cell that are looked at at a time."""

MOST_PAIRS, MOST_OPEN = 1000, 1 << 18
"""Cells of one point that are open at a time: its budget; and of all points together."""

MOST_CLOSE = 12_000_000
"""Pairs that are looked at closely for all points of a request. One takes 1 to 2.5 µs, so that the
answer comes within half a minute."""

ROUNDED, LEAST = 48 * 2.0**-53, 2.0**-36
"""The least such widths: in units of the distance, of which rounding leaves intervals of 14 to 40
units of 2⁻⁵³; and in the coordinates of the nets, where narrower minima are never settled."""

STEPS = 8
"""Of Newton's method, before a cell is halved instead."""

ENOUGH = 1 / 2
"""Width of an interval at which a cell is not halved any more, in units of the tolerance."""

EXACT = 2.0**-40
"""How far from the minimum, in the coordinates of the nets, Newton's method ends."""


NO_PAIRS = np.zeros(0, np.intp), np.zeros(0, np.intp)


class ClosestSearch:
    """Finds closest points of one surface.

    Parameters
    ----------
    nets : QueryNets
    tolerance : float
        How wide intervals may be, in the coordinates of the nets.
    """

    def __init__(self, nets: QueryNets, tolerance: float) -> None:
        self.tolerance = tolerance
        self.cells = CellTree(nets)
        self.patches = PatchTree(self.cells)

    def find(self, points: FloatArray) -> ClosestPoints:
        """Closest points to `points` (m, 3), in the coordinates of the nets."""
        found = list(self._chunks(points, MOST_CLOSE))
        names = [field.name for field in fields(ClosestPoints)]
        return ClosestPoints(*(np.concatenate([getattr(f, name) for f in found]) for name in names))

    def _chunks(self, points: FloatArray, pairs: int) -> Iterator[ClosestPoints]:
        """Closest points by chunks, which share `pairs` pairs to be looked at closely."""
        first, size = 0, CHUNK
        while first < len(points):
            checkpoint()
            some = points[first : first + size]
            share = pairs * len(some) // (len(points) - first)
            chunk = _Chunk(self, some, share, can_split=size > FEWEST)
            found = chunk.search()
            pairs -= int(chunk.share.spent.sum())
            if size > FEWEST and (chunk.is_crowded or self.cells.is_full):
                size = min(size, len(some)) // 4  # the cells of fewer points find room
            else:
                yield found
                first = first + size
                if 2 * chunk.most_open <= MOST_OPEN:
                    size = min(2 * size, CHUNK)
            self.cells.forget_much()


class _Chunk:
    """The search for the closest points to some points."""

    def __init__(
        self, search: ClosestSearch, points: FloatArray, share: int, *, can_split: bool
    ) -> None:
        self.can_split, self.is_crowded, self.most_open = can_split, False, 0
        self.share = Share(share, len(points))
        self.cells, self.patches = search.cells, search.patches
        self.enough = max(ENOUGH * search.tolerance, LEAST)
        self.x = np.ascontiguousarray(points.T)
        self.nearest = Nearest(self.cells, self.x, search.tolerance)
        self.settled: list[tuple[Ints, Ints, CellBounds]] = []
        self.waiting = NO_PAIRS

    def search(self) -> ClosestPoints:
        """All levels, until no pair is left."""
        point, cell = self.patches.candidates(self.x)
        while len(point):
            next_pairs = [self.step(point, cell)]
            if sum(len(pairs[0]) for pairs in self.settled) >= len(next_pairs[0][0]):
                # Minima are worth finding now: most open cells are farther.
                next_pairs.append(self.polish())
            next_pairs.append(self.waiting)
            self.waiting = NO_PAIRS
            point, cell = _joined(next_pairs)
        return self.nearest.answer()

    def step(self, point: Ints, cell: Ints) -> tuple[Ints, Ints]:
        """The pairs of the next level; those that are settled in this one are put aside."""
        low = np.empty(len(point))
        for rows in row_slices(len(point), 1, PAIRS):
            model = self.cells.models[:5].take(cell[rows], axis=1)
            low[rows], upper = sphere_bounds(model, self.x.take(point[rows], axis=1))
            self.nearest.add_centers(point[rows], cell[rows], upper)
        near = self.affordable(np.flatnonzero(low <= self.nearest.limit(point)), point, cell, low)
        left = [self.look(point[some], cell[some], low[some]) for some in _parts(near)]
        return self.halve(*(np.concatenate(each) for each in zip(*left, strict=True)))

    def affordable(self, near: Ints, point: Ints, cell: Ints, low: FloatArray) -> Ints:
        """Of the pairs `near` those of points that go on; the others wait, or end."""
        goes, ends = self.share.allot(np.bincount(point[near], minlength=self.x.shape[1]))
        if goes.all():
            return near
        rows = near[ends[point[near]]]
        self.nearest.end_cells(point[rows], cell[rows], low[rows])
        rows = near[~(goes | ends)[point[near]]]
        self.waiting = point[rows], cell[rows]
        return near[goes[point[near]]]

    def look(self, point: Ints, cell: Ints, low: FloatArray) -> tuple[Ints, Ints, FloatArray]:
        """Looks closely at pairs: those that stay open, and squares of their lower bounds."""
        bounds = cell_bounds(
            self.cells.models.take(cell, axis=1),
            self.cells.place.take(cell, axis=1),
            self.cells.point_sides.take(cell, axis=1),
            self.x.take(point, axis=1),
            self.enough / 8,
        )
        low = np.maximum(bounds.low, low)
        keep = ~bounds.empty & (low <= self.nearest.limit(point))
        rows = np.flatnonzero(keep & bounds.settled)
        if len(rows):
            self.settled.append((point[rows], cell[rows], bounds.take(rows)))
        rows = np.flatnonzero(keep & ~bounds.settled)
        return point[rows], cell[rows], low[rows]

    def halve(self, point: Ints, cell: Ints, low: FloatArray) -> tuple[Ints, Ints]:
        """The children of open pairs; those beyond the budget end."""
        best = np.sqrt(self.nearest.best)
        stop = best[point] - np.sqrt(np.maximum(low, 0.0)) <= self.enough_at(best[point])
        stop |= np.bincount(point, minlength=len(best))[point] > MOST_PAIRS
        stop |= ~self.cells.can_halve(cell)
        if stop.any():
            self.nearest.end_cells(point[stop], cell[stop], low[stop])
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
        """Widths of intervals that are enough at these distances."""
        return np.maximum(self.enough, ROUNDED * distance)

    def polish(self) -> tuple[Ints, Ints]:
        """Newton's method in settled cells, the nearest first; the pairs that it did not end."""
        if not self.settled:
            return NO_PAIRS
        point = np.concatenate([point for point, _, _ in self.settled])
        cell = np.concatenate([cell for _, cell, _ in self.settled])
        bounds = CellBounds.joined([bounds for _, _, bounds in self.settled])
        self.settled = []
        order = np.lexsort((cell, bounds.low, point))
        is_first = np.diff(point[order], prepend=-1) > 0
        left = []
        for some in (order[is_first], order[~is_first]):
            rows = some[bounds.low[some] <= self.nearest.limit(point[some])]
            if len(rows):
                left.append(rows[~self.descend(point[rows], cell[rows], bounds.take(rows))])
        rows = np.concatenate(left) if left else np.zeros(0, np.intp)
        rows = rows[np.lexsort((cell[rows], point[rows]))]
        return self.halve(point[rows], cell[rows], bounds.low[rows])

    def descend(self, point: Ints, cell: Ints, bounds: CellBounds) -> Bools:
        """Looks for the minima of settled pairs; which of them ended with a good bound."""
        ended = np.zeros(len(point), bool)
        model = self.cells.models
        rows, at = np.arange(len(point)), bounds.start
        net, place = self.cells.net[cell], self.cells.place[:, cell]
        slope = model[columns.SLOPE_A : columns.SLOPE_B + 1, cell]
        least = model[columns.LEAST_A : columns.LEAST_B + 1, cell]
        for left in range(STEPS, 0, -1):
            found = measure(self.cells, net[rows], place[:, rows], at, self.x[:, point[rows]])
            wrong = slope[:, rows] * found.distance + least[:, rows]
            wrong += 4 * UNIT * np.abs(found.gradient)
            change = 2 * least_change(found.gradient, bounds.convexity[:, rows], at)
            low = found.low * found.low + change - 4 * wrong.sum(axis=0) - bounds.loss[rows]
            self.nearest.add_places(point[rows], net[rows], found)
            good = found.high - np.sqrt(np.maximum(low, 0.0)) <= self.enough_at(found.high)
            if left > 1:  # one step more makes the place exact, to which distances are blind
                good &= change >= -EXACT * EXACT
            good |= low > self.nearest.limit(point[rows])
            if good.any():
                done = rows[good]
                ended[done] = True
                self.nearest.end_minima(point[done], net[done], found.take(good), low[good])
            rows = rows[~good]
            if not len(rows):
                break
            at = found.take(~good).next(at[:, ~good], bounds.sides[:, rows])
        return ended


def _joined(pairs: Sequence[tuple[Ints, Ints]]) -> tuple[Ints, Ints]:
    """Pairs of a point and a cell, in the order of points."""
    some = [each for each in pairs if len(each[0])]
    if len(some) < 2:
        return some[0] if some else NO_PAIRS
    point, cell = (np.concatenate(each) for each in zip(*some, strict=True))
    order = np.argsort(point, kind="stable")
    return point[order], cell[order]


def _parts(rows: Ints) -> list[Ints]:
    """Rows in parts of at most PAIRS, one at least."""
    return [rows[first : first + PAIRS] for first in range(0, max(len(rows), 1), PAIRS)]
