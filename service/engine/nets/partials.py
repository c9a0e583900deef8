"""Points and partials of nets: at one point of each net, at centres of cells; bounds of the third.

`net_partials` evaluates nets at given parameters by matrix products. The other functions take nets
of cells, (p+1, q+1, 3 or 4, K), with the K cells as last axis, because operations on long rows take
a third of the time of operations on many short rows. The parameters of a cell are a, b ∈ [−1, 1].

The third partials of a polynomial net are Bézier nets, and their longest control vector is a bound.
For a rational net Leibniz' rule bounds one order after another.

Proof in docs/proofs.md: "Models of second order".
"""

from collections.abc import Sequence
from math import comb

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.engine.nets.query_nets import QueryNets
from service.engine.vectors import dot

MAX_NUMBERS = 1 << 16
"""The most numbers in the control nets of one chunk: they stay in the processor's cache."""

_PARTIAL_ORDERS = {
    1: ([0, 1, 0], [0, 0, 1]),
    2: ([0, 1, 0, 2, 1, 0], [0, 0, 1, 0, 1, 2]),
}
"""For the highest order 1 or 2: the orders in u, and the orders in v, of all partials."""


def net_partials(nets: QueryNets, net: Ints, parameters: FloatArray, order: int = 2) -> FloatArray:
    """Points S and partials S_u, S_v, S_uu, S_uv, S_vv; result k belongs to the net `net[k]`.

    Parameters
    ----------
    nets : QueryNets
    net : ndarray of int, shape (m,)
    parameters : ndarray of float64, shape (2, m)
        The parameters (u, v) in each net, from 0 to 1.
    order : int
        The highest order: 1, or 2 for second partials, too.

    Returns
    -------
    ndarray of float64, shape (6, 3, m), or (3, 3, m) for the first order

    Notes
    -----
    The rounding error of S is at most 8 (p + q + 2) u M, with the largest coordinate M and the unit
    roundoff u, because bases are sums of products that are not negative; half of this without
    weights. The error of a partial of order (i, j) is at most this times (2 p)^i (2 q)^j; for
    rational nets the ratio of weights is another factor.
    """
    partials = np.empty((len(_PARTIAL_ORDERS[order][0]), 3, len(net)))
    for group, rows in nets.split(net):
        for part in row_slices(len(rows), group.values[..., 0].size, MAX_NUMBERS):
            chunk = rows[part]
            u, v = parameters[:, chunk]
            chosen = group.nets[net[chunk] - group.first]
            partials[:, :, chunk] = evaluate_partials(chosen, u, v, order)
    return partials


def evaluate_partials(nets: FloatArray, u: FloatArray, v: FloatArray, order: int) -> FloatArray:
    """Points and partials of nets (m, p+1, q+1, 3 or 4) of one degree, each at its own u and v.

    The result is that of `net_partials`.
    """
    m, rows, columns, width = nets.shape
    basis_u, basis_v = _compute_bases((rows - 1, columns - 1), u, v, order)
    # Two matrix products for each net: with more and smaller products, the calls would take longer
    # than the arithmetic.
    lines = np.matmul(nets.reshape(m, rows, -1).transpose(0, 2, 1), basis_u.transpose(0, 2, 1))
    x = np.matmul(basis_v, lines.reshape(m, columns, -1)).reshape(m, order + 1, width, order + 1)
    # x[:, j, :, i] is the partial of order i in u and j in v. Indexed by two lists of orders, the
    # axis of the lists comes first.
    in_u, in_v = _PARTIAL_ORDERS[order]
    partials = np.ascontiguousarray(x[:, in_v, :, in_u].transpose(0, 2, 1))
    return partials if width == 3 else np.array(project_partials([*partials]))


def project_partials(partials: Sequence[FloatArray]) -> list[FloatArray]:
    """Partials of S = X/w from those of (X, w), in the order S, S_u, S_v, S_uu, S_uv, S_vv.

        S_u = (X_u − w_u S)/w,  S_uv = (X_uv − w_uv S − w_u S_v − w_v S_u)/w

    There are 1, 3 or 6 arrays, (4, …) before and (3, …) after. The coordinates should be relative
    to a point near the surface: rounding errors are then smallest.
    """
    x, w = [partial[:3] for partial in partials], [partial[3] for partial in partials]
    s = [x[0] / w[0]]
    s += [(x[k] - w[k] * s[0]) / w[0] for k in range(1, min(len(x), 3))]
    if len(x) > 3:
        s += [
            (x[3] - w[3] * s[0] - 2 * w[1] * s[1]) / w[0],
            (x[4] - w[4] * s[0] - w[1] * s[2] - w[2] * s[1]) / w[0],
            (x[5] - w[5] * s[0] - 2 * w[2] * s[2]) / w[0],
        ]
    return s


