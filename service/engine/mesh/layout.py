"""Where the samples of a model lie: one run of rows, patch after patch.

A patch is a grid of samples in its own resolution; a triangle is rows of samples in the larger of
the two numbers of divisions. Where a neighbour divides a shared edge more finely, the patch is
*framed*: its border follows the edges, and the samples that its grid lacks lie in runs of their own
at the end.
"""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.cache import MESH_PLANS
from service.bases.distinct import distinct_rows
from service.engine.mesh.connectivity import Connectivity
from service.engine.mesh.creases import Averages
from service.engine.mesh.patterns import AnyShape, Shape, TriangleShape
from service.surface.batches import Patches
from service.surface.sides import BEGINS, ENDS, along_sides

_NONE: Ints = np.empty(0, dtype=np.intp)


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """Patches of one batch that are sampled alike; their samples lie in one run.

    `batch` is the number of the batch, `first` its first patch in the model; `patches` are numbers
    within the batch, `base` is the first sample.
    """

    batch: int
    first: int
    patches: Ints
    resolution: tuple[int, int]
    base: int
    triangular: bool
    whole: bool

    @property
    def count(self) -> int:
        """Samples of one patch."""
        if self.triangular:
            return triangle.size(self.resolution[0])
        return (self.resolution[0] + 1) * (self.resolution[1] + 1)

    def of(self, batches: Sequence[Patches]) -> Patches:
        """The patches themselves."""
        batch = batches[self.batch]
        return batch if self.whole else batch.take(self.patches)


@dataclass(frozen=True, eq=False, slots=True)
class BorderWrites:
    """Which samples of edges, and which corners, are written over the borders of patches.

    Attributes
    ----------
    groups : tuple of (int, ndarray of bool, shape (E,))
        A number of divisions R, and which edges have it. In a table of points, the (R + 1) E_R
        samples of these come one group after another, those of equal parameter together; the
        corners (C,) come last.
    targets, sources : ndarrays of int, shape (n,)
        Samples of the model, and the row of the table for each of them.
    """

    groups: tuple[tuple[int, Bools], ...]
    targets: Ints
    sources: Ints


