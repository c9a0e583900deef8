"""Cells of nets, halved where a query needs it: a tree that all queries share while it lasts.

Cell k has columns in several arrays: its model (`cell_models`), its rectangle of parameters, its
net and its children. The first cells are the whole nets. A cell is halved along the direction in
which it is longer, or along both if neither is twice as long as the other, so that cells become
about square on the surface, also at poles. All cells that a step of a query needs are halved
together. What is known of a cell depends on its net and its rectangle alone: answers do not depend
on earlier requests.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.queries import cell_models as columns
from service.engine.queries.nets import QueryNets

DEEPEST = 96
"""Halvings of a cell; parameters are exact: a cell is at least 2^−48 wide and high."""

MOST_BYTES = 96 << 20
"""Of the cells at a time, nets included, beyond the whole nets."""

MOST_ADDITIONS = 600_000_000
"""Additions of numbers that halve the cells of a request, some 6 to 40 ns each. With low degrees
the pairs of a request take longer; a cell of degree 32 takes a millisecond."""


@dataclass(frozen=True, slots=True)
class Table:
    """The columns of every cell: a function of nets, halvings and the largest coordinate."""

    models: Callable[[FloatArray, Ints, float], FloatArray]
    columns: int
    sizes: tuple[int, int]
    """Columns of the lengths along a and b."""


FULL = Table(columns.cell_models, columns.COLUMNS, (columns.SIZE_A, columns.SIZE_B))


class CellTree:
    """The cells of some nets.

    Attributes
    ----------
    nets : QueryNets
    first : ndarray of int
        The cells at which queries begin; together they are all of the nets.
    models : ndarray of float64, shape (COLUMNS, cells or more)
    place : ndarray of float64, shape (4, cells or more)
        u₀, u₁, v₀, v₁ in the parameters of the net.
    net : ndarray of int, shape (cells or more,)
        Number of the net.
    errors : ndarray of float64, shape (nets,)
        How wrong points of each net are that are computed at a place.
    point_sides : ndarray of bool, shape (4, cells or more)
        Whether the sides u₀, u₁, v₀, v₁ of a cell are one point: a side of a net that is one.
    """

    def __init__(self, nets: QueryNets, table: Table = FULL) -> None:
        self.nets, self._table = nets, table
        self.largest = max(
            float(np.abs(_points(g.nets)).max(initial=0.0)) * 3**0.5 for g in nets.groups
        )
        self.errors = np.repeat(
            [8 * columns.UNIT * self.largest * (sum(g.degree) + 2) for g in nets.groups],
            [len(g.nets) for g in nets.groups],
        )
        self._spaces = [_NetSpace(g.nets[:0]) for g in nets.groups]
        self.count = self.additions = 0
        total = len(nets.patch)
        self.models = np.empty((table.columns, total))
        self.place = np.empty((4, total))
        self.net = np.empty(total, np.intp)
        self.point_sides = np.zeros((4, total), bool)
        self._group = np.empty(total, np.intp)
        self._row = np.empty(total, np.intp)
        self._depth = np.empty(total, np.intp)
        self._child = np.empty(total, np.intp)
        self._children = np.empty(total, np.intp)
        for number, group in enumerate(nets.groups):
            k = len(group.nets)
            run = self._append(number, group.nets, np.zeros(k, np.intp))
            self.place[:, run] = np.array([[0.0], [1.0], [0.0], [1.0]])
            self.net[run] = np.arange(group.first, group.first + k)
            self.point_sides[:, run] = self._point_sides(group.nets)
        self.roots = self.count
        self.first = np.arange(self.count)
        self._kept = [len(g.nets) for g in nets.groups]

    @property
    def nbytes(self) -> int:
        """Bytes of the cells beyond the whole nets, about."""
        per_cell = 8 * (len(self.models) + 10) + max(g.nets[0].nbytes for g in self.nets.groups)
        return int((self.count - self.roots) * per_cell)

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest coordinates (3,) of all control points."""
        points = [_points(group.nets).reshape(-1, 3) for group in self.nets.groups]
        return (
            np.min([each.min(axis=0) for each in points], axis=0),
            np.max([each.max(axis=0) for each in points], axis=0),
        )

    def forget_much(self) -> None:
        """Drops all cells but the whole nets, if they take much memory."""
        if self.nbytes <= MOST_BYTES // 2:
            return
        self.count = self.roots
        for space, kept in zip(self._spaces, self._kept, strict=True):
            space.count = kept
        self._child[self.first] = -1

    def halve_first(self, most: int, column: int, limit: float) -> None:
        """Halves the first cells while a column is beyond a limit and they are at most `most`."""
        while True:
            coarse = self.models[column, self.first] > limit
            if not coarse.any() or len(self.first) + 3 * np.count_nonzero(coarse) > most:
                break
            children, _ = self.children(self.first[coarse])
            self.first = np.concatenate([self.first[~coarse], children])
        self.roots, self._kept = self.count, [space.count for space in self._spaces]

    @property
    def is_full(self) -> bool:
        """Whether no cells can be made any more."""
        return self.nbytes > MOST_BYTES

    def can_halve(self, cells: Ints) -> Bools:
        """Which cells have children or may get some."""
        if self.is_full or self.additions > MOST_ADDITIONS:
            return np.asarray(self._child[cells] >= 0)
        return np.asarray(self._depth[cells] < DEEPEST)

    def children(self, cells: Ints) -> tuple[Ints, Ints]:
        """The children of cells (n,), and the number in `cells` of the parent of each."""
        missing = cells[self._child[cells] < 0]
        if len(missing):
            self._halve(np.unique(missing))
        counts = self._children[cells]
        parents = np.repeat(np.arange(len(cells)), counts)
        ends = np.cumsum(counts)
        offset = np.arange(len(parents)) - np.repeat(ends - counts, counts)
        return self._child[cells][parents] + offset, parents

    def _point_sides(self, nets: FloatArray) -> Bools:
        """Which sides are one point up to the rounding of weights, (4, K); no side of a curve."""
        if nets.shape[2] == 1:
            return np.zeros((4, len(nets)), bool)
        points = _points(nets)
        sides = points[:, 0], points[:, -1], points[:, :, 0], points[:, :, -1]
        near = 4 * columns.UNIT * self.largest
        return np.stack([(np.abs(s - s[:, :1]) <= near).all(axis=(1, 2)) for s in sides])

    def _halve(self, cells: Ints) -> None:
        """Makes the children of cells that have none."""
        a, b = (self.models[size, cells] for size in self._table.sizes)
        along_a, along_b = 2 * a >= b, (2 * b > a) & (b > 0)
        self._children[cells] = np.where(along_a & along_b, 4, 2)
        for on_a, on_b in ((True, False), (False, True), (True, True)):
            kind = cells[(along_a == on_a) & (along_b == on_b)]
            for group in range(len(self._spaces)):
                some = kind[self._group[kind] == group]
                if len(some):
                    self._halve_alike(some, group, on_a, on_b)

    def _halve_alike(self, cells: Ints, group: int, on_a: bool, on_b: bool) -> None:
        nets = [self._spaces[group].nets[self._row[cells]]]
        places = [self.place[:, cells]]
        points = [self.point_sides[:, cells]]
        for axis, is_on in ((0, on_a), (1, on_b)):
            if is_on:
                nets = [half for each in nets for half in halved(each, axis + 1)]
                places = [half for each in places for half in _halved_place(each, axis)]
                points = [half for each in points for half in _halved_sides(each, axis)]
        times = len(nets)
        # The children of one cell stand side by side.
        order = np.arange(times * len(cells)).reshape(times, -1).T.ravel()
        depth = np.repeat(self._depth[cells] + (on_a + on_b), times)
        run = self._append(group, np.concatenate(nets)[order], depth)
        self.place[:, run] = np.concatenate(places, axis=1)[:, order]
        self.net[run] = np.repeat(self.net[cells], times)
        self.point_sides[:, run] = np.concatenate(points, axis=1)[:, order]
        self._child[cells] = run.start + times * np.arange(len(cells))
        self.additions += sum(self.nets.groups[group].degree) * self.net[run].size * nets[0][0].size

    def _append(self, group: int, nets: FloatArray, depth: Ints) -> slice:
        """Room for cells of these nets; the columns that do not depend on these alone are open."""
        first, last = self.count, self.count + len(nets)
        if last > len(self.net):
            self._grow(max(last, 2 * len(self.net)))
        run = slice(first, last)
        self.models[:, run] = self._table.models(nets, depth, self.largest)
        self._group[run], self._depth[run], self._child[run] = group, depth, -1
        self._row[run] = self._spaces[group].append(nets)
        self.count = last
        return run

    def _grow(self, size: int) -> None:
        for name in (
            "models",
            "place",
            "net",
            "point_sides",
            "_group",
            "_row",
            "_depth",
            "_child",
            "_children",
        ):
            old = getattr(self, name)
            new = np.empty((*old.shape[:-1], size), old.dtype)
            new[..., : self.count] = old[..., : self.count]
            setattr(self, name, new)


