"""Homogeneous coordinates, and affine combinations of control points.

Every conversion of a control net consists of such combinations.
"""

from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints


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


WeightedPoints: TypeAlias = tuple[FloatArray, FloatArray | None]
"""Points, and their weights if they have any."""


def combine(
    points: FloatArray, weights: FloatArray | None, index: Ints, shares: FloatArray
) -> WeightedPoints:
    """Weighted means Q_j of rows of control points, and the weights v_j of these means.

        v_j = Σ_k s_kj w_{i(k, j)},   Q_j = Σ_k (s_kj w_{i(k, j)} / v_j) P_{i(k, j)}

    Shares are not negative, and the shares of each mean add up to one. Each coordinate of a mean is
    clipped to the range of this coordinate in the points P_{i(k, j)}, because rounding may move the
    mean out of this range. Hence the mean of equal points is that point, bit for bit, and if all
    points have the same x (or y, or z), the mean has this x, too. The terms are added in the order
    of k, so the mean of two points (K = 2) is the same, bit for bit, if they are exchanged together
    with their shares.

    Parameters
    ----------
    points : ndarray of float64, shape (n, …, d)
    weights : ndarray of float64, shape (n, …), or None
        None if all are 1.
    index, shares : ndarray of int and of float64, shape (K, m)
        Row i(k, j) contributes the share s_kj to mean j.

    Returns
    -------
    points : ndarray of float64, shape (m, …, d)
    weights : ndarray of float64, shape (m, …), or None
    """
    # A point with share 0 must not widen the range: replace it by the point with the largest share.
    largest_rows = index[shares.argmax(axis=0), np.arange(index.shape[1])]
    index = np.where(shares == 0, largest_rows, index)
    # `share[axes]` broadcasts over the axes of the points between the first and the last.
    axes = (slice(None),) + (np.newaxis,) * (points.ndim - 2)
    total = None
    if weights is not None:
        total = np.zeros((index.shape[1], *weights.shape[1:]))
        for rows, share in zip(index, shares, strict=True):
            total += share[axes] * weights[rows]
    mean = np.zeros((index.shape[1], *points.shape[1:]))
    low = high = points[largest_rows]
    for rows, share in zip(index, shares, strict=True):
        factor = share[axes]
        if weights is not None and total is not None:
            factor = factor * weights[rows] / total
        term_points = points[rows]
        mean += factor[..., np.newaxis] * term_points
        low, high = np.minimum(low, term_points), np.maximum(high, term_points)
    return np.clip(mean, low, high), total


def combine_run(
    points: FloatArray, weights: FloatArray | None, first: Ints, shares: FloatArray
) -> WeightedPoints:
    """Weighted means of k consecutive control points: r means for each of g runs of points.

    Means are computed relative to the middle point M, as M + Σ c_i w_i (P_i − M) / Σ c_i w_i. If k
    is even, M is the mean of the two middle points. The terms are added in pairs, the two outermost
    points first. So reversed points and shares give the same sum, bit for bit.

    Parameters
    ----------
    points : ndarray of float64, shape (n, …, d)
    weights : ndarray of float64, shape (n, …), or None
        None if all are 1.
    first : ndarray of int, shape (g,)
        The row of the first control point of each run.
    shares : ndarray of float64, shape (g, r, k)
        The factors c_i; the factors of each mean add up to one.

    Returns
    -------
    points : ndarray of float64, shape (g, r, …, d)
    weights : ndarray of float64, shape (g, r, …), or None
    """
    count = shares.shape[-1]
    middle = points.take(first + (count - 1) // 2, axis=0)
    if count % 2 == 0:
        middle += points.take(first + count // 2, axis=0)
        middle /= 2
    mean = np.zeros(shares.shape[:2] + points.shape[1:])
    weight = None if weights is None else np.zeros(shares.shape[:2] + weights.shape[1:])
    for i in range((count + 1 if weights is not None else count) // 2):
        # If k is odd, the middle point is M: P_i − M is 0, and only its weight is added.
        pair = (i, count - 1 - i) if i < count - 1 - i else (i,)
        # The factors c_i of the two points, or c_i w_i, with axes that broadcast over (g, r, …, d).
        pair_shares = [_append_axes(shares[..., j], points.ndim - 1) for j in pair]
        if weights is not None and weight is not None:
            pair_shares = [
                _append_axes(shares[..., j], weights.ndim - 1)
                * weights.take(first + j, axis=0)[:, np.newaxis]
                for j in pair
            ]
            weight += pair_shares[0] + pair_shares[1] if len(pair) == 2 else pair_shares[0]
            pair_shares = [share[..., np.newaxis] for share in pair_shares]
        if len(pair) == 2:
            low_term, high_term = (
                _weigh_differences(points, first + j, middle, share)
                for share, j in zip(pair_shares, pair, strict=True)
            )
            low_term += high_term
            mean += low_term
    # So far `mean` has the sums of c_i w_i (P_i − M).
    if weight is not None:
        mean /= weight[..., np.newaxis]
    mean += middle[:, np.newaxis]
    return mean, weight


def _weigh_differences(
    points: FloatArray, rows: Ints, middle: FloatArray, share: FloatArray
) -> FloatArray:
    """Shares (g, r, …) times the differences of `points[rows]` from the middle points (g, …)."""
    difference = points.take(rows, axis=0)
    difference -= middle
    return share * difference[:, np.newaxis]


def _append_axes(shares: FloatArray, count: int) -> FloatArray:
    """The shares with `count` axes of length 1 at the end, so that they broadcast over arrays."""
    return shares.reshape(shares.shape + (1,) * count)
