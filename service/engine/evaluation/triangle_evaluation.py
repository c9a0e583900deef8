"""Points and unit normals of triangular patches at all samples.

The partials are those along s and t. Their nets are differences of neighbours within a row and
between rows, both of degree n − 1. Two methods compute samples from nets:

- `at_once`: one product with a cached basis of two variables, n²/2 multiplications for a value.
- `by_rows`: if that basis would be too large, each row of samples as a curve.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases import triangle, triangle_basis
from service.bases.arrays import FloatArray, RealArray
from service.bases.row_batches import row_runs
from service.cancellation import checkpoint
from service.engine.evaluation.chunks import CHUNK_SAMPLES, ChunkNets
from service.engine.evaluation.evaluation_state import (
    Evaluation,
    PatchSamples,
)
from service.engine.evaluation.triangle_nets import partial_nets
from service.engine.evaluation.triangle_normals import triangle_normals
from service.engine.scratch import Real, scratch
from service.surface.batches import TrianglePatches

Product: TypeAlias = Callable[[str, FloatArray], RealArray]
"""Planes (d, r, samples) of nets at some samples, in the work array of this name."""


class TriangleEvaluation(Evaluation):
    """Triangular patches at R divisions; results have the shape (P, (R+1)(R+2)/2, 3)."""

    patches: TrianglePatches

    def __init__(
        self,
        patches: TrianglePatches,
        divisions: int,
        dtype: Real,
        out: PatchSamples,
        origin: FloatArray | None,
    ) -> None:
        self.divisions = divisions
        super().__init__(patches, triangle.count_points(divisions), dtype, out, origin)

    def run(self) -> None:
        """Writes all samples: those of some patches at a time, or some of one patch."""
        if triangle_basis.is_small(self.patches.degree, self.divisions):
            self._at_once()
        else:
            self._by_rows()

    def nets(self, first: int, last: int) -> ChunkNets:
        """Planes of the nets of patches [first, last): (K, d, r)."""
        size = triangle.count_points(self.patches.degree)
        at = scratch("nets", (size, self.dimension, last - first), np.float64)
        net = self.load_points(first, last, at)
        if self.normals is None:
            return ChunkNets(at, at)
        ds, dt = partial_nets(net)
        return ChunkNets(at, at, ds, dt, self.find_least_trusted(ds, dt))

    def _at_once(self) -> None:
        # Sixteen numbers are a cache line: every plane of a chunk begins at one.
        count = max(16, CHUNK_SAMPLES // self.each // 16 * 16)
        for first, last in row_runs(self.patches.count, 1 if self.each > CHUNK_SAMPLES else count):
            nets = self.nets(first, last)
            for begin, end in row_runs(self.each, CHUNK_SAMPLES):
                samples = slice(begin, end)
                self._write(nets, slice(first, last), samples, partial(self._product, samples))

    def _by_rows(self) -> None:
        for first, last in row_runs(self.patches.count, max(1, CHUNK_SAMPLES // self.each)):
            nets = self.nets(first, last)
            at = _curves(nets.at)
            if nets.du is not None and nets.dv is not None:
                nets = replace(nets, du=_curves(nets.du), dv=_curves(nets.dv))
            curves = replace(nets, at=at)
            for rows, samples in self._row_runs():
                product = partial(self._rows, rows, samples.stop - samples.start)
                self._write(curves, slice(first, last), samples, product)

    def _row_runs(self) -> Iterator[tuple[range, slice]]:
        """Runs of rows of samples, and the slices of these samples."""
        starts, low = triangle.row_starts(self.divisions), 0
        while low <= self.divisions:
            last = np.searchsorted(starts, starts[low] + CHUNK_SAMPLES, side="right") - 1
            high = max(low + 1, int(last))
            yield range(low, high), slice(int(starts[low]), int(starts[high]))
            low = high

    def _write(self, nets: ChunkNets, patches: slice, samples: slice, product: Product) -> None:
        """Writes positions and normals of all samples of some patches, or some samples of one."""
        checkpoint()
        at = product("at", nets.at)
        self.write_positions(at, self.positions[patches, samples])
        if self.normals is None or nets.du is None or nets.dv is None:
            return
        du, dv = product("du", nets.du), product("dv", nets.dv)
        self.write_normals(
            self.partials_to_vectors(at, du, dv),
            self.normals[patches, samples],
            nets.least(self.dtype),
            patches.start * self.each + samples.start,
        )

    def _product(self, samples: slice, name: str, nets: FloatArray) -> RealArray:
        """Nets (K, d, r) times the basis."""
        count, planes, patches = nets.shape
        degree = triangle.degree_of(count)
        basis = triangle_basis.sample_triangle_basis(degree, self.divisions, self.dtype)[:, samples]
        out = scratch(name, (planes, patches, basis.shape[1]), self.dtype)
        rounded = nets.reshape(count, -1).astype(self.dtype, copy=False)
        np.matmul(rounded.T, basis, out=out.reshape(planes * patches, -1))
        return out

    def _rows(self, rows: range, samples: int, name: str, curves: FloatArray) -> RealArray:
        """Curves (n+1, n+1, d r) at some rows of samples."""
        planes, count = 4 if self.rational else 3, curves.shape[2]
        out = scratch(name, (planes, count // planes, samples), self.dtype)
        triangle_basis.evaluate_rows(
            curves, self.divisions, rows, self.dtype, out.reshape(count, samples)
        )
        return out

    def _write_poles(self, normals: RealArray) -> None:
        """Does nothing: at the poles of triangles all limits are computed one by one."""

    def _slow_normals(
        self, patch: NDArray[np.intp], sample: NDArray[np.intp]
    ) -> tuple[FloatArray, int]:
        """Normals of samples, each computed singly; and the number of limits among them."""
        starts = triangle.row_starts(self.divisions)
        row = np.searchsorted(starts, sample, side="right") - 1
        s, t = (sample - starts[row]) / self.divisions, row / self.divisions
        return triangle_normals(self.patches, patch, s, t)


def _curves(nets: FloatArray) -> FloatArray:
    """Rows as curves: (K, d, r) to (n+1, n+1, d r)."""
    return triangle_basis.row_curves(nets.reshape(len(nets), -1))
