"""Homogeneous coordinates: points multiplied by their weights."""

import numpy as np

from service.bases.arrays import FloatArray


def to_homogeneous(points: FloatArray, weights: FloatArray | None) -> FloatArray:
    """(w x, w y, w z, w) of points (…, 3) and weights (…); without weights, the points."""
    if weights is None:
        return points
    columns = weights[..., np.newaxis]
    return np.concatenate([points * columns, columns], axis=-1)
