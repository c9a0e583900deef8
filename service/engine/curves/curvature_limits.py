"""Curvature and torsion where the derivative of a curve vanishes: limits, from power series.

Let C(t + s) = C(t) + s^m (…) be the expansion, and C' = s^(m−1) V(s) with V(0) ≠ 0. The factor
s^(m−1) only changes the speed, so

    κ = |V × V'| / (s^(m−1) |V|³),  τ = (V × V') · V'' / (s^(m−1) |V × V'|²)

    V × V' = Σ_r s^r Σ_{i<j, i+j=r+1} (j − i) V_i × V_j
    (V × V') · V'' = Σ_q s^q Σ_{i<j<k, i+j+k=q+3} (j − i)(k − i)(k − j) (V_i × V_j) · V_k

A quotient of lowest terms is the limit: finite if the power of s in the denominator is not higher.
"""

from collections.abc import Iterator
from math import comb

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.cancellation import checkpoint
from service.engine.curves.evaluation import LocalPieces, evaluate_nets
from service.engine.vectors import cross, dot, length
from service.surface.curve_model import to_space

EXTRA_TERMS = 8
"""The terms of a rational series beyond twice the degree: torsions need some more."""

MAX_TORSION_ORDER = 20
"""The highest power q for which the torsion is found; where it is higher, there is no answer."""


def find_limits(local: LocalPieces, piece: Ints, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Curvature and torsion (m,) at parameters t (m,) of pieces (m,), in the scale of `local`.

    They are limits from the right; at t = 1 from the left. NaN where there is no finite limit.
    """
    is_end = t == 1.0
    points = to_space(local.points[piece])
    points[is_end] = points[is_end, ::-1]  # the end is the beginning of the reversed piece
    weights = np.ones(points.shape[:2]) if local.weights is None else local.weights[piece]
    weights = np.where(is_end[:, np.newaxis], weights[:, ::-1], weights)
    start = np.where(is_end, 0.0, t)
    terms, noise = _expand(points, weights, start, local.zero_limit[piece])
    is_above = length(terms, -1) > noise
    is_above[0] = False
    lowest = np.where(is_above.any(axis=0), is_above.argmax(axis=0), 0)
    curvature, torsion = np.full(len(t), np.nan), np.full(len(t), np.nan)
    for m in np.unique(lowest[lowest > 0]).tolist():
        checkpoint()
        rows = np.flatnonzero(lowest == m)
        order = np.arange(m, len(terms))
        series = order[:, np.newaxis, np.newaxis] * terms[m:, rows]
        errors = order[:, np.newaxis] * noise[m:, rows]
        turns = np.full(len(rows), -1)  # the lowest power r of V × V', or −1
        bends: list[FloatArray] = []
        for r in range(max(m, MAX_TORSION_ORDER // 2)):
            bend, error = _cross_term(series, errors, r)
            bends.append(bend)
            turns[(turns < 0) & (length(bend, -1) > error)] = r
        speed = length(series[0], -1)
        # The curvature in a plane has a sign, which is the other one in the reversed direction.
        bend = bends[m - 1]
        size = length(bend, -1)
        if local.dimension == 2:
            size = np.where(is_end[rows], -bend[:, 2], bend[:, 2])
        is_finite = (turns < 0) | (turns >= m - 1)
        curvature[rows[is_finite]] = (size / speed**3)[is_finite]
        for r in np.unique(turns[turns >= 0]).tolist():
            chosen = np.flatnonzero(turns == r)
            torsion[rows[chosen]] = _find_torsion(
                series[:, chosen], errors[:, chosen], bends[r][chosen], 2 * r + m - 1
            )
    return curvature, torsion


def _expand(
    points: FloatArray, weights: FloatArray, start: FloatArray, zero_limit: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The terms of C(start + s) − C(start), (K, m, 3), and what rounding may change, (K, m).

    The series of X and of w are divided; `zero_limit` (m,) is the error of a first difference, and
    each difference doubles it.
    """
    degree = points.shape[1] - 1
    centre = evaluate_nets(points, weights, bernstein(degree, start))
    net = weights[:, :, np.newaxis] * (points - centre[:, np.newaxis])
    net = np.concatenate([net, weights[:, :, np.newaxis]], axis=2)
    count = 2 * degree + EXTRA_TERMS + 1
    homogeneous = np.zeros((count, len(start), 4))
    errors = np.zeros((count, len(start)))
    for k in range(degree + 1):
        basis = bernstein(degree - k, start)[:, :, np.newaxis]
        homogeneous[k] = comb(degree, k) * dot(basis, np.diff(net, k, axis=1))
        errors[k] = comb(degree, k) * 2.0 ** (k - 1) * zero_limit
    weight = homogeneous[..., 3]
    terms, noise = np.zeros((count, len(start), 3)), np.zeros((count, len(start)))
    for k in range(1, count):
        below = min(k, degree + 1)
        value, error = homogeneous[k, :, :3].copy(), errors[k].copy()
        for j in range(1, below):
            value -= weight[j, :, np.newaxis] * terms[k - j]
            error += np.abs(weight[j]) * noise[k - j] + errors[j] * length(terms[k - j], -1)
        terms[k], noise[k] = value / weight[0, :, np.newaxis], error / weight[0]
    return terms, noise


def _cross_term(series: FloatArray, errors: FloatArray, r: int) -> tuple[FloatArray, FloatArray]:
    """The coefficient of s^r in V × V', (m, 3), and what rounding may change in it, (m,)."""
    bend, error = np.zeros(series.shape[1:]), np.zeros(series.shape[1])
    for i in range(r // 2 + 1):
        j = r + 1 - i
        if j < len(series):
            bend += (j - i) * cross(series[i], series[j], -1)
            error += (j - i) * (
                (length(series[i], -1) + errors[i]) * errors[j] + errors[i] * length(series[j], -1)
            )
    return bend, error


def _find_torsion(
    series: FloatArray, errors: FloatArray, bend: FloatArray, power: int
) -> FloatArray:
    """The torsion (m,) where V × V' has the lowest term `bend` (m, 3), and s the power q there."""
    if power > MAX_TORSION_ORDER or power + 2 >= len(series):
        return np.full(len(bend), np.nan)
    is_infinite = np.zeros(len(bend), bool)
    value = np.zeros(len(bend))
    lengths = length(series, -1)
    for q in range(power + 1):
        value, error = np.zeros(len(bend)), np.zeros(len(bend))
        for i, j, k in _list_triples(q + 3):
            factor = (j - i) * (k - i) * (k - j)
            value += factor * dot(cross(series[i], series[j], -1), series[k], -1)
            error += factor * (
                (lengths[i] + errors[i]) * (lengths[j] + errors[j]) * (lengths[k] + errors[k])
                - lengths[i] * lengths[j] * lengths[k]
            )
        if q < power:
            is_infinite |= np.abs(value) > error
    return np.where(is_infinite, np.nan, value / dot(bend, bend, -1))


def _list_triples(total: int) -> Iterator[tuple[int, int, int]]:
    """All i < j < k, none negative, with this sum."""
    for i in range(total // 3):
        for j in range(i + 1, total):
            k = total - i - j
            if k <= j:
                break
            yield i, j, k