@dataclass(frozen=True, eq=False)
class Layout:
    """Where every sample lies; it depends on the connectivity and the resolution alone.

    Attributes
    ----------
    connectivity : Connectivity
        How the patches hang together.
    resolution : tuple of int
        Divisions asked for along u and v.
    blocks : tuple of Block
        Grids, first those of ordinary patches, then those of framed ones.
    divisions : ndarray of int, shape (E,)
        Of every distinct edge.
    base, ru, rv : ndarrays of int, shape (P,)
        First sample and grid of every patch.
    extra, inner : ndarrays of int, shape (P, 4)
        First inner sample of each side that has other divisions than its grid, else -1; and how
        many inner samples it has.
    size : int
        Samples in all.
    """

    connectivity: Connectivity
    resolution: tuple[int, int]
    blocks: tuple[Block, ...]
    divisions: Ints
    base: Ints
    ru: Ints
    rv: Ints
    extra: Ints
    inner: Ints
    size: int

    @staticmethod
    def plan(connectivity: Connectivity, resolution: tuple[int, int]) -> "Layout":
        """The layout at this many divisions of a patch along u and v; kept for the next mesh."""
        found = MESH_PLANS.get(
            ("layout", connectivity.key, resolution), lambda: Layout.of(connectivity, resolution)
        )
        assert isinstance(found, Layout)
        return found

    @property
    def key(self) -> Hashable:
        """Equal for layouts that are equal."""
        return self.connectivity.key, self.resolution

    @staticmethod
    def of(connectivity: Connectivity, resolution: tuple[int, int]) -> "Layout":
        """Divisions of the edges, and the run of samples of every patch and framed side."""
        ru, rv = resolution
        edge, collapsed = connectivity.edge, connectivity.collapsed
        triangular, total = connectivity.triangular, len(connectivity.edge)
        rus, rvs = np.full(total, ru), np.full(total, rv)
        rus[triangular] = rvs[triangular] = max(ru, rv)
        own = np.stack(along_sides(rus, rvs), axis=1)
        # A shared edge takes the larger of its two numbers of divisions: no triangle finds more
        # on any side than it has.
        divisions = np.zeros(len(connectivity.users), dtype=np.intp)
        np.maximum.at(divisions, edge, own)
        uneven = (divisions[edge] != own) & ~collapsed
        framed = uneven.any(axis=1)
        base, extra = np.zeros(total, dtype=np.intp), np.full((total, 4), -1, dtype=np.intp)
        # Strips need a line of samples inside to join to.
        rus[framed], rvs[framed] = max(ru, 2), max(rv, 2)
        blocks: list[Block] = []
        size = 0
        for wanted in (False, True):
            first = 0
            for number, count in enumerate(connectivity.counts):
                here = np.flatnonzero(framed[first : first + count] == wanted)
                if len(here):
                    grid = int(rus[first + here[0]]), int(rvs[first + here[0]])
                    is_triangle, whole = bool(triangular[first]), len(here) == count
                    block = Block(number, first, here, grid, size, is_triangle, whole)
                    base[first + here] = size + np.arange(len(here)) * block.count
                    size += len(here) * block.count
                    blocks.append(block)
                first += count
        grids = np.stack(along_sides(rus, rvs), axis=1)
        apart = framed[:, None] & (divisions[edge] != grids) & ~collapsed
        inner = np.where(apart, divisions[edge] - 1, 0)
        before = (np.cumsum(inner) - inner.ravel()).reshape(inner.shape)
        extra[apart] = size + before[apart]
        size += int(inner.sum())
        return Layout(
            connectivity,
            resolution,
            tuple(blocks),
            divisions,
            base,
            rus,
            rvs,
            extra,
            inner,
            size,
        )

    @property
    def nbytes(self) -> int:
        """Bytes held at most, with what is derived from the layout."""
        border = int(self.divisions[self.connectivity.edge].sum()) + 4 * len(self.base)
        return 8 * (3 * self.size + 6 * border + 30 * len(self.base)) + self.connectivity.nbytes

    @property
    def triangular(self) -> Bools:
        """Which patches are triangles, shape (P,); `ru` and `rv` are then equal."""
        return self.connectivity.triangular

    @cached_property
    def framed(self) -> bool:
        """Whether any side has samples of its own beside its grid."""
        return bool((self.extra >= 0).any())

    @cached_property
    def folds(self) -> bool:
        """Whether faces may have one place twice that no pattern knows of."""
        return bool(self.divisions.min() < 2) or self.connectivity.is_folded

    @cached_property
    def pinched(self) -> Bools:
        """Which sides are one point and yet several samples, shape (P, 4)."""
        several = self.connectivity.collapsed.copy()
        several[self.triangular, 3] = False
        return several

    @cached_property
    def has_poles(self) -> bool:
        """Whether any side is one point and yet several samples."""
        return bool(self.pinched.any())

    @cached_property
    def shares(self) -> bool:
        """Whether samples of one patch or of several have places in common."""
        # A triangle has three corners.
        corners = self.connectivity.corner.size - int(np.count_nonzero(self.triangular))
        return self.connectivity.is_joined or self.connectivity.corners < corners or self.has_poles

    @cached_property
    def places(self) -> Ints:
        """For each sample the first one that is the same by construction: edge, corner or pole."""
        place = np.arange(self.size)
        edge = self.connectivity.edge.ravel()
        for divisions, sides in self.side_groups():
            samples = self.side_samples(sides, divisions)
            # The first side of every edge stands for all of them.
            _, first, back = np.unique(edge[sides], return_index=True, return_inverse=True)
            place[samples] = samples[first][back]
        corners = self.corner_samples()
        corner = self.connectivity.corner
        _, first, back = np.unique(corner, return_index=True, return_inverse=True)
        stand_in = corners.ravel()[first]
        place[corners] = stand_in[back.reshape(corners.shape)]
        samples, at = self.collapsed_samples()
        place[samples] = stand_in[at]
        return place

    @cached_property
    def averages(self) -> Averages:
        """Samples whose normals are averaged where the model is smooth: all at one place."""
        return Averages.of(self.places)

    @cached_property
    def border_writes(self) -> BorderWrites:
        """What is written over the borders of the patches."""
        edge = self.connectivity.edge.ravel()
        groups, targets, sources = [], [], []
        first = 0
        for divisions, sides in self.side_groups():
            chosen = np.zeros(len(self.divisions), dtype=bool)
            chosen[edge[sides]] = True
            groups.append((divisions, chosen))
            count = int(np.count_nonzero(chosen))
            row = np.cumsum(chosen)[edge[sides]] - 1 + first
            # The ends of a side are corners.
            inside = np.arange(1, divisions)
            sources.append((row[:, None] + count * inside).ravel())
            targets.append(self.side_samples(sides, divisions)[:, 1:-1].ravel())
            first += count * (divisions + 1)
        poles, at = self.collapsed_samples()
        targets += [self.corner_samples().ravel(), poles]
        sources += [first + self.connectivity.corner.ravel(), first + at]
        return BorderWrites(tuple(groups), np.concatenate(targets), np.concatenate(sources))

    def grid_samples(self, sides: Ints, divisions: int) -> Ints:
        """Samples of the grids along sides (patch · 4 + side) that have R divisions: (n, R+1)."""
        patch, side = np.divmod(sides, 4)
        ru, columns = self.ru[patch], self.rv[patch] + 1
        begin = np.choose(side, [0, ru * columns, 0, columns - 1]) + self.base[patch]
        step = np.where(side < 2, 1, columns)
        samples = begin[:, None] + step[:, None] * np.arange(divisions + 1)
        rows = self.triangular[patch]
        if rows.any():
            lines = triangle.side_rows(divisions)[side[rows]]
            samples[rows] = self.base[patch[rows], None] + lines
        return samples.astype(np.intp, copy=False)

    def side_samples(self, sides: Ints, divisions: int) -> Ints:
        """Samples along sides (patch · 4 + side) in the direction of their edges: (n, R+1)."""
        samples = self.grid_samples(sides, divisions)
        extra = self.extra.ravel()[sides]
        apart = extra >= 0
        if apart.any():
            # From corner to corner over the side's own samples.
            ends = ENDS[sides[apart] % 4]
            samples[apart, 1:] = extra[apart, None] + np.arange(divisions)
            samples[apart, -1] = self.corner_samples()[sides[apart] // 4, ends]
        backward = self.connectivity.backward.ravel()[sides]
        samples[backward] = samples[backward, ::-1]
        return samples

    def patch_samples(self, patches: Ints, shape: AnyShape) -> Ints:
        """Samples of patches of one shape in the local numbering of its pattern: (n, …)."""
        if isinstance(shape, TriangleShape):
            return self.base[patches, None] + np.arange(triangle.size(shape.divisions))
        count = (shape.resolution[0] + 1) * (shape.resolution[1] + 1)
        runs = [self.base[patches, None] + np.arange(count)]
        runs += [
            self.extra[patches, side, None] + np.arange(divisions - 1)
            for side, (divisions, own) in enumerate(zip(shape.sides, shape.own, strict=True))
            if divisions != own
        ]
        return np.concatenate(runs, axis=1)

    def extras_of(self, block: Block) -> Iterator[tuple[int, Ints, FloatArray, Ints]]:
        """Samples beside the grids of a block, side by side (0 … 3).

        Yields
        ------
        side : int
        patches : ndarray of int, shape (n,)
            Of each sample, numbered within the batch.
        along : ndarray of float64, shape (n,)
            Its parameter along the side.
        samples : ndarray of int, shape (n,)
        """
        numbers = block.first + block.patches
        for side in range(4):
            apart = np.flatnonzero(self.extra[numbers, side] >= 0)
            if not len(apart):
                continue
            inner = self.inner[numbers[apart], side]
            row = np.repeat(np.arange(len(apart)), inner)
            k = np.arange(len(row)) - np.repeat(np.cumsum(inner) - inner, inner)
            samples = self.extra[numbers[apart], side][row] + k
            yield side, block.patches[apart[row]], (k + 1) / (inner[row] + 1), samples

    @cached_property
    def shapes(self) -> tuple[tuple[AnyShape, Ints], ...]:
        """Patches that one index pattern serves, in the order of their first."""
        own = np.stack(along_sides(self.ru, self.rv), axis=1)
        sides = np.where(self.extra >= 0, self.inner + 1, own)
        rows = np.concatenate(
            [
                self.triangular[:, None],
                self.ru[:, None],
                self.rv[:, None],
                sides,
                self.connectivity.collapsed,
            ],
            axis=1,
        )
        first, number = distinct_rows(rows.astype(np.float64))
        found: list[tuple[AnyShape, Ints]] = []
        for k in np.argsort(first, kind="stable").tolist():
            triangular, ru, rv, a, b, c, d, *bits = rows[first[k]].tolist()
            collapsed = bool(bits[0]), bool(bits[1]), bool(bits[2]), bool(bits[3])
            shape: AnyShape = TriangleShape(ru, collapsed)
            if not triangular:
                shape = Shape((ru, rv), (a, b, c, d), collapsed)
            found.append((shape, np.flatnonzero(number == k)))
        return tuple(found)

    def side_groups(self) -> Iterator[tuple[int, Ints]]:
        """Sides that are lines (patch · 4 + side), by the divisions of their edges."""
        divisions = self.divisions[self.connectivity.edge.ravel()]
        lines = ~self.connectivity.collapsed.ravel()
        for number in np.unique(divisions[lines]).tolist():
            yield number, np.flatnonzero(lines & (divisions == number))

    def collapsed_samples(self) -> tuple[Ints, Ints]:
        """Samples on sides that are one point, and for each the number of that corner."""
        samples, corners = [_NONE], [_NONE]
        lines = np.stack(along_sides(self.ru, self.rv), axis=1)
        collapsed = np.flatnonzero(self.pinched)
        corner = self.connectivity.corner[:, BEGINS].ravel()
        for divisions in np.unique(lines.ravel()[collapsed]).tolist():
            sides = collapsed[lines.ravel()[collapsed] == divisions]
            samples.append(self.grid_samples(sides, divisions).ravel())
            corners.append(np.repeat(corner[sides], divisions + 1))
        return np.concatenate(samples), np.concatenate(corners)

    def corner_samples(self) -> Ints:
        """Samples at the corners (0, 0), (0, 1), (1, 0), (1, 1): shape (P, 4)."""
        last = self.ru * (self.rv + 1)
        zero = np.zeros_like(last)
        corners: Ints = np.stack([zero, self.rv, last, last + self.rv], axis=1)
        corners += self.base[:, None]
        rows = self.ru[self.triangular]
        apex = (rows + 1) * (rows + 2) // 2 - 1
        corners[self.triangular, 1:] = corners[self.triangular, :1]
        corners[self.triangular, 1:] += np.stack([apex, rows, apex], axis=1)
        return corners
