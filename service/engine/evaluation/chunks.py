"""Chunks of patches: their nets, limits of precision, and the matrix products for their samples.

r patches are computed together, in d coordinates: 3, or 4 for rational patches.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import sample_basis, sample_basis_columns, sample_partials_basis
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


def split_work(count: int, size: int, step: int) -> Iterator[tuple[int, int, int, int]]:
    """Runs (first, last, begin, end): samples, or rows of samples, [begin, end) of [first, last).

    A run has at most `step` samples or rows: all of several patches, or some of one patch. There
    are `count` patches with `size` samples or rows each.
    """
    patches = max(1, step // size)
    for first in range(0, count, patches):
        for begin in range(0, size, step):
            yield first, min(first + patches, count), begin, min(begin + step, size)


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


def count_vectors(degree: tuple[int, int]) -> tuple[int, int, int]:
    """The numbers of control points of a patch, and of their differences along u and along v."""
    p, q = degree
    return (p + 1) * (q + 1), p * (q + 1), (p + 1) * q


Products: TypeAlias = list[list[tuple[RealArray, RealArray, RealArray]]]
"""For each of S, S_u and S_v, a list of products: the two matrices to multiply, and the output."""


def plan_whole_products(
    rows: RealArray,
    degree: tuple[int, int],
    resolution: tuple[int, int],
    results: Sequence[RealArray],
) -> Products:
    """For each of S, S_u and S_v, one product of its vectors with the basis of all samples.

    Parameters
    ----------
    rows : ndarray, shape (K, d r)
        Row k has vector k of all patches.
    results : three arrays, shape (d, r, samples)
        The outputs for S, S_u and S_v.
    """
    basis = sample_partials_basis(degree, resolution, rows.dtype.type)
    ends = np.cumsum(count_vectors(degree))[:-1]
    parts = zip(np.split(rows, ends), np.split(basis, ends), results, strict=True)
    return [[(net.T, values, out.reshape(-1, basis.shape[1]))] for net, values, out in parts]


def plan_separable_products(
    transposed: RealArray,
    degree: tuple[int, int],
    resolution: tuple[int, int],
    results: Sequence[RealArray],
) -> Products:
    """For each of S, S_u and S_v, two products: along u, then of the result along v.

    Parameters
    ----------
    transposed : ndarray, shape (d r, K)
        Column k has vector k of all patches.
    results : three arrays, shape (d, r, samples)
        The outputs for S, S_u and S_v.
    """
    (p, q), (ru, rv), dtype = degree, resolution, transposed.dtype.type
    u, u_lower = (sample_basis(n, ru, dtype) for n in (p, p - 1))
    v, v_lower = (sample_basis_columns(n, rv, dtype) for n in (q, q - 1))
    bases = ((u, v), (u_lower, v), (u, v_lower))
    nets = np.split(transposed, np.cumsum(count_vectors(degree))[:-1], axis=1)
    products: Products = []
    for net, (along_u, along_v), out in zip(nets, bases, results, strict=True):
        # One matrix for each coordinate of each patch: rows follow each other along u, columns
        # along v.
        matrices = net.reshape(-1, along_u.shape[1], len(along_v))
        curves = np.empty((len(matrices), ru + 1, len(along_v)), dtype)
        second = curves.reshape(-1, len(along_v)), along_v, out.reshape(-1, rv + 1)
        products.append([(along_u, matrices, curves), second])
    return products


def build_means(degree: tuple[int, int], dtype: Real) -> RealArray:
    """A matrix (2, differences) whose product with squares of differences gives two means.

    These are the mean squares of the differences along u and along v, times `PRECISE_SHARE`. Their
    product is the least |S_u × S_v|² that is precise enough.
    """
    _, along_u, along_v = count_vectors(degree)
    means = np.zeros((2, along_u + along_v), dtype)
    means[0, :along_u] = PRECISE_SHARE[dtype] / along_u
    means[1, along_u:] = PRECISE_SHARE[dtype] / along_v
    return means
