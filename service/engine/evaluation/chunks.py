"""Chunks of patches, their nets and limits of precision, shared by all methods of evaluation."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.engine.scratch import Real
from service.surface.batches import Patches

CHUNK_SAMPLES = 18_432
"""Samples in one chunk: a dozen numbers for each sample fit the second-level cache."""

PRECISE_SHARE: dict[Real, float] = {np.float32: 2.0**-6, np.float64: 2.0**-20}
"""If |S_u × S_v| ÷ (mean |Δ_u P| · mean |Δ_v P|) is larger than this, the working precision is
sufficient for the normal: the error of its direction is at most about 1e-5 radians in float32
(usually 2e-7), or 1e-10 in float64. The means are root mean squares, and S_u and S_v are without
the factors p and q."""

SUBNORMAL: dict[Real, float] = {np.float32: 2.0**-100, np.float64: 2.0**-900}
"""If |S_u × S_v|² is smaller than this, the squares of its coordinates lose digits to underflow."""


@dataclass(frozen=True, eq=False, slots=True)
class ChunkNets:
    """Nets of S and of its partials in float64, for r patches.

    `point`, `du` and `dv` have the shapes (p+1, q+1, d, r), (p, q+1, d, r) and (p+1, q, d, r), with
    d = 3, or 4 for rational patches; for triangles (K, d, r), where K is the number of vectors in
    the net. `du` and `dv` are differences, without the factors p and q. `rows` (V, d, r) has the V
    vectors of all three nets, one net after another; for triangles, or without partials, those of
    `point` alone. `threshold` (r,) is the least |S_u × S_v|² whose direction is precise enough.
    """

    rows: FloatArray
    point: FloatArray
    du: FloatArray | None = None
    dv: FloatArray | None = None
    threshold: FloatArray | None = None

    def threshold_column(self, dtype: Real) -> RealArray:
        """`threshold` as a column (r, 1) in the working precision; 0 without partials."""
        if self.threshold is None:
            return np.zeros((self.point.shape[-1], 1), dtype)
        threshold: RealArray = self.threshold.astype(dtype)
        return threshold[:, None]


def weight_points(
    points: FloatArray, weights: FloatArray, middle: FloatArray, scale: float
) -> None:
    """Replaces points P (K, 3, r) by w (P − middle) scale, with the weights w (K, 1, r)."""
    points -= middle[:, np.newaxis]
    points *= scale
    points *= weights


def find_shift(patches: Patches, origin: FloatArray | None) -> FloatArray:
    """The vector (3,) from the origin of the result to the middle of the batch."""
    return patches.middle if origin is None else patches.middle - origin


def write_local(planes: RealArray, shift: FloatArray, scale: float, out: RealArray) -> None:
    """Writes scaled planes (3, …), relative to the middle, as points (…, 3) moved by `shift`."""
    dtype = planes.dtype.type
    for axis in range(3):
        np.multiply(planes[axis], dtype(1 / scale), out=out[..., axis])
        if shift[axis]:
            out[..., axis] += dtype(shift[axis])
