"""Numbers of the samples of patches: of grids, of rows of triangles, and of framed sides.

`BorderWrites` lists the samples that the samples of edges replace.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases import triangle
from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.mesh.connectivity import Connectivity
from service.engine.mesh.patterns import AnyShape, TriangleShape
from service.surface.sides import BEGINS, ENDS, along_sides

_NONE: Ints = np.empty(0, dtype=np.intp)


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """Patches of one batch with equal resolutions; their samples have consecutive numbers.

    `batch` is the number of the batch, `first` its first patch in the model; `patches` are numbers
    within the batch, `is_batch` says whether they are all patches of the batch, and `base` is the
    first sample.
    """

    batch: int
    first: int
    patches: Ints
    resolution: tuple[int, int]
    base: int
    is_triangle: bool
    is_batch: bool

    @property
    def count(self) -> int:
        """Samples of one patch."""
        if self.is_triangle:
            return triangle.count_points(self.resolution[0])
        return (self.resolution[0] + 1) * (self.resolution[1] + 1)


@dataclass(frozen=True, eq=False, slots=True)
class BorderWrites:
    """The samples of edges, and the corners, that overwrite the borders of patches.

    Attributes
    ----------
    groups : tuple of (int, ndarray of bool, shape (E,), or None)
        A number of divisions R, and the edges with R divisions; None for all edges. A table of
        points contains the (R + 1) E_R samples of each group, ordered by parameter, then the
        corners (C,).
    targets, sources : ndarrays of int, shape (n,)
        Samples of the model, and the row of the table for each sample.
    """

    groups: tuple[tuple[int, Bools | None], ...]
    targets: Ints
    sources: Ints


@dataclass(frozen=True, eq=False)
class SampleRuns:
    """Numbers of samples, by patch and by side.

    Attributes
    ----------
    connectivity : Connectivity
        Edges and corners that the patches share.
    base, ru, rv : ndarrays of int, shape (P,)
        First sample and grid of every patch.
    extra, inner : ndarrays of int, shape (P, 4)
        First inner sample of each side whose divisions differ from its grid, else -1; and the
        number of its inner samples.
    """

    connectivity: Connectivity
    base: Ints
    ru: Ints
    rv: Ints
    extra: Ints
    inner: Ints

    @property
    def is_triangle(self) -> Bools:
        """Which patches are triangles, shape (P,); `ru` and `rv` are then equal."""
        return self.connectivity.is_triangle

    @cached_property
    def pinched_sides(self) -> Bools:
        """Which sides are one point but have several samples, shape (P, 4)."""
        several = self.connectivity.collapsed.copy()
        several[self.is_triangle, 3] = False
        return several

    def find_grid_samples(self, sides: Ints, divisions: int) -> Ints:
        """Samples of the grids along sides (patch · 4 + side) that have R divisions: (n, R+1)."""
        patch, side = np.divmod(sides, 4)
        ru, columns = self.ru[patch], self.rv[patch] + 1
        begin = np.choose(side, [0, ru * columns, 0, columns - 1]) + self.base[patch]
        step = np.where(side < 2, 1, columns)
        samples = begin[:, None] + step[:, None] * np.arange(divisions + 1)
        rows = self.is_triangle[patch]
        if rows.any():
            lines = triangle.side_rows(divisions)[side[rows]]
            samples[rows] = self.base[patch[rows], None] + lines
        return samples.astype(np.intp, copy=False)

    def find_side_samples(self, sides: Ints, divisions: int) -> Ints:
        """Samples along sides (patch · 4 + side) in the direction of their edges: (n, R+1)."""
        samples = self.find_grid_samples(sides, divisions)
        extra = self.extra.ravel()[sides]
        has_extra = extra >= 0
        if has_extra.any():
            # From corner to corner through the extra samples of the side.
            ends = ENDS[sides[has_extra] % 4]
            samples[has_extra, 1:] = extra[has_extra, None] + np.arange(divisions)
            samples[has_extra, -1] = self.corner_samples()[sides[has_extra] // 4, ends]
        backward = self.connectivity.backward.ravel()[sides]
        samples[backward] = samples[backward, ::-1]
        return samples

    def patch_samples(self, patches: Ints, shape: AnyShape) -> Ints:
        """Samples of patches of one shape in the local numbering of its pattern: (n, …)."""
        if isinstance(shape, TriangleShape):
            return self.base[patches, None] + np.arange(triangle.count_points(shape.divisions))
        count = (shape.resolution[0] + 1) * (shape.resolution[1] + 1)
        runs = [self.base[patches, None] + np.arange(count)]
        runs += [
            self.extra[patches, side, None] + np.arange(divisions - 1)
            for side, (divisions, grid_divisions) in enumerate(
                zip(shape.sides, shape.grid_divisions, strict=True)
            )
            if divisions != grid_divisions
        ]
        return np.concatenate(runs, axis=1)

    def iterate_extras(self, block: Block) -> Iterator[tuple[int, Ints, FloatArray, Ints]]:
        """Extra samples of the framed sides of a block, side by side (0 … 3).

        Yields
        ------
        side : int
        patches : ndarray of int, shape (n,)
            The patch of each sample, numbered within the batch.
        along : ndarray of float64, shape (n,)
            The parameter of each sample along the side.
        samples : ndarray of int, shape (n,)
        """
        numbers = block.first + block.patches
        for side in range(4):
            separate = np.flatnonzero(self.extra[numbers, side] >= 0)
            if not len(separate):
                continue
            inner = self.inner[numbers[separate], side]
            row = np.repeat(np.arange(len(separate)), inner)
            k = np.arange(len(row)) - np.repeat(np.cumsum(inner) - inner, inner)
            samples = self.extra[numbers[separate], side][row] + k
            yield side, block.patches[separate[row]], (k + 1) / (inner[row] + 1), samples

    def find_collapsed_samples(self) -> tuple[Ints, Ints]:
        """Samples on sides that are one point, and the number of the corner at each sample."""
        samples, corners = [_NONE], [_NONE]
        lines = np.stack(along_sides(self.ru, self.rv), axis=1)
        collapsed = np.flatnonzero(self.pinched_sides)
        corner = self.connectivity.corner[:, BEGINS].ravel()
        for divisions in np.unique(lines.ravel()[collapsed]).tolist():
            sides = collapsed[lines.ravel()[collapsed] == divisions]
            samples.append(self.find_grid_samples(sides, divisions).ravel())
            corners.append(np.repeat(corner[sides], divisions + 1))
        return np.concatenate(samples), np.concatenate(corners)

    def corner_samples(self) -> Ints:
        """Samples at the corners (0, 0), (0, 1), (1, 0), (1, 1): shape (P, 4)."""
        last = self.ru * (self.rv + 1)
        zero = np.zeros_like(last)
        corners: Ints = np.stack([zero, self.rv, last, last + self.rv], axis=1)
        corners += self.base[:, None]
        rows = self.ru[self.is_triangle]
        apex = (rows + 1) * (rows + 2) // 2 - 1
        corners[self.is_triangle, 1:] = corners[self.is_triangle, :1]
        corners[self.is_triangle, 1:] += np.stack([apex, rows, apex], axis=1)
        return corners
