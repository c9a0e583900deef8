"""Affine combinations of control points: every conversion of a net is built from these."""

from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints

WeightedPoints: TypeAlias = tuple[FloatArray, FloatArray | None]
"""Points, and their weights if they have any."""


def combine(
    points: FloatArray, weights: FloatArray | None, index: Ints, shares: FloatArray
) -> tuple[FloatArray, FloatArray | None]:
    """Weighted means of rows of control points.

        v_j = Σ_k s_kj w_{i(k, j)},   Q_j = Σ_k (s_kj w_{i(k, j)} / v_j) P_{i(k, j)}

    Shares are not negative and add up to one over k. A mean lies between the least and the greatest
    of its terms; a mean that rounding moves outside is clipped to them. Hence the mean of equal
    points is that point, bit for bit, and points with one coordinate in common keep it. Two terms
    in exchanged order give the same bits.

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
    # A row with share 0 does not widen the bounds.
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


def combine_run(
    points: FloatArray, weights: FloatArray | None, first: Ints, shares: FloatArray
) -> WeightedPoints:
    """Combinations of k control points from `first` on, shares (g, r, k): (g, r, …).

    Points are combined relative to their middle point, M + Σ c_i w_i (P_i − M) / Σ c_i w_i. The
    terms are added in pairs from the outside in, so that reversed points give the same sum bit for
    bit.
    """
    count = shares.shape[-1]
    middle = points.take(first + (count - 1) // 2, axis=0)
    if count % 2 == 0:
        middle += points.take(first + count // 2, axis=0)
        middle /= 2
    place = np.zeros(shares.shape[:2] + points.shape[1:])
    weight = None if weights is None else np.zeros(shares.shape[:2] + weights.shape[1:])
    for low in range((count + 1 if weights is not None else count) // 2):
        # The middle point of an odd count contributes no difference from M, only its weight.
        pair = (low, count - 1 - low) if low < count - 1 - low else (low,)
        pair_shares = [_append_axes(shares[..., k], points.ndim - 1) for k in pair]
        if weights is not None and weight is not None:
            pair_shares = [
                _append_axes(shares[..., k], weights.ndim - 1)
                * weights.take(first + k, axis=0)[:, np.newaxis]
                for k in pair
            ]
            weight += sum(pair_shares[1:], pair_shares[0])
            pair_shares = [share[..., np.newaxis] for share in pair_shares]
        if len(pair) == 2:
            term, other = (
                _weigh_differences(points, first + k, middle, share)
                for share, k in zip(pair_shares, pair, strict=True)
            )
            term += other
            place += term
    if weight is not None:
        place /= weight[..., np.newaxis]
    place += middle[:, np.newaxis]
    return place, weight


def _weigh_differences(
    points: FloatArray, rows: Ints, middle: FloatArray, share: FloatArray
) -> FloatArray:
    """Shares (g, r, …) times the differences of some control points from the middles (g, …)."""
    way = points.take(rows, axis=0)
    way -= middle
    return share * way[:, np.newaxis]


def _append_axes(shares: FloatArray, axes: int) -> FloatArray:
    """The factors with further axes of length 1, to multiply arrays that have these axes."""
    return shares.reshape(shares.shape + (1,) * axes)
