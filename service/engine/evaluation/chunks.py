"""Shared by all ways of evaluation: chunks of patches, their nets, their precision."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.engine.scratch import Real
from service.surface.batches import Patches

CHUNK_SAMPLES = 18_432
"""Samples in one chunk: a dozen planes of them fit the second-level cache."""

TRUSTED: dict[Real, float] = {np.float32: 2.0**-6, np.float64: 2.0**-20}
"""|S_u × S_v| ÷ (mean |Δ_u P| · mean |Δ_v P|) above which the working precision is sufficient: the
error of the direction is then at most about 1e-5 (float32, usually 2e-7) or 1e-10 (float64)."""

SUBNORMAL: dict[Real, float] = {np.float32: 2.0**-100, np.float64: 2.0**-900}
"""|S_u × S_v|² below which squares of its coordinates have lost digits to underflow."""


@dataclass(frozen=True, eq=False, slots=True)
class ChunkNets:
    """Nets (p+1, q+1, d, r) of S and of its partials, in float64; of triangles (K, d, r).

    `trust` (r,) is the least trusted |S_u × S_v|². `rows` (K, d, r) are the control points of all
    three nets, one net after another.
    """

    rows: FloatArray
    at: FloatArray
    du: FloatArray | None = None
    dv: FloatArray | None = None
    trust: FloatArray | None = None

    def least(self, dtype: Real) -> RealArray:
        """`trust` in the working precision, to compare (r, samples) with; 0 without partials."""
        if self.trust is None:
            return np.zeros((self.at.shape[-1], 1), dtype)
        least: RealArray = self.trust.astype(dtype)
        return least[:, None]


def weight_points(
    points: FloatArray, weights: FloatArray, middle: FloatArray, scale: float
) -> None:
    """Makes points (K, 3, r) homogeneous in place: w (P − middle) scale, weights (K, 1, r)."""
    points -= middle[:, np.newaxis]
    points *= scale
    points *= weights


def find_shift(patches: Patches, origin: FloatArray | None) -> FloatArray:
    """The vector (3,) from the origin of the result to the middle of the evaluation."""
    return patches.middle if origin is None else patches.middle - origin


def write_local(planes: RealArray, shift: FloatArray, scale: float, out: RealArray) -> None:
    """Writes scaled planes (3, …) about the middle as points (…, 3), moved by `shift`."""
    dtype = planes.dtype.type
    for axis in range(3):
        np.multiply(planes[axis], dtype(1 / scale), out=out[..., axis])
        if shift[axis]:
            out[..., axis] += dtype(shift[axis])
