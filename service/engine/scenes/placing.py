"""The effect of placements on distances: bounds of the scaling and of rounding errors."""

from math import hypot

import numpy as np

from service.bases.arrays import FloatArray

SINGULAR = 2.0**-44
"""Relative error of a computed singular value of a 3 × 3 matrix at most: the algorithm is backward
stable, some units in the last place of the largest, with a margin of hundreds."""

PLACED = 2.0**-36
"""Part of the size of a model by which its copies may stand beside their exact places. Multiplied
out, L x is right to 2^-50 of |L| |x|. As the rotation and scalings of a node it is right to
1.5e-11: columns count as perpendicular, and scalings as 1, up to 1e-12."""

EPS = float(np.finfo(np.float64).eps)

MOVED = 2.0**-50
"""Rounding of the translation, which is added once: 2 units in the last place."""

SINGLE = np.finfo(np.float32)


def scalings(matrix: FloatArray | None) -> tuple[float, float]:
    """Bounds (s, S) of what a placement does to lengths: s |x − y| ≤ |L x − L y| ≤ S |x − y|."""
    if matrix is None:
        return 1.0, 1.0
    most, _, least = np.linalg.svd(matrix[:3, :3], compute_uv=False).tolist()
    slack = SINGULAR * most
    return max(least - slack, 0.0), most + slack


def placing_error(matrix: FloatArray | None, low: FloatArray, high: FloatArray) -> float:
    """How far the copy of a point between these bounds may be from its exact place."""
    if matrix is None:
        return 0.0
    reach = hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())
    shift = hypot(*matrix[:3, 3].tolist())
    return PLACED * scalings(matrix)[1] * reach + MOVED * shift


def single_error(low: FloatArray, high: FloatArray, origin: FloatArray) -> float:
    """How far a point between these bounds may be from itself in float32 about an origin.

    Half a unit in the last place of each coordinate, |x| 2^-24; the difference and the sum with
    the origin are float64, right to |x| 2^-53 each.
    """
    near = np.maximum(np.abs(low - origin), np.abs(high - origin))
    each = near * float(SINGLE.eps) / 2 + float(SINGLE.smallest_subnormal)
    if origin.any():
        each = each + (np.maximum(np.abs(low), np.abs(high)) + np.abs(origin)) * 2.0**-52
    return hypot(*each.tolist()) * (1 + 2.0**-40)
