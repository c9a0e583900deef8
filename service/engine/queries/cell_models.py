"""Models of second order of cells of nets, with bounds of the rest.

A cell is a rectangle of parameters of one net. In its own parameters a, b ∈ [−1, 1] the surface is

    S(a, b) = c + A a + B b + ½ (Q_aa a² + 2 Q_ab a b + Q_bb b²) + rest

with the partials at its centre. From the third partials, bounded over the cell by the hulls of
their Bézier nets, follow bounds over the whole cell:

    |S − c| ≤ r      |S_a − A| ≤ α      |S_b − B| ≤ β      |S_ij − Q_ij| ≤ τ_ij

**Third partials.** Those of a polynomial net are Bézier nets, whose largest control vector bounds
them. Of a rational net X / w with X taken about c, Leibniz' rule for X = w S gives

    |S_ij| ≤ (|X_ij| + Σ_{(k, l) ≠ 0} C(i, k) C(j, l) |w_kl| |S_{i−k, j−l}|) / min w

one after the other, where every |·| on the right is a maximum over a net; |S| ≤ r is the greatest
distance of a projected control point from c.

**Taylor.** With T_ijk the bounds of third partials, and |a|, |b| ≤ 1,

    τ_aa = T_aaa + T_aab,  τ_ab = T_aab + T_abb,  τ_bb = T_abb + T_bbb,
    α = |Q_aa| + |Q_ab| + ½ (τ_aa + τ_ab),  β = |Q_ab| + |Q_bb| + ½ (τ_ab + τ_bb)
    |rest| ≤ (T_aaa + 3 T_aab + 3 T_abb + T_bbb) / 6,  that of S_a and S_b together 3 times as much

With n the unit normal at the centre, n · S_ij is bounded in the same way: a partial along the
surface, as they are where parameters turn about a pole, says nothing about points above it.

**Rounding.** Coordinates are about 1. One halving replaces a row by averages of neighbours, n
times: an average of two is wrong by at most u times what it averages in absolute value, so a
control point after L halvings of degrees p and q is wrong by at most L (p + q) u M, where M is the
largest distance of a control point from the origin; homogeneous ones by that times their weight,
since |X| ≤ w M, hence projected ones by twice as much. ε = 4 (L + 2) (p + q + 2) u M covers this
and the sums at the centre. A partial of order i in a and j in b is a sum of control points whose
factors add up to p^i q^j in absolute value, and of rational nets k = i + j quotients are taken one
after the other: it is wrong by at most 8 p^i q^j W^k ε, where W is the ratio of weights within the
cell. All bounds are enlarged by these.
"""

from math import comb

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.queries.column_vectors import cross

UNIT = float(np.finfo(np.float64).eps) / 2

# Columns of a cell's model; vectors take three.
CENTER, RADIUS, ERROR = 0, 3, 4
TANGENT_A, TANGENT_B = 5, 8
SECOND_AA, SECOND_AB, SECOND_BB = 11, 14, 17
FORM_AA, FORM_AB, FORM_BB = 20, 21, 22
"""A · A, A · B, B · B."""
REST, REST_LIFT = 23, 24
"""How far S and n · S are from the model of second order; S_a and S_b, both together, are at most 3
REST from its partials."""
ROUND = 25
"""Rounding of products with the model's vectors, 16 u times the sum of their lengths."""
SPREAD_AA, SPREAD_AB, SPREAD_BB = 26, 27, 28
"""How far S_i · S_j − (c − S) · S_ij is from A_i · A_j within the cell."""
BEND_AA, BEND_AB, BEND_BB = 29, 30, 31
"""τ."""
SLOPE_A, SLOPE_B = 32, 33
"""Error of A and of B."""
LEAST_A, LEAST_B = 34, 35
"""Error of c times |A| and |B|."""
NORMAL = 36
"""Unit normal n at the centre; 0 where A × B vanishes."""
LIFT_AA, LIFT_AB, LIFT_BB = 39, 40, 41
"""Bounds of |n · (S_ij − Q_ij)|."""
SIZE_A, SIZE_B = 42, 43
"""The greatest length of a row of control points, along a and along b."""
STRAIN = 44
"""REST / min(|A|, |B|): large in cells that are far from flat."""
COLUMNS = 45

THIRD = ((3, 0), (2, 1), (1, 2), (0, 3))
ORDERS = tuple((i, k - i) for k in range(4) for i in range(k, -1, -1))


