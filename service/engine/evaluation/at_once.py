"""Polynomial patches on small grids: all samples of many patches in a few products.

The everyday way. Coordinates are planes throughout: rows of the products are the coordinates of the
patches, columns first the control points and their differences, then the samples.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.bases.bernstein import sampled_partials
from service.engine.extent import is_moved
from service.engine.scratch import Real, scratch
from service.stopping import checkpoint
from service.surface.batches import Patches, TensorPatches

CHUNK_SAMPLES = 18_432
"""Samples worked on at a time: a dozen planes of them fit the second-level cache."""

TRUSTED: dict[Real, float] = {np.float32: 2.0**-6, np.float64: 2.0**-20}
"""|S_u × S_v| ÷ (mean |Δ_u P| · mean |Δ_v P|) above which the working precision is good enough: the
direction is then wrong by at most about 1e-5 (float32, usually 2e-7) or 1e-10 (float64)."""

SUBNORMAL: dict[Real, float] = {np.float32: 2.0**-100, np.float64: 2.0**-900}
"""|S_u × S_v|² below which squares of its coordinates have lost digits to underflow."""

ORDINARY = 16
"""Models larger than 2^-16 and smaller than 2^16 are not scaled: fourth powers of such lengths are
far from float32's limits."""

SMALL = 64
"""Control points of a patch up to which a product takes differences as fast as subtractions."""


def is_everyday(patches: TensorPatches) -> bool:
    """Whether `evaluate_at_once` can evaluate these."""
    p, q = patches.degree
    is_small = patches.weights is None and (p + 1) * (q + 1) <= SMALL
    return is_small and is_ordinary(patches)


def is_ordinary(patches: Patches) -> bool:
    """Whether patches are evaluated as they are, and not scaled."""
    return 2.0**-ORDINARY <= patches.extent <= 2.0**ORDINARY or patches.extent == 0


def evaluate_at_once(
    patches: TensorPatches,
    resolution: tuple[int, int],
    origin: FloatArray | None,
    positions: RealArray,
    normals: RealArray | None,
) -> list[NDArray[np.intp]]:
    """Writes points and unit normals; returns which samples, counted over all, are doubtful.

    Their normals are NaN. The vectors S_u × S_v are computed in the precision of the result, from
    differences of the control points in float64: such a product of a point, its neighbour and
    zeros is their difference, rounded once.

    Parameters
    ----------
    patches : TensorPatches
        P polynomial patches.
    positions, normals : ndarray, shape (P, Ru+1, Rv+1, 3)
        Where to write to; `normals` is None where none are wanted.
    """
    p, q = patches.degree
    dtype: Real = positions.dtype.type
    size, end = (p + 1) * (q + 1), (p + 1) * (q + 1) + p * (q + 1)
    each = (resolution[0] + 1) * (resolution[1] + 1)
    steps, means = _operators(p, q)
    basis = sampled_partials((p, q), resolution, dtype)
    least = TRUSTED[dtype] ** 2
    doubtful: list[NDArray[np.intp]] = []
    # Sixteen numbers are a cache line: every plane of a chunk begins at one.
    chunk = max(16, CHUNK_SAMPLES // each // 16 * 16)
    for first in range(0, patches.count, chunk):
        checkpoint()
        points = patches.points[first : first + chunk]
        count = len(points)
        planes = points.reshape(count, size, 3).transpose(2, 0, 1).reshape(-1, size)
        nets = planes @ steps
        if origin is not None and is_moved(origin):
            nets.reshape(3, count, -1)[:, :, :size] -= origin[:, np.newaxis, np.newaxis]
        rounded = nets.astype(dtype)
        at, du, dv = scratch("partials", (3, 3, count, each), dtype)
        np.matmul(rounded[:, :size], basis[:size], out=at.reshape(-1, each))
        shape = (count, each, 3)
        out = positions[first : first + chunk].reshape(shape)
        np.positive(at, out=out.transpose(2, 0, 1))
        if normals is None:
            continue
        np.matmul(rounded[:, size:end], basis[size:end], out=du.reshape(-1, each))
        np.matmul(rounded[:, end:], basis[end:], out=dv.reshape(-1, each))
        # S is not needed any more: its memory takes the vectors, so that a chunk stays small.
        square, term = scratch("square", (2, count, each), dtype)
        _cross(du, dv, at, term)
        squares = np.multiply(at, at, out=du)
        np.add(squares[0], squares[1], out=square)
        np.add(square, squares[2], out=square)
        # The mean squares of the differences of each patch, along u and along v.
        differences = nets[:, size:]
        differences *= differences
        sizes = np.add.reduce((differences @ means).reshape(3, count, 2))
        trust = np.maximum(least * sizes[:, 0] * sizes[:, 1], SUBNORMAL[dtype])
        short = square <= trust.astype(dtype)[:, np.newaxis]
        if np.count_nonzero(short):
            square[short] = np.nan
            doubtful.append(short.reshape(-1).nonzero()[0] + first * each)
        np.sqrt(square, out=square)
        out = normals[first : first + chunk].reshape(shape)
        np.divide(at, square, out=out.transpose(2, 0, 1))
    return doubtful


def _cross(a: RealArray, b: RealArray, out: RealArray, term: RealArray) -> None:
    """Planes (3, …) of a × b; `term` is memory for one plane."""
    for i, j, plane in ((1, 2, out[0]), (2, 0, out[1]), (0, 1, out[2])):
        np.multiply(a[i], b[j], out=plane)
        np.multiply(a[j], b[i], out=term)
        np.subtract(plane, term, out=plane)


@lru_cache(64)
def _operators(p: int, q: int) -> tuple[FloatArray, FloatArray]:
    """What nets are multiplied by, and the squares of their differences.

    The columns of the first are those of 1, then differences along u, then those along v. The
    second has a column for the mean along u, and one for that along v.
    """
    rows, columns = np.eye(p + 1), np.eye(q + 1)
    along_u, along_v = np.diff(rows, axis=0), np.diff(columns, axis=0)
    kinds = [np.kron(*pair).T for pair in ((rows, columns), (along_u, columns), (rows, along_v))]
    means = np.zeros((kinds[1].shape[1] + kinds[2].shape[1], 2))
    for column, part in enumerate((slice(0, p * (q + 1)), slice(p * (q + 1), None))):
        means[part, column] = 1 / len(means[part])
    return np.concatenate(kinds, axis=1), means
