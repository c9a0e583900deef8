"""The numbers of the samples of patches: on grids, on triangles, and on sides of stitched patches.

A run is a sequence of samples with consecutive numbers. `BorderWrites` lists the samples of borders
that are replaced by the samples of edges.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray, IndexArray, Ints
from service.bases.row_batches import expand_runs, row_slices
from service.engine.connectivity.incidence import Connectivity
from service.engine.plans.patterns import AnyShape, TriangleShape
from service.surface.sides import BEGINS, ENDS, along_sides

_NO_SAMPLES: IndexArray = np.empty(0, dtype=np.uint32)

RUN_SAMPLES = 1 << 16
"""Patches are taken in runs of at most this number of samples, or one patch, so that temporary
arrays stay in the processor's cache."""


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """Patches of one batch with equal resolutions; their samples have consecutive numbers.

    Attributes
    ----------
    batch : int
        The number of the batch.
    first : int
        The number of the first patch of the batch in the model.
    patches : ndarray of int
        The patches of the block, numbered within the batch.
    resolution : (Ru, Rv)
    base : int
        The number of the first sample of the block.
    is_triangle : bool
        Whether the patches are triangles.
    is_whole_batch : bool
        Whether the block has all patches of the batch.
    """

    batch: int
    first: int
    patches: Ints
    resolution: tuple[int, int]
    base: int
    is_triangle: bool
    is_whole_batch: bool

    @property
    def count(self) -> int:
        """The number of samples of one patch."""
        if self.is_triangle:
            return triangle.count_points(self.resolution[0])
        return (self.resolution[0] + 1) * (self.resolution[1] + 1)


@dataclass(frozen=True, eq=False, slots=True)
class BorderWrites:
    """The samples of edges, and the corners, that overwrite the borders of patches.

    Attributes
    ----------
    groups : tuple of (int, ndarray of bool, shape (E,), or None)
        For each number of divisions R, which of the edges have R divisions; None for all edges.
        `sources` refers to a table of the R + 1 samples of all edges of each group (first those
        of all its edges at parameter 0, then at 1/R, …), and then of the C corners.
    targets, sources : ndarrays of uint32, shape (n,)
        The samples that are overwritten, and for each of them the row of the table that replaces
        it.
    """

    groups: tuple[tuple[int, Bools | None], ...]
    targets: IndexArray
    sources: IndexArray


