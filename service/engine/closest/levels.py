"""The search for closest points, each with an interval that contains the distance.

The search examines pairs of a point and a cell of a patch (`cells`), for all points and all patches
together, level by level. A pair ends in three cases: the cell is farther than a point of the
surface that is already known; the distance has no minimum over the patch in the cell; or the cell
is *settled*: the distance is nearly convex over it, or is least on a known side. Otherwise the cell
is halved. In settled cells Newton's method finds the minimum, and `distance_bounds` bounds the
least distance. If this bound is too far from the distance, the cell is halved, too. Minima of the
nearest cells are computed first; they usually show that most other cells are farther. Here `low`
has squared lower bounds of distances, but in `SurfacePoints` they are not squared.

On parts the search begins with the cells of faces. Those of edges join it one level later, when
most of them are known to be too far.

The lower end of a point's interval is the least lower bound of all pairs that were not proved to be
farther; the upper end is the distance of the reported point. The work for a point is limited. When
the limit is reached, the bounds of the remaining pairs are included in the interval.

Most points need the bounds of 20 to 70 pairs; a point near the centre of a sphere needs 25,000. So
the points of a request share a budget of pairs (`pair_search`).

Proof in docs/proofs.md: "Intervals of closest points".
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_begins, row_slices
from service.cancellation import checkpoint
from service.engine.cells.bounding_spheres import BoundingSpheres, box_bounds, sphere_bounds
from service.engine.cells.pair_search import (
    NO_PAIRS,
    PairBudget,
    Pairs,
    TreeSearch,
    join_pairs,
    split_nearest,
)
from service.engine.closest.descents import descend
from service.engine.closest.distance_bounds import Minima, bound_distances
from service.engine.closest.nearest import ClosestPoints, Nearest
from service.engine.closest.trimmed_points import TrimmedPoints
from service.engine.trims.trimmed_nets import NetTrims
from service.engine.vectors import UNIT

CHUNK_PAIRS = 1 << 13
"""How many pairs of a point and a cell are computed at once; this limits the memory."""

MIN_RELATIVE_WIDTH, MIN_WIDTH = 48 * UNIT, 2.0**-36
"""Intervals at most as wide as one of these are narrow enough at any tolerance. The first is
relative to the distance: rounding alone makes intervals 14 to 40 units of 2⁻⁵³ wide. The second is
in the coordinates of the nets: rounding keeps some cells with narrower intervals from being
settled."""

MAX_STRAIN = 0.2
"""A cell that was halved only a few times (`COARSE_HALVINGS`) and has more strain (the remainder of
its model, divided by its size) is halved without computing bounds, which would be too wide."""

WIDTH_SHARE = 1 / 2
"""A cell is no longer halved for a point if the interval of the point would then be at most this
wide, in units of the tolerance."""

TRIMMED_SHARE = 1 / 4
"""This share with trims, because minima that are outside make intervals wider again."""


class ClosestLevels(TreeSearch):
    """The search for the closest points to some points.

    Parameters
    ----------
    trees : sequence of BoundingSpheres
        Over cells of one tree of cells. Those of each tree join the search one level later than
        those of the tree before.
    points : ndarray of float64, shape (m, 3)
    budget : PairBudget
    tolerance : float
        The largest width of intervals, in the coordinates of the nets.
    can_split : bool
        Whether the caller can search fewer points at a time.
    trims : NetTrims, optional
        Those of the cells, with which only points that are inside count.
    """

    def __init__(
        self,
        trees: Sequence[BoundingSpheres],
        points: FloatArray,
        budget: PairBudget,
        tolerance: float,
        *,
        can_split: bool,
        trims: NetTrims | None = None,
    ) -> None:
        super().__init__(trees[0], budget, can_split=can_split)
        self.later_trees = list(trees)
        share = WIDTH_SHARE if trims is None else TRIMMED_SHARE
        self.min_width = max(share * tolerance, MIN_WIDTH)
        self.x = np.ascontiguousarray(points.T)  # (3, m)
        trimmed = None if trims is None else TrimmedPoints(self.cells, trims)
        self.nearest = Nearest(self.cells, self.x, tolerance, trimmed)
        # Squared upper bounds of the least distances, from the centres of spheres.
        self.sphere_best = np.full(self.count, np.inf)
        self.settled: list[Minima] = []

    def search(self) -> ClosestPoints | None:
        """Search all levels until no pair is open; None if fewer points must be searched."""
        point, cell = NO_PAIRS
        while self.later_trees or len(point):
            checkpoint()
            next_pairs = [self.step(point, cell)]
            if sum(len(minima.point) for minima in self.settled) >= len(next_pairs[0][0]):
                # Compute minima before the next level, as they exclude most open cells.
                next_pairs.append(self.find_minima())
            if self.later_trees:
                entered = self.enter_tree(self.later_trees.pop(0))
                if entered is None:
                    return None
                next_pairs.append(entered)
            point, cell = join_pairs([*next_pairs, self.waiting_pairs])
        self.charge_tree()
        return None if self.takes_too_much else self.nearest.answer()

    def enter_tree(self, spheres: BoundingSpheres) -> Pairs | None:
        """The pairs with the cells of a tree that may be near; None if there are too many."""
        self.spheres, self.ended = spheres, []
        every, root_count = np.arange(self.count), spheres.levels[0].shape[1]
        np.minimum(self.sphere_best, self.nearest.limit(every), out=self.sphere_best)
        roots = np.tile(np.arange(root_count), self.count)
        pairs = self.descend_tree(every.repeat(root_count), roots)
        if pairs is None:
            return None
        for level, point, sphere in self.ended:
            # The centre of a sphere is that of a cell, with which the bounds are recorded.
            low, upper = sphere_bounds(spheres.levels[level], sphere, self.x, point)
            middle = spheres.middles[level][sphere]
            self.nearest.add_centers(point, middle, upper)
            self.nearest.end_open_cells(point, middle, low)
        points = np.concatenate([pairs[0], *(point for _, point, _ in self.ended)])
        self.in_tree += np.bincount(points, minlength=self.count)
        return pairs

    def examine_spheres(self, level: int, item: Ints, sphere: Ints) -> Ints:
        """The rows of spheres that are not farther than the centre of another sphere."""
        low, upper = sphere_bounds(self.spheres.levels[level], sphere, self.x, item)
        starts = find_begins(item)
        points = item[starts]
        best = np.minimum(self.sphere_best[points], np.minimum.reduceat(upper, starts))
        self.sphere_best[points] = best
        rows = np.flatnonzero(low <= self.sphere_best[item])
        if self.spheres.boxes:
            low = box_bounds(self.spheres.boxes[level], sphere[rows], self.x, item[rows])
            rows = rows[low <= self.sphere_best[item[rows]]]
        return rows

    def step(self, point: Ints, cell: Ints) -> Pairs:
        """Examine one level of pairs; returns the pairs of the next level.

        Pairs that are settled on this level are stored for `find_minima`.
        """
        low = np.empty(len(point))
        for chunk in row_slices(len(point), 1, CHUNK_PAIRS):
            own = point[chunk], cell[chunk]
            low[chunk], upper = sphere_bounds(self.cells.models, own[1], self.x, own[0])
            self.nearest.add_centers(*own, upper)
        near_rows = np.flatnonzero(low <= self.nearest.limit(point, cell))
        if self.spheres.boxes:
            near_rows = self._drop_far_boxes(near_rows, point, cell, low)
        is_later = np.ones(self.count, bool) if self.later_trees else None
        near_rows, ended = self.allot_pairs(near_rows, point, cell, is_later)
        self.nearest.end_open_cells(point[ended], cell[ended], low[ended])
        # For each of `near_rows`: coarse cells stay open without bounds.
        is_open = self.cells.is_coarse(cell[near_rows], MAX_STRAIN)
        examined = np.flatnonzero(~is_open)
        for chunk in row_slices(len(examined), 1, CHUNK_PAIRS):
            chosen = examined[chunk]
            rows = near_rows[chosen]
            is_open[chosen], low[rows] = self.bound_pairs(point[rows], cell[rows], low[rows])
        rows = near_rows[is_open]
        return self.halve_open(point[rows], cell[rows], low[rows])

    def _drop_far_boxes(self, rows: Ints, point: Ints, cell: Ints, low: FloatArray) -> Ints:
        """Raise the bounds `low` of pairs `rows` by the boxes of cells; returns near pairs."""
        points, cells = point[rows], cell[rows]
        raised = np.maximum(low[rows], box_bounds(self.cells.boxes, cells, self.x, points))
        low[rows] = raised
        return rows[raised <= self.nearest.limit(points, cells)]

    def bound_pairs(self, point: Ints, cell: Ints, low: FloatArray) -> tuple[Bools, FloatArray]:
        """Compute bounds of pairs; returns which pairs stay open, and squared lower bounds."""
        # With `flattest` = `min_width` / 8, a cell at the distance d may be settled if its μ
        # (`distance_bounds`) is at least −`flattest` d. This costs 4 |μ| in squared distances,
        # which is at most about 2 `flattest` = `min_width` / 4 in distances.
        low, is_open, minima = bound_distances(
            self.cells,
            self.x,
            point,
            cell,
            low=low,
            limit=self.nearest.limit(point, cell),
            flattest=self.min_width / 8,
        )
        if len(minima.point):
            self.settled.append(minima)
        return is_open, low

    def halve_open(self, point: Ints, cell: Ints, low: FloatArray) -> Pairs:
        """Halve the cells of open pairs; returns the pairs with the halves.

        Pairs end here if their intervals are narrow enough, if their point has too many pairs, or
        if their cells can no longer be halved.
        """
        best = np.sqrt(self.nearest.best[point])
        is_ended = best - np.sqrt(np.maximum(low, 0.0)) <= self.allowed_width(best)
        is_ended &= np.isfinite(best)
        is_ended |= self.must_end(point, cell)
        self.nearest.end_open_cells(point[is_ended], cell[is_ended], low[is_ended])
        return self.halve(point[~is_ended], cell[~is_ended])

    def allowed_width(self, distance: FloatArray) -> FloatArray:
        """The widths at which intervals are narrow enough, for these distances."""
        return np.maximum(self.min_width, MIN_RELATIVE_WIDTH * distance)

    def find_minima(self) -> Pairs:
        """Apply Newton's method in settled cells, the nearest first.

        Returns the pairs of the next level, with the halves of cells whose minimum was not found.
        """
        if not self.settled:
            return NO_PAIRS
        minima = Minima.join(self.settled)
        self.settled = []
        open_rows = []
        # First the nearest cell of each point: its minimum may exclude the point's other cells.
        for chosen in split_nearest(minima.point, minima.cell, minima.estimate):
            limit = self.nearest.limit(minima.point[chosen], minima.cell[chosen])
            rows = chosen[minima.low[chosen] <= limit]
            if len(rows):
                is_ended, found, bounds = descend(
                    self.cells,
                    self.x,
                    minima.take(rows),
                    self.nearest.limit,
                    self.allowed_width,
                )
                self.nearest.add_minima(found, bounds)
                open_rows.append(rows[~is_ended])
        rows = np.concatenate(open_rows) if open_rows else np.zeros(0, np.intp)
        rows = rows[np.lexsort((minima.cell[rows], minima.point[rows]))]
        return self.halve_open(minima.point[rows], minima.cell[rows], minima.low[rows])