@np.errstate(all="ignore")
def cell_models(nets: FloatArray, depth: Ints, largest: float) -> FloatArray:
    """The models of cells, shape (COLUMNS, K).

    Parameters
    ----------
    nets : ndarray of float64, shape (K, p+1, q+1, 3 or 4)
        Over the cells.
    depth : ndarray of int, shape (K,)
        How often each was halved.
    largest : float
        M.

    Notes
    -----
    Within, cells are the last axis: operations on many short rows would take three times as long.
    """
    (p, q), rational = (nets.shape[1] - 1, nets.shape[2] - 1), nets.shape[3] == 4
    nets = np.ascontiguousarray(nets.transpose(1, 2, 3, 0))
    error = 4 * UNIT * largest * (depth + 2) * (p + q + 2)
    center, partials = _partials_at_center(nets)
    spread = np.ones(())
    points, weights = nets, None
    if rational:
        weights = nets[:, :, 3:]
        points = nets[:, :, :3] / weights
        spread = (weights.max(axis=(0, 1)) / weights.min(axis=(0, 1)))[0]
    about = points - center
    radius = np.sqrt(_squares(about).max(axis=(0, 1)))
    bounds = _bounds_of_partials(about, weights, radius)
    errors = {(i, j): 8 * error * spread ** (i + j) * float(p**i * q**j) for i, j in ORDERS}
    third = [1.0000001 * bounds[of] + errors[of] for of in THIRD]
    a, b, aa, ab, bb = (partials[of] for of in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2)))
    normal = _unit_normals(a, b)
    heights = _dot(about, normal)[:, :, np.newaxis]
    bounds = _bounds_of_partials(heights, weights, np.abs(heights).max(axis=(0, 1, 2)))
    lifts = [1.0000001 * bounds[of] + errors[of] for of in THIRD]
    slope_a, slope_b = (errors[of] + 8 * UNIT * _length(partials[of]) for of in ((1, 0), (0, 1)))
    wrong = [errors[2 - k, k] + 8 * UNIT * _length(of) for k, of in enumerate((aa, ab, bb))]
    tau = [third[k] + third[k + 1] + wrong[k] for k in range(3)]
    alpha = _length(aa) + _length(ab) + (tau[0] + tau[1]) / 2 + slope_a
    beta = _length(ab) + _length(bb) + (tau[1] + tau[2]) / 2 + slope_b
    long_a, long_b = _length(a), _length(b)
    table = np.empty((COLUMNS, nets.shape[3]))
    table[CENTER : CENTER + 3] = center
    radius += 2 * error
    table[RADIUS], table[ERROR] = radius, error
    for first, of in zip((TANGENT_A, TANGENT_B, 11, 14, 17), (a, b, aa, ab, bb), strict=True):
        table[first : first + 3] = of
    table[FORM_AA], table[FORM_AB], table[FORM_BB] = _dot(a, a), _dot(a, b), _dot(b, b)
    squares = (
        2 * long_a * alpha + alpha**2,
        long_a * beta + long_b * alpha + alpha * beta,
        2 * long_b * beta + beta**2,
    )
    for k, (square, of) in enumerate(zip(squares, (aa, ab, bb), strict=True)):
        table[SPREAD_AA + k] = 1.0000001 * (square + radius * (_length(of) + tau[k]))
        table[BEND_AA + k] = tau[k]
        table[LIFT_AA + k] = tau[k] - third[k] - third[k + 1] + lifts[k] + lifts[k + 1]
    least = 2 * error + slope_a + slope_b + wrong[0] / 2 + wrong[1] + wrong[2] / 2
    table[REST], table[REST_LIFT] = _remainder(third, least), _remainder(lifts, least)
    table[STRAIN] = table[REST] / np.minimum(long_a, long_b)
    table[ROUND] = 16 * UNIT * (long_a + long_b + _length(aa) + 2 * _length(ab) + _length(bb))
    table[NORMAL : NORMAL + 3] = normal
    table[SLOPE_A], table[SLOPE_B] = slope_a, slope_b
    table[LEAST_A], table[LEAST_B] = 2 * error * (long_a + slope_a), 2 * error * (long_b + slope_b)
    table[SIZE_A], table[SIZE_B] = (
        np.sqrt(_squares(np.diff(points, axis=k))).sum(axis=k).max(axis=0) for k in (0, 1)
    )
    if q == 0:
        # Nothing moves along b: with ½ b² added, the squared distance is least at b = 0.
        table[FORM_BB] = 1.0
        table[[SPREAD_AB, SPREAD_BB, BEND_AB, BEND_BB, SLOPE_B, LEAST_B]] = 0.0
        table[[LIFT_AB, LIFT_BB]] = 0.0
    return table


