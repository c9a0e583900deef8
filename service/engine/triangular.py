"""Points and unit normals of triangular patches at all samples.

The partials are those along s and t. Their nets are differences of neighbours within a row and
between rows; one basis of degree n − 1 serves both.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from service.bases import triangle
from service.bases.arrays import FloatArray, RealArray
from service.engine.evaluation import ChunkNets, Evaluation, Samples
from service.engine.scratch import Real, scratch
from service.engine.triangle_nets import differences
from service.engine.triangle_normals import triangle_normals
from service.surface.lowered import TrianglePatches

CHUNK_SAMPLES = 18_432
"""Samples worked on at a time: a dozen planes of them fit the second-level cache."""


class TriangularEvaluation(Evaluation):
    """Triangular patches at R divisions; results have the shape (P, (R+1)(R+2)/2, 3)."""

    patches: TrianglePatches

    def __init__(
        self,
        patches: TrianglePatches,
        divisions: int,
        dtype: Real,
        out: Samples,
        origin: FloatArray | None,
    ) -> None:
        self.divisions = divisions
        super().__init__(patches, triangle.size(divisions), dtype, out, origin)

    def run(self) -> None:
        """Writes all samples: those of some patches at a time, or some of one patch."""
        degree = self.patches.degree
        count = max(16, CHUNK_SAMPLES // self.each // 16 * 16)
        step = min(CHUNK_SAMPLES, max(64, triangle.CHUNK_NUMBERS // triangle.size(degree)))
        if step < self.each:
            count = 1
        for first, last in _runs(self.patches.count, count):
            nets = self.nets(first, last)
            for begin, end in _runs(self.each, step):
                at = self._product("at", nets.at, degree, begin, end)
                self.write_positions(at, self.positions[first:last, begin:end])
                if self.normals is None or nets.du is None or nets.dv is None:
                    continue
                du = self._product("du", nets.du, degree - 1, begin, end)
                dv = self._product("dv", nets.dv, degree - 1, begin, end)
                self.write_normals(
                    self.partials_to_vectors(at, du, dv),
                    self.normals[first:last, begin:end],
                    nets.least(self.dtype),
                    first * self.each + begin,
                )

    def nets(self, first: int, last: int) -> ChunkNets:
        """Planes of the nets of patches [first, last): (K, d, r)."""
        at, net = self.points(first, last)
        if self.normals is None:
            return ChunkNets(at, None, None, None)
        ds, dt = differences(net)
        return ChunkNets(at, ds, dt, self.trust(ds, dt))

    def _product(self, name: str, nets: FloatArray, degree: int, begin: int, end: int) -> RealArray:
        """Planes (d, r, samples) of nets (K, d, r) at some of the samples."""
        basis = triangle.sampled_triangle(degree, self.divisions, self.dtype, begin, end)
        planes, patches = nets.shape[1:]
        out = scratch(name, (planes, patches, end - begin), self.dtype)
        rounded = nets.reshape(len(nets), planes * patches).astype(self.dtype, copy=False)
        np.matmul(rounded.T, basis, out=out.reshape(planes * patches, end - begin))
        return out

    def _slow_normals(
        self, patch: NDArray[np.intp], sample: NDArray[np.intp]
    ) -> tuple[FloatArray, int]:
        """Normals of samples, by their number in a patch, one by one."""
        starts = triangle.row_starts(self.divisions)
        row = np.searchsorted(starts, sample, side="right") - 1
        s, t = (sample - starts[row]) / self.divisions, row / self.divisions
        return triangle_normals(self.patches, patch, s, t)


def _runs(count: int, step: int) -> Iterator[tuple[int, int]]:
    for first in range(0, count, step):
        yield first, min(first + step, count)