def _compute_bases(
    degrees: tuple[int, int], u: FloatArray, v: FloatArray, order: int
) -> list[FloatArray]:
    """Bernstein polynomials and their derivatives up to `order` at u and at v (m,).

    Both have the shape (m, order + 1, n+1). The recurrence of `service.bases.bernstein` runs once
    for both: its last steps are the polynomials of lower degrees, from which derivatives follow.
    """
    t = np.concatenate([u, v])
    complement = 1.0 - t
    levels = [np.ones((1, len(t)))]
    for n in range(1, max(degrees) + 1):
        level = np.empty((n + 1, len(t)))
        np.multiply(levels[-1], complement, out=level[:n])
        level[n] = 0.0
        level[1:] += levels[-1] * t
        levels.append(level)
    bases = []
    for degree, half in zip(degrees, (slice(len(u)), slice(len(u), None)), strict=True):
        basis = np.zeros((order + 1, degree + 1, len(u)))
        basis[0] = levels[degree][:, half]
        if degree > 0:
            lower_basis = degree * levels[degree - 1][:, half]
            basis[1, 1:] = lower_basis
            basis[1, :-1] -= lower_basis
        if degree > 1 and order > 1:
            lower_basis = degree * (degree - 1) * levels[degree - 2][:, half]
            basis[2, 2:] = lower_basis
            basis[2, 1:-1] -= 2 * lower_basis
            basis[2, :-2] += lower_basis
        bases.append(np.ascontiguousarray(basis.transpose(2, 0, 1)))
    return bases


THIRD = ((3, 0), (2, 1), (1, 2), (0, 3))
"""The orders (i, j) in a and b of the third partials."""

ORDERS = tuple((i, k - i) for k in range(4) for i in range(k, -1, -1))
"""The orders of the net itself and of all partials up to the third, lower orders first."""


def partials_at_center(nets: FloatArray) -> tuple[FloatArray, dict[tuple[int, int], FloatArray]]:
    """S (3, K) at the centres of cells, and its first and second partials in a and b, by order.

    Terms are added in a fixed order, so that a net has the same result at every position of a
    batch.
    """
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
    for i, j in ORDERS[1:6]:  # first and second partials
        value = x[i, j][:3].copy()
        for k in range(i + 1):
            for m in range(j + 1):
                if k or m:
                    value -= comb(i, k) * comb(j, m) * x[k, m][3] * s[i - k, j - m]
        s[i, j] = value / w
    return center, s


def bounds_of_partials(
    points_about_centers: FloatArray, weights: FloatArray | None, radius: FloatArray
) -> dict[tuple[int, int], FloatArray]:
    """Upper bounds (K,) of the lengths of the third partials over the cells, by order.

    `points_about_centers` are the projected control points relative to the centres, and `radius`
    (K,) are their greatest lengths. For rational nets, lower orders are in the result, too.
    """
    p, q = points_about_centers.shape[0] - 1, points_about_centers.shape[1] - 1
    if weights is None:
        return {
            order: _largest(points_about_centers, order)
            * _factor(p, order[0])
            * _factor(q, order[1])
            for order in THIRD
        }
    x = points_about_centers * weights
    min_weights = weights.min(axis=(0, 1, 2))
    bound = {(0, 0): radius}
    w = {order: _largest(weights, order) for order in ORDERS[1:]}
    for i, j in ORDERS[1:]:
        value = _largest(x, (i, j)) * _factor(p, i) * _factor(q, j)
        for k in range(i + 1):
            for m in range(j + 1):
                if k or m:
                    factor = comb(i, k) * comb(j, m) * _factor(p, k) * _factor(q, m)
                    value = value + factor * w[k, m] * bound[i - k, j - m]
        bound[i, j] = value / min_weights
    return bound


def _factor(degree: int, order: int) -> float:
    """The factor from differences to partials of an order: n (n − 1) … / 2^order.

    The divisor is 2 because a and b run over the length 2, from −1 to 1.
    """
    factor = 1.0
    for k in range(order):
        factor *= max(degree - k, 0) / 2
    return factor


def _differences(nets: FloatArray, order: int, axis: int) -> FloatArray:
    """Differences of an order along an axis; a single zero if the degree is too low."""
    for _ in range(order):
        if nets.shape[axis] == 1:
            return np.zeros_like(nets)
        nets = nets[1:] - nets[:-1] if axis == 0 else nets[:, 1:] - nets[:, :-1]
    return nets


def _at_middle(rows: FloatArray) -> FloatArray:
    """The value at ½ along the first axis, which is removed; terms are added in a fixed order."""
    basis = bernstein(len(rows) - 1, [0.5])[0]
    value: FloatArray = basis[0] * rows[0]
    for factor, row in zip(basis[1:].tolist(), rows[1:], strict=True):
        value += factor * row
    return value


def _largest(nets: FloatArray, order: tuple[int, int]) -> FloatArray:
    """The greatest length (K,) of a difference of this order in a and b."""
    for axis, times in enumerate(order):
        nets = _differences(nets, times, axis)
    return largest_length(nets)


def largest_length(vectors: FloatArray) -> FloatArray:
    """The greatest length (K,) of vectors (…, …, 3 or fewer, K)."""
    return np.asarray(np.sqrt(dot(vectors, vectors).max(axis=(0, 1))))