def _unit_normals(a: FloatArray, b: FloatArray) -> FloatArray:
    """A × b, of length 1, or 0 where that vanishes."""
    normal = cross(a, b)
    normal /= _length(normal)
    normal[:, ~np.isfinite(normal).all(axis=0)] = 0.0
    return normal


def _partials_at_center(nets: FloatArray) -> tuple[FloatArray, dict[tuple[int, int], FloatArray]]:
    """S (3, K) at the centres and its first and second partials in a and b, term by term."""
    x: dict[tuple[int, int], FloatArray] = {}
    p, q = nets.shape[0] - 1, nets.shape[1] - 1
    for i in range(3):
        lines = _at_middle(_differences(nets, i, 0))
        for j in range(3 - i):
            x[i, j] = _at_middle(_differences(lines, j, 0)) * (_factor(p, i) * _factor(q, j))
    if nets.shape[2] == 3:
        return x[0, 0], x
    w = x[0, 0][3]
    center = x[0, 0][:3] / w
    s = {(0, 0): center}
    for i, j in ORDERS[1:6]:
        value = x[i, j][:3].copy()
        for k in range(i + 1):
            for m in range(j + 1):
                if k or m:
                    value -= comb(i, k) * comb(j, m) * x[k, m][3] * s[i - k, j - m]
        s[i, j] = value / w
    return center, s


def _bounds_of_partials(
    about: FloatArray, weights: FloatArray | None, radius: FloatArray
) -> dict[tuple[int, int], FloatArray]:
    """Upper bounds (K,) of the lengths of the third partials over the cells."""
    p, q = about.shape[0] - 1, about.shape[1] - 1
    if weights is None:
        return {of: _largest(about, of) * _factor(p, of[0]) * _factor(q, of[1]) for of in THIRD}
    x = about * weights
    least = weights.min(axis=(0, 1, 2))
    bound = {(0, 0): radius}
    w = {of: _largest(weights, of) for of in ORDERS[1:]}
    for i, j in ORDERS[1:]:
        value = _largest(x, (i, j)) * _factor(p, i) * _factor(q, j)
        for k in range(i + 1):
            for m in range(j + 1):
                if k or m:
                    factor = comb(i, k) * comb(j, m) * _factor(p, k) * _factor(q, m)
                    value = value + factor * w[k, m] * bound[i - k, j - m]
        bound[i, j] = value / least
    return bound


def _remainder(third: list[FloatArray], least: FloatArray) -> FloatArray:
    """The rest of a model of second order: `least`, and a bound by the third partials."""
    return np.asarray(least + (third[0] + 3 * (third[1] + third[2]) + third[3]) / 6)


def _factor(degree: int, order: int) -> float:
    """The factor of differences of this order in partials: n (n − 1) … / 2^order."""
    factor = 1.0
    for k in range(order):
        factor *= max(degree - k, 0) / 2
    return factor


def _differences(nets: FloatArray, order: int, axis: int) -> FloatArray:
    """Differences along an axis; a single zero where the degree is too low."""
    for _ in range(order):
        if nets.shape[axis] == 1:
            return np.zeros_like(nets)
        nets = np.diff(nets, axis=axis)
    return nets


def _at_middle(rows: FloatArray) -> FloatArray:
    """The value at ½ along the first axis, which goes away: a sum in one order."""
    basis = bernstein(len(rows) - 1, [0.5])[0]
    value: FloatArray = basis[0] * rows[0]
    for share, row in zip(basis[1:].tolist(), rows[1:], strict=True):
        value += share * row
    return value


def _largest(nets: FloatArray, order: tuple[int, int]) -> FloatArray:
    """The greatest length of a difference of this order, (K,)."""
    for axis, times in enumerate(order):
        nets = _differences(nets, times, axis)
    return np.asarray(np.sqrt(_squares(nets).max(axis=(0, 1))))


def _squares(vectors: FloatArray) -> FloatArray:
    """|x|² of vectors (…, 3 or fewer, K)."""
    return _dot(vectors, vectors)


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """X · y of vectors (…, 3 or fewer, K)."""
    total: FloatArray = first[..., 0, :] * second[..., 0, :]
    for k in range(1, first.shape[-2]):
        total += first[..., k, :] * second[..., k, :]
    return total


def _length(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(_squares(vectors)))
