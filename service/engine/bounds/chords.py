"""Bounds of the distance from a Bézier curve to a chord, by its control points.

    d(C(t)) ≤ f max_{0<i<n} d(P_i) + max(d(P_0), d(P_n))
    f = s W / (s W + (1 − s) w),   s = 1 − 2^{1−n}

with d the distance to a segment, W the greatest weight of the inner points and w the lesser weight
of the two ends; f = s without weights. Nets are (M, n+1, d), or (w x …, w) of shape (M, n+1, d+1).
The bits of the numbers of a curve do not depend on other curves.

Proof in docs/proofs.md: "Curves and chords".
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.vectors import dot, length, project


def bound_chord_deviations(nets: FloatArray, chords: FloatArray) -> FloatArray:
    """Bounds of the distances from curves to their chords.

    Parameters
    ----------
    nets : ndarray of float64, shape (M, n+1, d) or (M, n+1, d+1) if homogeneous
    chords : ndarray of float64, shape (M, 2, d)

    Returns
    -------
    ndarray of float64, shape (M,)
    """
    weights = nets[..., -1] if nets.shape[-1] > chords.shape[-1] else None
    return bound_from_distances(
        measure_distances(project(nets, -1, chords.shape[-1]), chords), weights
    )


def bound_from_distances(distance: FloatArray, weights: FloatArray | None) -> FloatArray:
    """Bounds (M,) of d(C), given distances d(P_i) and weights of shape (M, n+1)."""
    ends = np.maximum(distance[:, 0], distance[:, -1])
    if distance.shape[1] == 2:
        return ends
    least = 0.5 ** (distance.shape[1] - 2)  # of B_0 + B_n
    inner, outer = np.full(len(distance), 1.0 - least), np.full(len(distance), least)
    if weights is not None:
        inner *= find_row_maxima(weights[:, 1:-1])
        outer *= np.minimum(weights[:, 0], weights[:, -1])
    bound: FloatArray = inner / (inner + outer) * find_row_maxima(distance[:, 1:-1]) + ends
    return bound


def measure_distances(points: FloatArray, chords: FloatArray) -> FloatArray:
    """Distances of points (M, m, d) to segments (M, 2, d): shape (M, m)."""
    differences, along = points - chords[:, :1], chords[:, 1] - chords[:, 0]
    # In units of the largest coordinate, so that squares of small ones do not underflow.
    sizes = np.abs(np.concatenate([differences, along[:, None]], axis=1))
    size = find_row_maxima(find_row_maxima(sizes))
    unit = np.where(size > 0, size, 1.0)
    differences /= unit[:, None, None]
    along /= unit[:, None]
    squared = dot(along, along, -1)
    # The parameter in [0, 1] of the nearest point of the segment, and the vector from it.
    foot = dot(differences, along[:, None], -1)
    foot /= np.where(squared > 0, squared, 1.0)[:, None]
    np.clip(foot, 0.0, 1.0, out=foot)
    return unit[:, None] * length(differences - foot[..., None] * along[:, None], -1)


def find_row_maxima(values: FloatArray) -> FloatArray:
    """Largest numbers (M, …) of rows (M, m, …); column by column, which is faster if m is small."""
    maxima = values[:, 0].copy()
    for k in range(1, values.shape[1]):
        np.maximum(maxima, values[:, k], out=maxima)
    return maxima
