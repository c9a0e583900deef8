"""New control points as weighted means of old ones: what every conversion comes down to."""

import numpy as np

from service.bases.arrays import FloatArray, Ints


def combine(
    points: FloatArray, weights: FloatArray | None, index: Ints, shares: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """Weighted means of rows of control points.

        v_j = Σ_k s_kj w_{i(k, j)},   Q_j = Σ_k (s_kj w_{i(k, j)} / v_j) P_{i(k, j)}

    Shares are not negative and add up to one over k. A mean lies between the least and the
    greatest of its terms, and it is put there when rounding leads beyond: hence the mean of equal
    points is that point, bit for bit, and what was one point, or flat, stays so. Two terms give
    the same bits in either order.

    Parameters
    ----------
    points : ndarray of float64, shape (n, …, d)
    weights : ndarray of float64, shape (n, …), or None
        None where all are one.
    index, shares : ndarray of int and of float64, shape (K, m)
        Which rows give how much.

    Returns
    -------
    points : ndarray of float64, shape (m, …, d)
    weights : ndarray of float64, shape (m, …), or None
    """
    # A row without a share has no say in what is least and greatest either.
    heaviest = index[shares.argmax(axis=0), np.arange(index.shape[1])]
    index = np.where(shares == 0, heaviest, index)
    axes = (slice(None),) + (np.newaxis,) * (points.ndim - 2)
    total = None
    if weights is not None:
        total = np.zeros((index.shape[1], *weights.shape[1:]))
        for rows, share in zip(index, shares, strict=True):
            total += share[axes] * weights[rows]
    mean = np.zeros((index.shape[1], *points.shape[1:]))
    low = high = points[heaviest]
    for rows, share in zip(index, shares, strict=True):
        part = share[axes]
        if weights is not None and total is not None:
            part = part * weights[rows] / total
        term = points[rows]
        mean += part[..., np.newaxis] * term
        low, high = np.minimum(low, term), np.maximum(high, term)
    return np.clip(mean, low, high), total
