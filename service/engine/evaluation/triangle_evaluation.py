"""Points and unit normals of triangular patches at all samples.

The partials S_s and S_t have nets of degree n − 1, the differences of neighbouring control points
within a row and between rows. Two ways lead from nets to samples:

- `_write_at_once`: one product with a cached basis of two variables, n²/2 multiplications for a
  value.
- `_write_by_rows`: if that basis would be too large, each row of samples as a Bézier curve.

Nets have the shape (K, d, r): K control points of d coordinates (3, or 4 for rational patches) of r
patches that are computed together.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from service.bases import triangle, triangle_basis
from service.bases.arrays import FloatArray, Ints, RealArray
from service.bases.row_batches import row_runs
from service.cancellation import checkpoint
from service.engine.evaluation.chunks import CHUNK_SAMPLES, ChunkNets
from service.engine.evaluation.evaluation_state import (
    Evaluation,
    PatchSamples,
)
from service.engine.evaluation.normals import triangle_normals
from service.engine.evaluation.triangle_nets import partial_nets
from service.engine.scratch import Real, scratch
from service.surface.batches import TrianglePatches

Product: TypeAlias = Callable[[str, FloatArray], RealArray]
"""Writes the values of nets at samples, planes (d, r, samples), to the work array of this name."""


class TriangleEvaluation(Evaluation):
    """The evaluation of P triangles at R divisions; results have the shape (P, (R+1)(R+2)/2, 3)."""

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

    def evaluate_by_matrix(self) -> None:
        """Writes all samples with the method `matrix`."""
        if triangle_basis.is_small(self.patches.degree, self.divisions):
            self._write_at_once()
        else:
            self._write_by_rows()

    def load_nets(self, first: int, last: int) -> ChunkNets:
        """The nets (K, d, r) of patches [first, last)."""
        size = triangle.count_points(self.patches.degree)
        point = scratch("nets", (size, self.dimension, last - first), np.float64)
        net = self.load_points(first, last, point)
        # The evaluation of triangles does not read `rows`, so any array serves.
        if self.normals is None:
            return ChunkNets(rows=point, point=point)
        ds, dt = partial_nets(net)
        return ChunkNets(point, point, ds, dt, self.find_thresholds(ds, dt))

    def _write_at_once(self) -> None:
        """Writes all samples by products with a cached basis of two variables."""
        # A multiple of 16 patches, because a cache line has 16 float32 numbers: so every plane of a
        # chunk begins at a cache line.
        chunk_patches = max(16, CHUNK_SAMPLES // self.sample_count // 16 * 16)
        for first, last in row_runs(
            self.patches.count, 1 if self.sample_count > CHUNK_SAMPLES else chunk_patches
        ):
            nets = self.load_nets(first, last)
            for begin, end in row_runs(self.sample_count, CHUNK_SAMPLES):
                samples = slice(begin, end)
                self._write(
                    nets, slice(first, last), samples, partial(self._multiply_basis, samples)
                )

    def _write_by_rows(self) -> None:
        """Writes all samples, each row of samples as a Bézier curve."""
        starts = triangle.row_starts(self.divisions)
        for first, last in row_runs(self.patches.count, max(1, CHUNK_SAMPLES // self.sample_count)):
            nets = self.load_nets(first, last)
            point = _to_row_curves(nets.point)
            if nets.du is not None and nets.dv is not None:
                nets = replace(nets, du=_to_row_curves(nets.du), dv=_to_row_curves(nets.dv))
            curves = replace(nets, point=point)
            for begin, end in triangle.row_runs(self.divisions, CHUNK_SAMPLES):
                samples = slice(int(starts[begin]), int(starts[end]))
                product = partial(
                    self._evaluate_rows, range(begin, end), samples.stop - samples.start
                )
                self._write(curves, slice(first, last), samples, product)

    def _write(self, nets: ChunkNets, patches: slice, samples: slice, product: Product) -> None:
        """Writes positions and normals of samples: all of several patches, or some of one patch."""
        checkpoint()
        point = product("point", nets.point)
        self.write_positions(point, self.positions[patches, samples])
        if self.normals is None or nets.du is None or nets.dv is None:
            return
        du, dv = product("du", nets.du), product("dv", nets.dv)
        self.write_normals(
            self.partials_to_vectors(point, du, dv),
            self.normals[patches, samples],
            nets.threshold_column(self.dtype),
            patches.start * self.sample_count + samples.start,
        )

    def _multiply_basis(self, samples: slice, name: str, nets: FloatArray) -> RealArray:
        """Values of nets (K, d, r) at samples, (d, r, samples), by one product with the basis."""
        count, planes, patches = nets.shape
        degree = triangle.degree_of(count)
        basis = triangle_basis.sample_triangle_basis(degree, self.divisions, self.dtype)[:, samples]
        out = scratch(name, (planes, patches, basis.shape[1]), self.dtype)
        rounded = nets.reshape(count, -1).astype(self.dtype, copy=False)
        np.matmul(rounded.T, basis, out=out.reshape(planes * patches, -1))
        return out

    def _evaluate_rows(
        self, rows: range, samples_in_rows: int, name: str, curves: FloatArray
    ) -> RealArray:
        """Values at the samples of some rows, (d, r, samples), from curves (n+1, n+1, d r)."""
        coordinate_count = curves.shape[2]  # d r
        shape = self.dimension, coordinate_count // self.dimension, samples_in_rows
        out = scratch(name, shape, self.dtype)
        triangle_basis.evaluate_rows(
            curves, self.divisions, rows, self.dtype, out.reshape(coordinate_count, samples_in_rows)
        )
        return out

    def _write_poles(self, normals: RealArray) -> None:
        """Does nothing: limits at the poles of triangles are computed one by one."""

    def _compute_normals_singly(self, patch: Ints, sample: Ints) -> tuple[FloatArray, int]:
        """Normals of samples, each computed singly; and the number of limits among them."""
        s, t = triangle.locate_samples(self.divisions, sample)
        return triangle_normals(self.patches, patch, s, t)


def _to_row_curves(nets: FloatArray) -> FloatArray:
    """The curves on which rows of samples lie, (n+1, n+1, d r), from nets (K, d, r)."""
    return triangle_basis.row_curves(nets.reshape(len(nets), -1))
