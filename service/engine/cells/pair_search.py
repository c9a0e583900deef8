"""Searches over pairs of an item of a query (a point or a ray) and a cell, level by level.

The items of a request are searched in chunks. If the pairs or the cells of a chunk take too much
memory, it is searched again, a quarter of it at a time.

Some items need a thousand times more work than others: for example, all points of a sphere are
equally near to its centre. So the request has a budget of pairs, which chunks, and the items of a
chunk, share. An item that needs more pairs than its share waits until the other items have ended;
the pairs that they did not use are then shared again. When all remaining items need more than their
share, those that have used the fewest pairs continue while pairs are left, and the others end
without the requested precision. The budget counts pairs, not seconds, so that the same request
always gets the same response.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.tree import CellTree

Pairs: TypeAlias = tuple[Ints, Ints]
"""The items and the cells, or spheres, of N pairs: shape (N,) each, in the order of items."""

NO_PAIRS: Pairs = np.zeros(0, np.intp), np.zeros(0, np.intp)


class PairBudget:
    """The pairs of the m items of a chunk.

    Parameters
    ----------
    pairs : int
        How many pairs of an item and a cell may be computed in all.
    count : int
        The number of items, m.
    max_spheres : int
        How many pairs of one item may remain on one level of the tree of spheres.

    Attributes
    ----------
    spent : ndarray of int, shape (m,)
        How many pairs with cells each item has used.
    spent_spheres : int
        How many pairs the tree could not exclude, without those that are free.
    """

    def __init__(self, pairs: int, count: int, max_spheres: int) -> None:
        self.pairs, self.max_spheres = pairs, max_spheres
        self.spent, self.spent_spheres = np.zeros(count, np.intp), 0

    def allot(self, counts: Ints, is_later: Bools | None) -> tuple[Bools, Bools]:
        """Decide which items continue, and which end; all other items wait.

        Parameters
        ----------
        counts : ndarray of int, shape (m,)
            How many pairs each item needs next.
        is_later : ndarray of bool, shape (m,), or None
            Items that will need more pairs later. Without it, an item with `counts` 0 has ended.

        Returns
        -------
        is_served, is_ended : ndarray of bool, shape (m,)
            Items that continue, and items that end because no pairs are left.
        """
        is_next = counts > 0
        is_open = is_next if is_later is None else is_next | is_later
        total = self.spent + counts
        # Open items have equal shares of the pairs that items which ended have not used.
        available_pairs = self.pairs - int(self.spent[~is_open].sum())
        is_served = is_next & (total * np.count_nonzero(is_open) <= available_pairs)
        is_ended = np.zeros(len(counts), bool)
        # If every share is too small, and no later pairs are to come, serve the items with the
        # smallest totals while pairs are left. Items that are not open sort first, with no counts.
        if is_next.any() and not is_served.any() and not (is_open & ~is_next).any():
            order = np.argsort(np.where(is_open, total, 0), kind="stable")
            remaining_pairs = self.pairs - int(self.spent.sum())
            is_served[order] = np.cumsum(counts[order]) <= remaining_pairs
            is_served &= is_open
            is_ended = is_open & ~is_served
        self.spent[is_served] += counts[is_served]
        return is_served, is_ended


class Chunks:
    """Chunks of the items of a request, each with its budget.

    Parameters
    ----------
    cells : CellTree
        Drops cells after a chunk, if they take much memory.
    count : int
        The number of items.
    sizes : (int, int, int)
        The number of items of the smallest chunk that may be split, of the first, and of the
        largest.

    Attributes
    ----------
    pairs : int
        How many pairs the next chunks may use.
    """

    def __init__(self, cells: CellTree, count: int, sizes: tuple[int, int, int]) -> None:
        self._cells, self._count, self._limits = cells, count, cells.limits
        self._least, self._size, self._most = sizes
        self.pairs, self._spheres = self._limits.pairs, self._limits.spheres
        self._rows = slice(0, 0)

    def __iter__(self) -> Iterator[tuple[slice, PairBudget]]:
        """Slices of the items, with the budgets for their pairs."""
        while self._rows.stop < self._count:
            checkpoint()
            first = self._rows.stop
            remaining, size = self._count - first, min(self._size, self._count - first)
            # In the tree an item may have twice the mean of what remains: most items need less.
            max_spheres = max(self._limits.free_spheres, 2 * self._spheres // remaining)
            budget = PairBudget(self.pairs * size // remaining, size, max_spheres)
            self._rows = slice(first, first + size)
            yield self._rows, budget
            self.pairs -= int(budget.spent.sum())
            if self._rows.stop > first:
                self._spheres -= budget.spent_spheres
            self._cells.drop_if_large()

    @property
    def can_split(self) -> bool:
        """Whether this chunk should be split if its pairs or cells take too much memory."""
        return self._size > self._least

    def split(self) -> None:
        """Search the items of this chunk again, a quarter of them at a time."""
        first, end = self._rows.start, self._rows.stop
        self._size, self._rows = max(1, (end - first) // 4), slice(first, first)

    def grow(self, most_open: int) -> None:
        """Search twice as many items at a time, unless their pairs would take too much memory."""
        if 2 * most_open <= self._limits.open:
            self._size = min(2 * self._size, self._most)


class PairSearch:
    """The search of the m items of a chunk.

    Attributes
    ----------
    most_open : int
        The most pairs that were open on one level.
    is_crowded : bool
        Whether the search stopped because too many pairs were open; its result is then useless.
    """

    def __init__(self, cells: CellTree, count: int, *, can_split: bool) -> None:
        self.cells, self.count, self.limits = cells, count, cells.limits
        self.can_split = can_split
        self.most_open, self.is_crowded = 0, False

    @property
    def takes_too_much(self) -> bool:
        """Whether the chunk should be split, because its pairs or cells take too much memory."""
        return self.can_split and (self.is_crowded or self.cells.is_full)

    def must_end(self, item: Ints, cell: Ints) -> Bools:
        """Which pairs cannot continue: their item has too many, or the cell cannot be halved."""
        has_too_many = np.bincount(item, minlength=self.count)[item] > self.limits.of_item
        return np.asarray(has_too_many | ~self.cells.can_halve(cell))

    def halve(self, item: Ints, cell: Ints) -> Pairs:
        """The pairs with the halves of cells; none if too many pairs are open."""
        self.most_open = max(self.most_open, len(item))
        if len(item) > self.limits.open and self.can_split:
            self.is_crowded = True
            return NO_PAIRS
        if not len(item):
            return NO_PAIRS
        children, parents = self.cells.children(cell)
        return item[parents], children


class TreeSearch(PairSearch, ABC):
    """A search that begins in the tree of bounding spheres, and has a budget of pairs.

    Attributes
    ----------
    ended : list of (level, items, spheres)
        The pairs of items that had too many pairs on a level of spheres; `descend_tree` drops them.
    in_tree : ndarray of int, shape (m,)
        How many pairs of each item the tree could not exclude.
    waiting_pairs : Pairs
        The pairs of items whose share is too small for this level; they are examined again.
    """

    def __init__(self, spheres: BoundingSpheres, budget: PairBudget, *, can_split: bool) -> None:
        super().__init__(spheres.cells, len(budget.spent), can_split=can_split)
        self.spheres, self.budget, self.waiting_pairs = spheres, budget, NO_PAIRS
        self.ended: list[tuple[int, Ints, Ints]] = []
        self.in_tree = np.zeros(self.count, np.intp)

    @abstractmethod
    def examine_spheres(self, level: int, item: Ints, sphere: Ints) -> Ints:
        """The rows of the pairs of an item and a sphere of a level that the search must follow."""

    def descend_tree(self, item: Ints, sphere: Ints) -> Pairs | None:
        """The pairs of items and cells, which follow from pairs with spheres of the first level.

        The cells themselves are not examined. None if there is more than one item, and all items
        together have more than `WorkLimits.open` pairs on a level.
        """
        for level in range(len(self.spheres.levels) - 1):
            checkpoint()
            rows = self.examine_spheres(level, item, sphere)
            item, sphere = item[rows], sphere[rows]
            self.most_open = max(self.most_open, len(item))
            if self.most_open > self.limits.open and self.count > 1:
                return None
            counts = np.bincount(item, minlength=self.count)
            has_too_many = counts[item] > self.budget.max_spheres
            if has_too_many.any():
                self.ended.append((level, item[has_too_many], sphere[has_too_many]))
                item, sphere = item[~has_too_many], sphere[~has_too_many]
            item, sphere = self.spheres.members(level, item, sphere)
        return item, self.spheres.order[sphere]

    def charge_tree(self) -> None:
        """Charge the pairs that the tree could not exclude."""
        charged = np.maximum(self.in_tree - self.limits.free_spheres, 0)
        self.budget.spent_spheres += int(charged.sum())

    def allot_pairs(
        self, rows: Ints, item: Ints, cell: Ints, is_later: Bools | None = None
    ) -> tuple[Ints, Ints]:
        """Allot the pairs `rows` to their items: the rows that continue, and the rows that end.

        The pairs of other items wait for a later level. `is_later` is that of `PairBudget.allot`.
        """
        items = item[rows]
        is_served, is_ended = self.budget.allot(np.bincount(items, minlength=self.count), is_later)
        continues = is_served[items]
        if continues.all():
            self.waiting_pairs = NO_PAIRS
            return rows, rows[:0]
        ends = is_ended[items]
        waiting = rows[~(continues | ends)]
        self.waiting_pairs = item[waiting], cell[waiting]
        return rows[continues], rows[ends]


def join_pairs(pairs: Sequence[Pairs]) -> Pairs:
    """Join lists of pairs to one list, in the order of items."""
    filled = [pair for pair in pairs if len(pair[0])]
    if len(filled) < 2:
        return filled[0] if filled else NO_PAIRS
    item, cell = (np.concatenate(column) for column in zip(*filled, strict=True))
    order = np.argsort(item, kind="stable")
    return item[order], cell[order]


def split_nearest(item: Ints, cell: Ints, low: FloatArray) -> tuple[Ints, Ints]:
    """The rows of the nearest pair of each item, in the order of items, and of all other pairs.

    `low` are distances; of equally near cells the one with the least number is the nearest.
    """
    order = np.lexsort((cell, low, item))
    is_first = np.diff(item[order], prepend=-1) > 0
    return order[is_first], order[~is_first]
