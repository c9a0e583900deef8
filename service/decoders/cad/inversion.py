"""Parameters of points on curves.

The nearest point of a spline is searched among samples of all spans, and then by Newton's method
between them.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.decoders.cad.content import Curve
from service.decoders.cad.newton import SplineRows, search_intervals
from service.decoders.cad.splines import (
    evaluate,
)

MORE_SAMPLES = 5
"""Samples of each span in addition to two for each degree."""

LEAST_SAMPLES, MANY_SAMPLES = 4, 2000
"""The fewest samples of each span, and how many samples a curve may have unless it has many
spans."""

CHUNK = 1 << 20
"""The most numbers of control points that are evaluated at once."""

LONGER = 1.5
"""A curve between two neighbouring samples is longer than its chord by at most this factor, unless
its weights differ by powers of ten."""

PARTS = 6
"""The parts into which these intervals are divided."""

MOST_INTERVALS = 24
"""The most intervals between samples that are searched for one point."""

ON_CURVE = 1e-9
"""Points that are this near, as a share of the curve's size, are on it."""


def find_parameters(curve: Curve, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The parameters (k,) of the nearest points of a curve to points (k, D), and the distances.

    Between two samples A and B the curve is not nearer to P than (|PA| + |PB| − ℓ) / 2, where ℓ is
    its length there, which is estimated from the chord. Intervals that may have nearer points than
    all samples are sampled once more, and then searched. For a point on the curve the intervals
    beside the nearest sample are enough.
    """
    samples, sampled, on_curve, spline = _sample(curve)
    found = []
    for point, goal in zip(points, points.tolist(), strict=True):
        away = measure_lengths(sampled - point)
        best = int(away.argmin())
        near = samples[max(best - 1, 0) : best + 2].tolist()
        nearest = samples.item(best), away.item(best)
        if nearest[1] > 0.0:
            nearest = search_intervals(spline, goal, pairwise(near), nearest)
        if nearest[1] > on_curve:
            chosen = _choose_intervals(sampled[:-1], sampled[1:], point)
            ends = _divide(curve, samples[chosen], samples[chosen + 1], point)
            nearest = search_intervals(spline, goal, ends, nearest)
        found.append(nearest)
    parameters, distances = np.array(found).reshape(-1, 2).T
    return parameters, distances


@lru_cache(maxsize=8)
def _sample(curve: Curve) -> tuple[FloatArray, FloatArray, float, SplineRows]:
    """Samples of a curve for the search of nearest points, taken once for many edges.

    Returns
    -------
    samples : ndarray of float64, shape (m,)
        Parameters in all spans and at their ends. Long curves have fewer samples in each span,
        which is a smaller part of them.
    sampled : ndarray of float64, shape (m, D)
        The points there.
    on_curve : float
        The distance below which points are on the curve.
    spline : SplineRows
    """
    breaks = np.unique(curve.knots)
    spans = len(breaks) - 1
    count = min(2 * curve.degree + MORE_SAMPLES, max(LEAST_SAMPLES, MANY_SAMPLES // spans))
    steps = np.diff(breaks)[:, np.newaxis] * (np.arange(count) / count)
    samples = np.append((breaks[:-1, np.newaxis] + steps).ravel(), breaks[-1])
    # Each sample takes p + 1 control points.
    chunk = max(1, CHUNK // len(curve.points[0]) // (curve.degree + 1))
    chunks = [evaluate(curve, samples[k : k + chunk]) for k in range(0, len(samples), chunk)]
    sampled = np.concatenate(chunks)
    on_curve = ON_CURVE * float(np.ptp(sampled, axis=0).max())
    spline = SplineRows(curve.degree, curve.knots.tolist(), curve.points.tolist())
    return samples, sampled, on_curve, spline


def _divide(
    curve: Curve, low: FloatArray, high: FloatArray, point: FloatArray
) -> list[tuple[float, float]]:
    """Parts of intervals (m,) of a curve that may have its nearest point."""
    samples = low[:, np.newaxis] + (high - low)[:, np.newaxis] * (np.arange(PARTS + 1) / PARTS)
    samples[:, -1] = high
    near = evaluate(curve, samples.ravel()).reshape(*samples.shape, -1)
    dimension = near.shape[-1]
    begins, ends = near[:, :-1].reshape(-1, dimension), near[:, 1:].reshape(-1, dimension)
    chosen = _choose_intervals(begins, ends, point)
    pairs = np.stack([samples[:, :-1].ravel()[chosen], samples[:, 1:].ravel()[chosen]], axis=1)
    return [(first, last) for first, last in pairs.tolist()]


def _choose_intervals(begins: FloatArray, ends: FloatArray, point: FloatArray) -> Ints:
    """Intervals (m,) of a curve, given by their ends, that may have its nearest point."""
    first, last = measure_lengths(begins - point), measure_lengths(ends - point)
    least = (first + last - LONGER * measure_lengths(ends - begins)) / 2
    chosen = np.flatnonzero(least <= np.minimum(first, last).min())
    if len(chosen) > MOST_INTERVALS:
        chosen = chosen[np.argpartition(least[chosen], MOST_INTERVALS)[:MOST_INTERVALS]]
    return chosen


def measure_lengths(vectors: FloatArray) -> FloatArray:
    """Lengths of vectors (…, D)."""
    lengths: FloatArray = np.sqrt(np.square(vectors).sum(axis=-1))
    return lengths