class _NetSpace:
    """The nets of cells of one degree, with room for more."""

    def __init__(self, nets: FloatArray) -> None:
        self.nets, self.count = nets, len(nets)

    def append(self, nets: FloatArray) -> Ints:
        """Adds nets; their rows."""
        last = self.count + len(nets)
        if last > len(self.nets):
            grown = np.empty((max(last, 2 * len(self.nets)), *nets.shape[1:]))
            grown[: self.count] = self.nets[: self.count]
            self.nets = grown
        self.nets[self.count : last] = nets
        rows = np.arange(self.count, last)
        self.count = last
        return rows


def halved(nets: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Nets (K, p+1, q+1, D) over the lower and the upper half of one direction, axis 1 or 2.

    Averages of two neighbours at a time: other than a product of matrices, that gives the same bits
    for a net wherever it stands in a batch.
    """
    rows = np.moveaxis(nets, axis, 0)
    n = len(rows) - 1
    low, high = np.empty_like(nets), np.empty_like(nets)
    lows, highs = np.moveaxis(low, axis, 0), np.moveaxis(high, axis, 0)
    lows[0], highs[n] = rows[0], rows[n]
    for k in range(1, n + 1):
        rows = rows[:-1] + rows[1:]
        rows *= 0.5
        lows[k], highs[n - k] = rows[0], rows[-1]
    return low, high


def _halved_place(place: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    low, high = place.copy(), place.copy()
    low[2 * axis + 1] = high[2 * axis] = (place[2 * axis] + place[2 * axis + 1]) / 2
    return low, high


def _halved_sides(sides: Bools, axis: int) -> tuple[Bools, Bools]:
    low, high = sides.copy(), sides.copy()
    low[2 * axis + 1] = high[2 * axis] = False
    return low, high


def _points(nets: FloatArray) -> FloatArray:
    return nets if nets.shape[3] == 3 else nets[..., :3] / nets[..., 3:]
