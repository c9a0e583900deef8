"""The evaluation of tensor-product patches on grids of samples, with any method."""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import sample_parameters
from service.engine.evaluation.chunks import ChunkNets
from service.engine.evaluation.evaluation_state import Evaluation, PatchSamples
from service.engine.evaluation.normals import unit_normals
from service.engine.evaluation.poles import write_pole_normals
from service.engine.scratch import Real, scratch
from service.surface.batches import TensorPatches


class GridEvaluation(Evaluation):
    """Tensor-product patches on grids of samples.

    `shape` is (Ru+1, Rv+1), `sample_count` the product of both numbers; results have the shape
    (P, Ru+1, Rv+1, 3). `net_rows` are the rows of the nets of S, S_u and S_v in an array that has
    one net after another (`ChunkNets.rows`).
    """

    patches: TensorPatches

    def __init__(
        self,
        patches: TensorPatches,
        resolution: tuple[int, int],
        dtype: Real,
        out: PatchSamples,
        origin: FloatArray | None,
    ) -> None:
        self.resolution = resolution
        self.shape = (resolution[0] + 1, resolution[1] + 1)
        p, q = patches.degree
        point_end, du_end = (p + 1) * (q + 1), (2 * p + 1) * (q + 1)
        self.net_rows = (
            slice(0, point_end),
            slice(point_end, du_end),
            slice(du_end, du_end + (p + 1) * q),
        )
        super().__init__(patches, self.shape[0] * self.shape[1], dtype, out, origin)

    def load_nets(self, first: int, last: int) -> ChunkNets:
        """The nets of patches [first, last)."""
        p, q = self.patches.degree
        point_rows, du_rows, dv_rows = self.net_rows
        count = (point_rows if self.normals is None else dv_rows).stop
        rows = scratch("nets", (count, self.dimension, last - first), np.float64)
        point = rows[point_rows].reshape(p + 1, q + 1, *rows.shape[1:])
        net = self.load_points(first, last, rows[point_rows]).reshape(point.shape)
        if self.normals is None:
            return ChunkNets(rows, point)
        du = rows[du_rows].reshape(p, q + 1, *rows.shape[1:])
        dv = rows[dv_rows].reshape(p + 1, q, *rows.shape[1:])
        np.subtract(net[1:], net[:-1], out=du)
        np.subtract(net[:, 1:], net[:, :-1], out=dv)
        return ChunkNets(rows, point, du, dv, self.find_thresholds(du, dv))

    def _compute_normals_singly(
        self, patch: NDArray[np.intp], sample: NDArray[np.intp]
    ) -> tuple[FloatArray, int]:
        """Normals of samples, each computed singly; and the number of limits among them."""
        i, j = np.divmod(sample, self.shape[1])
        u, v = (sample_parameters(r) for r in self.resolution)
        return unit_normals(self.patches, patch, u[i], v[j])

    def _write_poles(self, normals: RealArray) -> None:
        """Writes limit normals along collapsed sides, unless the pole has no tangent plane."""
        write_pole_normals(self.patches, self.resolution, normals)
