"""Homogeneous coordinates: points multiplied by their weights."""

import numpy as np

from service.bases.arrays import FloatArray


def to_homogeneous(points: FloatArray, weights: FloatArray | None) -> FloatArray:
    """The homogeneous coordinates (w x, w y, w z, w) of points.

    Parameters
    ----------
    points : ndarray of float64, shape (…, 3)
    weights : ndarray of float64, shape (…), or None
        None if all are 1.

    Returns
    -------
    ndarray of float64, shape (…, 4); without weights the points themselves, shape (…, 3)
    """
    if weights is None:
        return points
    columns = weights[..., np.newaxis]
    return np.concatenate([points * columns, columns], axis=-1)