@dataclass(frozen=True, eq=False)
class SampleRuns:
    """Numbers of samples, by patch and by side.

    Attributes
    ----------
    connectivity : Connectivity
        Edges and corners that the patches share.
    base : ndarray of int, shape (P,)
        The number of the first sample of each patch.
    ru, rv : ndarrays of int, shape (P,)
        The divisions of the grid of each patch.
    first_extra : ndarray of int, shape (P, 4)
        The number of the first extra sample of each side, −1 for sides without any. A side has
        extra samples between its ends, with consecutive numbers, if its divisions differ from those
        of its grid.
    extra_count : ndarray of int, shape (P, 4)
        How many extra samples each side has.
    """

    connectivity: Connectivity
    base: Ints
    ru: Ints
    rv: Ints
    first_extra: Ints
    extra_count: Ints

    @property
    def is_triangle(self) -> Bools:
        """Which patches are triangles, shape (P,); `ru` and `rv` are then equal."""
        return self.connectivity.is_triangle

    @cached_property
    def is_stitched(self) -> bool:
        """Whether any patch is stitched with extra samples on a side."""
        return bool((self.first_extra >= 0).any())

    @cached_property
    def pinched_sides(self) -> Bools:
        """Which sides are one point but have several samples, shape (P, 4)."""
        is_pinched = self.connectivity.collapsed.copy()
        # The side v = 1 of a triangle is a corner with one sample.
        is_pinched[self.is_triangle, 3] = False
        return is_pinched

    def find_grid_samples(self, sides: Ints, divisions: int) -> IndexArray:
        """Numbers (n, R+1) of the grid samples along sides (patch · 4 + side) of R divisions."""
        patch, side = np.divmod(sides, 4)
        ru, columns = self.ru[patch], self.rv[patch] + 1
        begin = np.choose(side, [0, ru * columns, 0, columns - 1]) + self.base[patch]
        step = np.where(side < 2, 1, columns).astype(np.uint32)
        samples: IndexArray = np.multiply.outer(step, np.arange(divisions + 1, dtype=np.uint32))
        samples += begin.astype(np.uint32)[:, None]
        on_triangle = self.is_triangle[patch]
        if on_triangle.any():
            local_samples = triangle.side_rows(divisions)[side[on_triangle]]
            samples[on_triangle] = self.base[patch[on_triangle], None] + local_samples
        return samples

    def find_side_samples(self, sides: Ints, divisions: int) -> IndexArray:
        """Numbers (n, R+1) of the samples along sides, in the directions of their edges.

        A side is given as patch · 4 + side. Its R divisions may differ from its grid.
        """
        samples = self.find_grid_samples(sides, divisions)
        if self.is_stitched:
            first_extra = self.first_extra.ravel()[sides]
            has_extra = first_extra >= 0
            # The grid has other divisions here: of its numbers only the first, at the corner where
            # the side begins, is right.
            ends = ENDS[sides[has_extra] % 4]
            samples[has_extra, 1:-1] = first_extra[has_extra, None] + np.arange(divisions - 1)
            samples[has_extra, -1] = self.corner_samples()[sides[has_extra] // 4, ends]
        backward = self.connectivity.backward.ravel()[sides]
        samples[backward] = samples[backward, ::-1]
        return samples

    @staticmethod
    def split_patches(patches: Ints, shape: AnyShape) -> Iterator[Ints]:
        """The patches in runs of `RUN_SAMPLES`."""
        for run in row_slices(len(patches), shape.grid_size, RUN_SAMPLES):
            yield patches[run]

    def patch_samples(self, patches: Ints, shape: AnyShape) -> IndexArray:
        """Numbers (n, …) of the samples of patches of one shape, in the order of local indices."""

        def number(first: Ints, count: int) -> IndexArray:
            numbers: IndexArray = np.add.outer(
                first.astype(np.uint32), np.arange(count, dtype=np.uint32)
            )
            return numbers

        grids = number(self.base[patches], shape.grid_size)
        if isinstance(shape, TriangleShape) or not shape.is_stitched:
            return grids
        runs = [grids]
        runs += [
            number(self.first_extra[patches, side], divisions - 1)
            for side, (divisions, grid_divisions) in enumerate(
                zip(shape.sides, shape.grid_divisions, strict=True)
            )
            if divisions != grid_divisions
        ]
        return np.concatenate(runs, axis=1)

    def iterate_extras(self, block: Block) -> Iterator[tuple[int, Ints, FloatArray, Ints]]:
        """The extra samples of the stitched patches of a block, for one side after another (0 … 3).

        Yields
        ------
        side : int
        patches : ndarray of int, shape (n,)
            The patch of each sample, numbered within the batch.
        along : ndarray of float64, shape (n,)
            The parameter of each sample along the side.
        samples : ndarray of int, shape (n,)
            The numbers of the samples.
        """
        # The numbers of the patches in the model.
        numbers = block.first + block.patches
        for side in range(4):
            patch_rows = np.flatnonzero(self.first_extra[numbers, side] >= 0)
            if not len(patch_rows):
                continue
            counts = self.extra_count[numbers[patch_rows], side]
            # For each sample, the row of its patch in `patch_rows`, and its number.
            first = self.first_extra[numbers[patch_rows], side]
            row, samples = expand_runs(counts, first)
            along = (samples - first[row] + 1) / (counts[row] + 1)
            yield side, block.patches[patch_rows[row]], along, samples

    def find_collapsed_samples(self) -> tuple[IndexArray, Ints]:
        """Samples on sides that are one point, and the number of the corner at each sample."""
        samples, corners = [_NO_SAMPLES], [self.connectivity.corner[:0, 0]]
        if not self.pinched_sides.any():
            return samples[0], corners[0]
        side_divisions = np.stack(along_sides(self.ru, self.rv), axis=1).ravel()
        collapsed = np.flatnonzero(self.pinched_sides)
        first_corner = self.connectivity.corner[:, BEGINS].ravel()
        for divisions in np.unique(side_divisions[collapsed]).tolist():
            sides = collapsed[side_divisions[collapsed] == divisions]
            samples.append(self.find_grid_samples(sides, divisions).ravel())
            corners.append(np.repeat(first_corner[sides], divisions + 1))
        return np.concatenate(samples), np.concatenate(corners)

    def corner_samples(self) -> IndexArray:
        """Samples at the corners (0, 0), (0, 1), (1, 0), (1, 1): shape (P, 4).

        On a triangle, the second and the fourth are the same corner.
        """
        last = self.ru * (self.rv + 1)
        zero = np.zeros_like(last)
        corners = np.stack([zero, self.rv, last, last + self.rv], axis=1)
        corners += self.base[:, None]
        # A triangle begins with the R + 1 samples of v = 0; its last sample is the corner v = 1.
        divisions = self.ru[self.is_triangle]
        apex = (divisions + 1) * (divisions + 2) // 2 - 1
        corners[self.is_triangle, 1:] = corners[self.is_triangle, :1]
        corners[self.is_triangle, 1:] += np.stack([apex, divisions, apex], axis=1)
        return corners.astype(np.uint32)
