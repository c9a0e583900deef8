"""A tree of cells: rectangles of the parameters of nets, which are halved when a query needs it.

Cell k is column k of several arrays: its model (`cell_models`), its rectangle of parameters, its
net and its children. The tree begins with the whole nets. A cell is halved along the direction in
which it is longer; or along both directions, if neither length is twice the other. So cells become
about square on the surface, also at poles. All cells that one step of a query needs are halved
together. The data of a cell depend only on its net and its rectangle, not on the order in which
cells are halved.

Nets may have trims. Then cells outside of these are left out, and the tree knows which cells a
border may cut.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.cells import models as model_rows
from service.engine.cells.cell_trims import INSIDE, OUTSIDE, UNDECIDED, CellTrims
from service.engine.cells.cells import NetCells
from service.engine.cells.models import cell_models
from service.engine.nets.query_nets import UNIT_CORNERS, QueryNets
from service.engine.vectors import UNIT, project

MAX_HALVINGS = 96
"""The most halvings of a cell, along both directions together. If 48 of them are along each
direction, the parameters of its sides are multiples of 2^−48, which float64 stores exactly."""

COARSE_HALVINGS = 6
"""A cell that was halved fewer times than this counts as coarse if it is not nearly flat."""

TRIANGLE_HALVINGS = 4
"""The nets of triangles have as much rounding as others have after this many halvings."""


@dataclass(frozen=True, slots=True)
class WorkLimits:
    """The most work of a search over pairs of an item (a point or a ray) and a cell or a sphere.

    Attributes
    ----------
    pairs : int
        Pairs with cells, of all items of a request.
    of_item : int
        Pairs of one item on one level of cells.
    open : int
        Pairs of all items of a chunk on one level of cells or spheres. If there are more, fewer
        items are searched again; a single one has no such limit.
    spheres, free_spheres : int
        Pairs with spheres that the tree may fail to exclude, of all items of a request, without the
        first `free_spheres` of each item. A pair takes some 2 µs. The search of an item with too
        many pairs ends in the tree.
    additions : int
        Additions of numbers for halving cells in a request; each takes 6 to 40 ns, so all take at
        most 24 s. At degree 32 halving a cell takes a millisecond. At low degrees, queries first
        reach their limits of pairs.
    bytes : int
        Bytes of all cells and their nets, without the cells that are never dropped.
    """

    pairs: int
    of_item: int
    open: int = 1 << 18
    spheres: int = 4_000_000
    free_spheres: int = 128
    additions: int = 600_000_000
    bytes: int = 96 << 20


@dataclass(frozen=True, slots=True)
class Table:
    """Which numbers the model of a cell has, and the function that computes them.

    Attributes
    ----------
    models : callable
        Computes models (row_count, K) from the nets of K cells, their numbers of halvings, and a
        bound of the distances of control points from the origin.
    row_count : int
        How many numbers a model has.
    sizes : (int, int)
        The rows of a model with the lengths of a cell along a and along b.
    """

    models: Callable[[FloatArray, Ints, float], FloatArray]
    row_count: int
    sizes: tuple[int, int]


FULL = Table(cell_models, model_rows.ROW_COUNT, (model_rows.SIZE_A, model_rows.SIZE_B))
"""The table of models of second order."""


class NetSpace:
    """The nets (p+1, q+1, D, N) of cells of one degree, in an array with spare columns."""

    def __init__(self, nets: FloatArray) -> None:
        self.nets, self.count = nets, nets.shape[-1]

    def append(self, nets: FloatArray) -> Ints:
        """Add nets; returns their columns in the array."""
        begin, end = self.count, self.count + nets.shape[-1]
        if end > self.nets.shape[-1]:
            larger = np.empty((*nets.shape[:-1], max(end, 2 * self.nets.shape[-1])))
            larger[..., :begin] = self.nets[..., :begin]
            self.nets = larger
        self.nets[..., begin:end] = nets
        self.count = end
        return np.arange(begin, end)


class CellTree:
    """The cells of some nets.

    Attributes
    ----------
    nets : QueryNets
    limits : WorkLimits
    trims : CellTrims or None
    first : ndarray of int
        The cells at which queries begin; together they cover all nets within their trims.
    count : int
        The number of cells.
    roots : int
        The number of cells that are never dropped: `first`, and the cells of which these are
        halves.
    box : tuple of ndarray of float64, shape (3,)
        Least and greatest coordinates of all control points.
    largest : float
        No control point is further than this from the origin.
    models : ndarray of float64, shape (row_count, N)
        Here and below N is at least `count`; later columns are spare.
    rectangle : ndarray of float64, shape (4, N)
        The rectangle [u₀, u₁] × [v₀, v₁] of each cell, in the parameters of its net.
    net : ndarray of int, shape (N,)
        Number of the net of each cell.
    is_cut : ndarray of bool, shape (N,)
        Whether a border may cut each cell; false without trims.
    boxes : ndarray of float64, shape (6, N)
        Least and greatest coordinates of each cell; only with trims.
    errors : ndarray of float64, shape (nets,)
        Bound of the error of a point that is computed from each net.
    point_sides : ndarray of bool, shape (4, nets)
        Whether each of the sides u = 0, u = 1, v = 0, v = 1 of a net is one point.
    """

    def __init__(
        self,
        nets: QueryNets,
        limits: WorkLimits,
        table: Table = FULL,
        trims: CellTrims | None = None,
    ) -> None:
        self.nets, self.limits, self._table, self.trims = nets, limits, table, trims
        projected = [project(group.nets, -1) for group in nets.groups]
        points = np.concatenate([rows.reshape(-1, 3) for rows in projected])
        self.box = points.min(axis=0), points.max(axis=0)
        self.largest = float(np.abs(self.box).max()) * 3**0.5
        is_triangle = (nets.corners[:, 3] != UNIT_CORNERS[3]).any(axis=1)
        self._earlier_halvings = np.where(is_triangle, TRIANGLE_HALVINGS, 0)
        # The bound that the docstring of `net_partials` states, with `largest` for M; in nets of
        # triangles the rounding of their control points is added.
        self.errors = np.repeat(
            [UNIT * self.largest * (sum(g.degree) + 2) for g in nets.groups],
            [len(g.patches) for g in nets.groups],
        ) * np.where(is_triangle, 20, 8)
        if nets.errors is not None:
            self.errors += nets.errors
        self.point_sides = np.hstack([self._find_point_sides(points) for points in projected])
        self.count = self.additions = 0
        self.models, self.rectangle = np.empty((table.row_count, 0)), np.empty((4, 0))
        self.net, self.is_cut = np.empty(0, np.intp), np.empty(0, bool)
        self.boxes = np.empty((0 if trims is None else 6, 0))
        # Whether centres are inside, `INSIDE` or `OUTSIDE`; `UNDECIDED`: not known yet.
        self._center = self.net
        # The group of the net of each cell, its column in the space of the group, and its halvings.
        self._group, self._column, self._depth = self.net, self.net, self.net
        # The children are the cells from `_first_child` on; −1 for cells that were not halved.
        self._first_child, self._child_count = self.net, self.net
        self._spaces: list[NetSpace] = []
        for number, group in enumerate(nets.groups):
            whole = group.values
            numbers = np.arange(group.first, group.first + len(group.patches))
            rectangle = np.repeat([[0.0], [1.0], [0.0], [1.0]], len(numbers), axis=1)
            self._spaces.append(NetSpace(whole[..., :0]))
            is_cut, kept = self._find_cut(numbers, rectangle, np.ones(len(numbers), bool))
            cells = NetCells(rectangle, whole)
            if not kept.all():
                cells, numbers, is_cut = cells.take(kept), numbers[kept], is_cut[kept]
            self._append(number, cells, numbers, np.zeros_like(numbers), is_cut)
        self.roots = self.count
        self.first = np.arange(self.count)
        self._root_counts = [space.count for space in self._spaces]

    @property
    def nbytes(self) -> int:
        """Approximate bytes of the cells that are not among the `roots`."""
        # The other arrays have about 10 numbers for each cell.
        per_cell = 8 * (len(self.models) + 10) + max(g.nets[0].nbytes for g in self.nets.groups)
        return int((self.count - self.roots) * per_cell)

    def drop_if_large(self) -> None:
        """Drop all cells but the `roots`, if they take more than half of the bytes."""
        if self.nbytes <= self.limits.bytes // 2:
            return
        self.count = self.roots
        for space, count in zip(self._spaces, self._root_counts, strict=True):
            space.count = count
        self._first_child[self.first] = -1

    def halve_first(self, max_first: int, row: int, limit: float) -> None:
        """Halve the first cells while the number in a row of their models is above a limit.

        The halves replace these cells among the first cells, of which there may be at most
        `max_first`.
        """
        while True:
            is_above = self.models[row, self.first] > limit
            # Each of these cells may be replaced by 4, which are 3 more.
            if not is_above.any() or len(self.first) + 3 * np.count_nonzero(is_above) > max_first:
                break
            self.replace_first(is_above)

    def replace_first(self, is_halved: Bools) -> None:
        """Replace some of the first cells by their children."""
        children, _ = self.children(self.first[is_halved])
        self.first = np.concatenate([self.first[~is_halved], children])
        self.roots, self._root_counts = self.count, [space.count for space in self._spaces]

    @property
    def is_full(self) -> bool:
        """Whether the cells take too many bytes, so that no more cells can be halved."""
        return self.nbytes > self.limits.bytes

    def is_coarse(self, cells: Ints, strain: float) -> Bools:
        """Which cells have a `STRAIN` above `strain`, and fewer than `COARSE_HALVINGS` halvings."""
        has_strain = self.models[model_rows.STRAIN].take(cells) > strain
        return np.asarray(has_strain & (self._depth.take(cells) < COARSE_HALVINGS))

    def has_center(self, cells: Ints) -> Bools:
        """Whether the centres of cells (n,) are certainly inside of the trims."""
        if self.trims is None:
            return np.ones(len(cells), bool)
        is_new = self._center.take(cells) == UNDECIDED
        if is_new.any():
            new = np.unique(cells[is_new])
            middles = (self.rectangle[::2, new] + self.rectangle[1::2, new]) / 2
            answers = self.trims.find_inside(self.net[new], middles)
            self._center[new] = np.where(answers == INSIDE, INSIDE, OUTSIDE)
        return np.asarray(self._center.take(cells) == INSIDE)

    def can_halve(self, cells: Ints) -> Bools:
        """Which cells have children or can be halved."""
        if self.is_full or self.additions > self.limits.additions:
            return np.asarray(self._first_child[cells] >= 0)
        return np.asarray(self._depth[cells] < MAX_HALVINGS)

    def children(self, cells: Ints) -> tuple[Ints, Ints]:
        """The children of cells (n,); cells without children are halved first.

        Returns the children of all cells, and for each child the position of its parent in `cells`.
        """
        missing = cells[self._first_child[cells] < 0]
        if len(missing):
            self._halve(np.unique(missing))
        counts = self._child_count[cells]
        parents = np.repeat(np.arange(len(cells)), counts)
        # For each child, its number among the children of its parent: 0, 1, …
        offset = np.arange(len(parents)) - np.repeat(np.cumsum(counts) - counts, counts)
        return self._first_child[cells][parents] + offset, parents

    def _find_point_sides(self, points: FloatArray) -> Bools:
        """Which sides of nets are one point, up to the rounding of weights: shape (4, K).

        `points` (K, p+1, q+1, 3) are the projected nets. All false for the nets of curves.
        """
        if points.shape[2] == 1:
            return np.zeros((4, len(points)), bool)
        sides = points[:, 0], points[:, -1], points[:, :, 0], points[:, :, -1]
        tolerance = 4 * UNIT * self.largest
        return np.stack([(np.abs(s - s[:, :1]) <= tolerance).all(axis=(1, 2)) for s in sides])

    def _halve(self, cells: Ints) -> None:
        """Halve cells that have no children; cells of one group are halved together."""
        a, b = (self.models[size, cells] for size in self._table.sizes)
        is_halved_along_a, is_halved_along_b = 2 * a >= b, (2 * b > a) & (b > 0)
        self._child_count[cells] = np.where(is_halved_along_a & is_halved_along_b, 4, 2)
        for group, space in enumerate(self._spaces):
            is_in_group = self._group[cells] == group
            parents, parts = [], []
            for axes in ((0,), (1,), (0, 1)):
                chosen = cells[
                    is_in_group
                    & (is_halved_along_a == (0 in axes))
                    & (is_halved_along_b == (1 in axes))
                ]
                if len(chosen):
                    nets = space.nets.take(self._column[chosen], axis=-1)
                    parents.append(chosen)
                    parts.append(NetCells(self.rectangle[:, chosen], nets).halve_along(axes))
            if parts:
                self._add_children(group, np.concatenate(parents), NetCells.join(parts))

    def _add_children(self, group: int, parents: Ints, children: NetCells) -> None:
        """Add the children of cells of one group; the children of a cell follow each other."""
        counts = self._child_count[parents]
        self._first_child[parents] = self.count + np.cumsum(counts) - counts
        parent = parents.repeat(counts)
        # 2 children are 1 halving, 4 children are 2.
        net, depth = self.net[parent], self._depth[parent] + self._child_count[parent] // 2
        self.additions += sum(self.nets.groups[group].degree) * children.nets.size
        rectangle = np.asarray(children.rectangle, np.float64)
        is_cut, kept = self._find_cut(net, rectangle, self.is_cut[parent])
        if not kept.all():
            children, net, depth, is_cut = children.take(kept), net[kept], depth[kept], is_cut[kept]
            counts = np.bincount(
                np.arange(len(parents)).repeat(counts)[kept], minlength=len(parents)
            )
            self._child_count[parents] = counts
            self._first_child[parents] = self.count + np.cumsum(counts) - counts
        self._append(group, children, net, depth, is_cut)

    def _find_cut(self, net: Ints, rectangle: FloatArray, may_be_cut: Bools) -> tuple[Bools, Bools]:
        """Which rectangles (4, m) of nets (m,) a border may cut, and which are not outside.

        Only rectangles where `may_be_cut` are classified; others are inside.
        """
        is_cut, kept = np.zeros(len(net), bool), np.ones(len(net), bool)
        if self.trims is not None and may_be_cut.any():
            rows = may_be_cut.nonzero()[0]
            answers = self.trims.classify(net[rows], rectangle[:, rows])
            is_cut[rows], kept[rows] = answers == UNDECIDED, answers != OUTSIDE
        return is_cut, kept

    def _append(self, group: int, cells: NetCells, net: Ints, depth: Ints, is_cut: Bools) -> None:
        """Add cells of a group, and compute their models."""
        begin, end = self.count, self.count + len(cells)
        if end > len(self.net):
            self._grow(max(end, 2 * len(self.net)))
        run = slice(begin, end)
        halvings = depth + self._earlier_halvings[net]
        self.models[:, run] = self._table.models(cells.nets, halvings, self.largest)
        if self.nets.errors is not None:
            self.models[model_rows.RADIUS : model_rows.ERROR + 1, run] += self.nets.errors[net]
        if self.trims is not None:
            points = project(cells.nets)
            reach = self.models[model_rows.ERROR, run]
            self.boxes[:3, run] = points.min(axis=(0, 1)) - reach
            self.boxes[3:, run] = points.max(axis=(0, 1)) + reach
        self.is_cut[run], self._center[run] = is_cut, np.where(is_cut, UNDECIDED, INSIDE)
        self.rectangle[:, run], self.net[run] = cells.rectangle, net
        self._group[run], self._depth[run], self._first_child[run] = group, depth, -1
        self._column[run] = self._spaces[group].append(cells.nets)
        self.count = end

    def _grow(self, size: int) -> None:
        """Enlarge all arrays of cells to `size` columns."""
        for name in (
            "models",
            "rectangle",
            "boxes",
            "net",
            "is_cut",
            "_center",
            "_group",
            "_column",
            "_depth",
            "_first_child",
            "_child_count",
        ):
            old = getattr(self, name)
            new = np.empty((*old.shape[:-1], size), old.dtype)
            new[..., : self.count] = old[..., : self.count]
            setattr(self, name, new)
