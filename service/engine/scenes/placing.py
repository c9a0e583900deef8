"""The effect of placements on distances: bounds of the scaling and of rounding errors."""

from math import hypot

import numpy as np

from service.bases.arrays import FloatArray

SINGULAR = 2.0**-44
"""Bound of the relative error of a computed singular value of a 3 × 3 matrix. The algorithm is
backward stable, with an error of some units in the last place of the largest; the bound is hundreds
of times larger."""

PLACED = 2.0**-36
"""Bound of the error of the positions of copies, as a share of the size of the model. If vertices
are multiplied, the error of L x is at most 2^-50 |L| |x|. If a node has a rotation and scalings, it
is at most 1.5e-11: columns count as perpendicular, and scalings as 1, up to 1e-12."""

EPS = float(np.finfo(np.float64).eps)

MOVED = 2.0**-50
"""Rounding of the addition of the translation: 2 units in the last place."""

SINGLE = np.finfo(np.float32)


def scalings(matrix: FloatArray | None) -> tuple[float, float]:
    """Bounds (s, S) of the scaling of lengths: s |x − y| ≤ |L x − L y| ≤ S |x − y|."""
    if matrix is None:
        return 1.0, 1.0
    most, _, least = np.linalg.svd(matrix[:3, :3], compute_uv=False).tolist()
    slack = SINGULAR * most
    return max(least - slack, 0.0), most + slack


def bound_placing_error(matrix: FloatArray | None, low: FloatArray, high: FloatArray) -> float:
    """Bound of the distance of the copy of a point within these bounds from its exact place."""
    if matrix is None:
        return 0.0
    reach = hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())
    shift = hypot(*matrix[:3, 3].tolist())
    return PLACED * scalings(matrix)[1] * reach + MOVED * shift


def bound_single_error(low: FloatArray, high: FloatArray, origin: FloatArray) -> float:
    """Bound of the rounding of a point within these bounds to float32 about an origin.

    It is half a unit in the last place of each coordinate, |x| 2^-24. The subtraction and the
    addition of the origin are in float64, with errors of at most |x| 2^-53 each.
    """
    near = np.maximum(np.abs(low - origin), np.abs(high - origin))
    each = near * float(SINGLE.eps) / 2 + float(SINGLE.smallest_subnormal)
    if origin.any():
        each = each + (np.maximum(np.abs(low), np.abs(high)) + np.abs(origin)) * 2.0**-52
    return hypot(*each.tolist()) * (1 + 2.0**-40)
