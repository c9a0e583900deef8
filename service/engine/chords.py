"""How far a Bézier curve is from a chord: the bound, and the halves on which it is better.

A point of a Bézier curve is a mean of its control points, Σ_i R_i P_i, also of a rational one with
positive weights. The distance to a segment is a convex function d, so

    d(C(t)) ≤ Σ_i R_i(t) d(P_i) ≤ f max_{0<i<n} d(P_i) + max(d(P_0), d(P_n)),

where f bounds R_1 + … + R_{n−1}: polynomial, 1 − B_0 − B_n ≤ 1 − 2^{1−n}. That is ½ at degree 2 and
¾ at degree 3, so that the bound is what an arch really rises to.

Nets are (M, n+1, d), or (w x …, w) of shape (M, n+1, d+1). Every number depends on its own curve
alone, to the last bit, whatever others are computed with it.
"""

import numpy as np

from service.bases.arrays import FloatArray


def deviations(nets: FloatArray, chords: FloatArray) -> FloatArray:
    """How far each curve may be from its chord, by the bound above.

    Parameters
    ----------
    nets : ndarray of float64, shape (M, n+1, d) or (M, n+1, d+1) if homogeneous
    chords : ndarray of float64, shape (M, 2, d)

    Returns
    -------
    ndarray of float64, shape (M,)
    """
    distance = distances(projected(nets, chords.shape[-1]), chords)
    ends = np.maximum(distance[:, 0], distance[:, -1])
    if nets.shape[1] == 2:
        return ends
    least = 0.5 ** (nets.shape[1] - 2)  # of B_0 + B_n
    inner, outer = np.full(len(nets), 1.0 - least), np.full(len(nets), least)
    if nets.shape[-1] > chords.shape[-1]:
        inner *= nets[:, 1:-1, -1].max(axis=1)
        outer *= nets[:, [0, -1], -1].min(axis=1)
    bound: FloatArray = inner / (inner + outer) * distance[:, 1:-1].max(axis=1) + ends
    return bound


def distances(points: FloatArray, chords: FloatArray) -> FloatArray:
    """Distances of points (M, m, d) to segments (M, 2, d): shape (M, m)."""
    begin, along = chords[:, :1], chords[:, 1] - chords[:, 0]
    # In units of the largest coordinate, lest squares of small ones vanish.
    away = points - begin
    size = np.maximum(np.abs(away).max(axis=(1, 2)), np.abs(along).max(axis=1))
    unit = np.where(size > 0, size, 1.0)
    away, along = away / unit[:, None, None], along / unit[:, None]
    squared = (along * along).sum(axis=1)
    share = (away * along[:, None]).sum(axis=2) / np.where(squared > 0, squared, 1.0)[:, None]
    gap = away - np.clip(share, 0.0, 1.0)[..., None] * along[:, None]
    distance: FloatArray = unit[:, None] * np.sqrt((gap * gap).sum(axis=2))
    return distance


def projected(nets: FloatArray, dimension: int) -> FloatArray:
    """Points of nets that may be homogeneous."""
    return nets if nets.shape[-1] == dimension else nets[..., :-1] / nets[..., -1:]


def halves(nets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The nets of both halves, the middle point in both."""
    left, right = [nets[:, 0]], [nets[:, -1]]
    row = nets
    while row.shape[1] > 1:
        row = (row[:, :-1] + row[:, 1:]) / 2
        left.append(row[:, 0])
        right.append(row[:, -1])
    return np.stack(left, axis=1), np.stack(right[::-1], axis=1)
