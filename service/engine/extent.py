"""Bounds of points, the local origin for storing them, and factors that scale them."""

import numpy as np

from service.bases.arrays import FloatArray, RealArray

FOLD = 128
"""`find_extent` reduces rows with this number of points each."""

MAX_TRANSPOSED = 1 << 15
"""Up to this number of points, reducing a transposed copy is faster than reducing rows."""

MAX_DISTANCE = 256.0
"""A model further from zero than this multiple of its extent is stored about a local origin:
float32 would leave it fewer than 16 binary digits."""

UNSCALED_EXPONENT = 16
"""Models with an extent from 2^-16 to 2^16 are not scaled: fourth powers of these lengths, such as
|S_u × S_v|², are far from the limits of float32."""

AT_ZERO = np.zeros(3)
"""The origin of most meshes."""
AT_ZERO.flags.writeable = False


def is_moved(origin: FloatArray) -> bool:
    """Whether positions about this origin differ from those in model coordinates."""
    return origin is not AT_ZERO and bool(origin.any())


def find_extent(points: RealArray) -> tuple[RealArray, RealArray]:
    """Least and greatest coordinates, (d,) each, of points (N, d) with N ≥ 1, in the same dtype.

    NumPy reduces rows of three numbers one by one. It reduces the columns of a transposed copy, or
    rows of 128 points each, with vector instructions, some ten times faster.
    """
    if len(points) <= MAX_TRANSPOSED:
        columns = points.T.copy()
        return np.minimum.reduce(columns, axis=1), np.maximum.reduce(columns, axis=1)
    folded = len(points) // FOLD * FOLD
    if not points.flags.c_contiguous:
        return points.min(axis=0), points.max(axis=0)
    width = points.shape[1]
    rows = points[:folded].reshape(-1, width * FOLD)
    low = np.concatenate([rows.min(axis=0).reshape(FOLD, width), points[folded:]]).min(axis=0)
    high = np.concatenate([rows.max(axis=0).reshape(FOLD, width), points[folded:]]).max(axis=0)
    return low, high


def find_stored_bounds(
    positions: RealArray, origin: FloatArray
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Least and greatest model coordinates of positions (N, 3) that are relative to the origin."""
    x, y, z = origin.tolist()
    (a, b, c), (d, e, f) = (bound.tolist() for bound in find_extent(positions))
    return (a + x, b + y, c + z), (d + x, e + y, f + z)


def choose_origin(low: FloatArray, high: FloatArray) -> FloatArray:
    """Origin (d,) of float32 positions: zero, or the middle of these bounds if zero is far away."""
    lows, highs = low.tolist(), high.tolist()
    sizes = [above - below for below, above in zip(lows, highs, strict=True)]
    middle = [below + size / 2 for below, size in zip(lows, sizes, strict=True)]
    if max(map(abs, middle)) <= MAX_DISTANCE * max(sizes):
        return AT_ZERO if len(lows) == 3 else np.zeros(len(lows))
    # The origin is a float32 number, so that viewers that compute in float32 place it exactly.
    return np.array(middle).astype(np.float32).astype(np.float64)


def find_unit_scales(sizes: FloatArray) -> FloatArray:
    """For each size, the power of two that scales it to [0.5, 1) without rounding.

    The power is at most 2^1000: sizes below 2^-1001, also 0, stay below 0.5.
    """
    _, exponents = np.frexp(sizes)
    return np.exp2(np.minimum(-exponents.astype(np.float64), 1000.0))


def find_scale(extent: float) -> float:
    """The power of two that scales a model, so that this extent becomes 2^15 to 2^16.

    The result is 1 if the model needs no scaling, and at most 2^1000.
    """
    if 2.0**-UNSCALED_EXPONENT <= extent <= 2.0**UNSCALED_EXPONENT or extent == 0:
        return 1.0
    _, exponent = np.frexp(extent)
    return float(np.exp2(min(UNSCALED_EXPONENT - exponent, 1000)))
