"""The evaluation of tensor-product patches on grids of samples, whatever the method."""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import sampled_with_slopes, samples
from service.engine.evaluation.normals import unit_normals
from service.engine.evaluation.poles import pole_normals
from service.engine.evaluation.under_way import ChunkNets, Evaluation, Samples
from service.engine.scratch import Real, scratch
from service.surface.batches import TensorPatches
from service.surface.sides import along_sides, side_of


class GridEvaluation(Evaluation):
    """Tensor-product patches on grids of samples.

    `shape` is (Ru+1, Rv+1), `each` its product; results have the shape (P, Ru+1, Rv+1, 3).
    """

    patches: TensorPatches

    def __init__(
        self,
        patches: TensorPatches,
        resolution: tuple[int, int],
        dtype: Real,
        out: Samples,
        origin: FloatArray | None,
    ) -> None:
        self.resolution = resolution
        self.shape = (resolution[0] + 1, resolution[1] + 1)
        super().__init__(patches, self.shape[0] * self.shape[1], dtype, out, origin)

    def nets(self, first: int, last: int) -> ChunkNets:
        """Planes of the nets of patches [first, last), ready for products."""
        p, q = self.patches.degree
        at, net = (rows.reshape(p + 1, q + 1, *rows.shape[1:]) for rows in self.points(first, last))
        if self.normals is None:
            return ChunkNets(at, None, None, None)
        du = scratch("net du", (p, q + 1, *net.shape[2:]), np.float64)
        dv = scratch("net dv", (p + 1, q, *net.shape[2:]), np.float64)
        np.subtract(net[1:], net[:-1], out=du)
        np.subtract(net[:, 1:], net[:, :-1], out=dv)
        return ChunkNets(at, du, dv, self.trust(du, dv))

    def _slow_normals(
        self, patch: NDArray[np.intp], sample: NDArray[np.intp]
    ) -> tuple[FloatArray, int]:
        """Normals of samples, by their number in a patch, one by one; how many are limits."""
        i, j = np.divmod(sample, self.shape[1])
        u, v = (samples(r) for r in self.resolution)
        return unit_normals(self.patches, patch, u[i], v[j])

    def _write_poles(self, normals: RealArray) -> None:
        """Limits along collapsed sides, where these have the usual form."""
        for poles in self.patches.poles:
            degree = along_sides(*self.patches.degree)[poles.side]
            divisions = along_sides(*self.resolution)[poles.side]
            found = pole_normals(poles, sampled_with_slopes(degree, divisions))
            rows = side_of(normals, poles.side)
            if self._replaced:
                found = np.where(np.isnan(found), rows[poles.patches], found)
            rows[poles.patches] = found
