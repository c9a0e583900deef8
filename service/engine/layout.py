"""Where the samples of a model lie: one run of rows, patch after patch.

A patch is a grid of samples in its own resolution; a triangle is rows of samples in the larger of
the two numbers of divisions. Where a neighbour divides a shared edge more finely, the patch is
*framed*: its border follows the edges, and the samples that its grid lacks lie in runs of their own
at the end.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.distinct import distinct_rows
from service.engine.patterns import AnyShape, Shape, TriangleShape
from service.engine.stitch import Seams, find_seams
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel
from service.surface.sides import BEGINS, ENDS, along_sides

_NONE: Ints = np.empty(0, dtype=np.intp)


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """Patches of one batch that are sampled alike; their samples lie in one run.

    `patches` are numbers within the batch, `first` the batch's first number in the model, `base`
    the first sample.
    """

    batch: Patches
    first: int
    patches: Ints
    resolution: tuple[int, int]
    base: int

    @property
    def triangular(self) -> bool:
        """Whether these are triangles, of as many divisions along u as along v."""
        return isinstance(self.batch, TrianglePatches)

    @property
    def count(self) -> int:
        """Samples of one patch."""
        if self.triangular:
            return triangle.size(self.resolution[0])
        return (self.resolution[0] + 1) * (self.resolution[1] + 1)

    @property
    def whole(self) -> bool:
        """Whether the block is the whole batch."""
        return len(self.patches) == self.batch.count


@dataclass(frozen=True, eq=False, slots=True)
class Layout:
    """Where every sample lies.

    Attributes
    ----------
    seams : Seams
        How the patches hang together.
    blocks : tuple of Block
        Grids, first those of ordinary patches, then those of framed ones.
    divisions : ndarray of int, shape (E,)
        Of every distinct edge.
    base, ru, rv : ndarrays of int, shape (P,)
        First sample and grid of every patch.
    triangular : ndarray of bool, shape (P,)
        Which patches are triangles; `ru` and `rv` are then equal.
    extra, inner : ndarrays of int, shape (P, 4)
        First inner sample of each side that has other divisions than its grid, else -1; and how
        many inner samples it has.
    size : int
        Samples in all.
    """

    seams: Seams
    blocks: tuple[Block, ...]
    divisions: Ints
    base: Ints
    ru: Ints
    rv: Ints
    triangular: Bools
    extra: Ints
    inner: Ints
    size: int

    @staticmethod
    def plan(model: PatchModel, resolution: tuple[int, int]) -> "Layout":
        """Divisions of the edges, and the run of samples of every patch and framed side."""
        ru, rv = resolution
        seams = find_seams(model.batches)
        total = model.patch_count
        triangular = np.concatenate(
            [np.full(b.count, isinstance(b, TrianglePatches)) for b in model.batches]
        )
        rus, rvs = np.full(total, ru), np.full(total, rv)
        rus[triangular] = rvs[triangular] = max(ru, rv)
        own = np.stack(along_sides(rus, rvs), axis=1)
        # A shared edge takes the larger of its two numbers of divisions: no triangle finds more
        # on any side than it has.
        divisions = np.zeros(len(seams.users), dtype=np.intp)
        np.maximum.at(divisions, seams.edge, own)
        uneven = (divisions[seams.edge] != own) & ~seams.collapsed
        framed = uneven.any(axis=1)
        base, extra = np.zeros(total, dtype=np.intp), np.full((total, 4), -1, dtype=np.intp)
        # Strips need a line of samples inside to join to.
        rus[framed], rvs[framed] = max(ru, 2), max(rv, 2)
        blocks: list[Block] = []
        size = 0
        for wanted in (False, True):
            first = 0
            for batch in model.batches:
                here = np.flatnonzero(framed[first : first + batch.count] == wanted)
                if len(here):
                    grid = int(rus[first + here[0]]), int(rvs[first + here[0]])
                    block = Block(batch, first, here, grid, size)
                    base[first + here] = size + np.arange(len(here)) * block.count
                    size += len(here) * block.count
                    blocks.append(block)
                first += batch.count
        grids = np.stack(along_sides(rus, rvs), axis=1)
        apart = framed[:, None] & (divisions[seams.edge] != grids) & ~seams.collapsed
        inner = np.where(apart, divisions[seams.edge] - 1, 0)
        before = (np.cumsum(inner) - inner.ravel()).reshape(inner.shape)
        extra[apart] = size + before[apart]
        size += int(inner.sum())
        return Layout(
            seams, tuple(blocks), divisions, base, rus, rvs, triangular, extra, inner, size
        )

    @property
    def framed(self) -> bool:
        """Whether any side has samples of its own beside its grid."""
        return bool((self.extra >= 0).any())

    @property
    def folds(self) -> bool:
        """Whether faces may have one place twice that no pattern knows of."""
        return bool(self.divisions.min() < 2 or self.seams.folded.any())

    @property
    def pinched(self) -> Bools:
        """Which sides are one point and yet several samples, shape (P, 4)."""
        several = self.seams.collapsed.copy()
        several[self.triangular, 3] = False
        return several

    @property
    def shares(self) -> bool:
        """Whether samples of one patch or of several have places in common."""
        shared = bool((self.seams.users > 1).any())
        shared |= len(self.seams.corner_points) < self.corners
        return shared or bool(self.pinched.any())

    @property
    def corners(self) -> int:
        """Samples at corners in all: a triangle has three."""
        return self.seams.corner.size - int(np.count_nonzero(self.triangular))

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
        backward = self.seams.backward.ravel()[sides]
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

    def shapes(self) -> list[tuple[AnyShape, Ints]]:
        """Patches that one index pattern serves, in the order of their first."""
        own = np.stack(along_sides(self.ru, self.rv), axis=1)
        sides = np.where(self.extra >= 0, self.inner + 1, own)
        rows = np.concatenate(
            [
                self.triangular[:, None],
                self.ru[:, None],
                self.rv[:, None],
                sides,
                self.seams.collapsed,
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
        return found

    def side_groups(self) -> Iterator[tuple[int, Ints]]:
        """Sides that are lines (patch · 4 + side), by the divisions of their edges."""
        divisions = self.divisions[self.seams.edge.ravel()]
        lines = ~self.seams.collapsed.ravel()
        for number in np.unique(divisions[lines]).tolist():
            yield number, np.flatnonzero(lines & (divisions == number))

    def collapsed_samples(self) -> tuple[Ints, Ints]:
        """Samples on sides that are one point, and for each the number of that corner."""
        samples, corners = [_NONE], [_NONE]
        lines = np.stack(along_sides(self.ru, self.rv), axis=1)
        collapsed = np.flatnonzero(self.pinched)
        corner = self.seams.corner[:, BEGINS].ravel()
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
