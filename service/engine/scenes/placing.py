"""The effect of placements L x + t on distances: bounds of the scaling and of rounding errors."""

from math import hypot

import numpy as np

from service.bases.arrays import FloatArray

SINGULAR_VALUE_ERROR = 2.0**-44
"""Bound of the error of a computed singular value of a 3 × 3 matrix, relative to the largest one.
The algorithm is backward stable: the error is a few units in the last place of the largest singular
value, hundreds of times smaller than this bound."""

COPY_ERROR = 2.0**-36
"""Bound of the error of the positions of copies, as a share of the size of the placed model. If
this service multiplies the vertices, the error of L x is at most 2^-50 |L| |x|. If a node of the
file has a rotation and scalings, the error is some 1e-12, because columns count as perpendicular,
and scalings as 1, up to 1e-12."""

TRANSLATION_ERROR = 2.0**-50
"""Bound of the rounding error of adding the translation, as a share of its length."""


def scalings(matrix: FloatArray | None) -> tuple[float, float]:
    """Bounds (s, S) of the scaling of lengths: s |x − y| ≤ |L x − L y| ≤ S |x − y|."""
    if matrix is None:
        return 1.0, 1.0
    max_scaling, _, min_scaling = np.linalg.svd(matrix[:3, :3], compute_uv=False).tolist()
    slack = SINGULAR_VALUE_ERROR * max_scaling
    return max(min_scaling - slack, 0.0), max_scaling + slack


def bound_placing_error(matrix: FloatArray | None, low: FloatArray, high: FloatArray) -> float:
    """Bound of the distance between the computed and the exact copy of a point within bounds."""
    if matrix is None:
        return 0.0
    distance = hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())
    shift = hypot(*matrix[:3, 3].tolist())
    return COPY_ERROR * scalings(matrix)[1] * distance + TRANSLATION_ERROR * shift
