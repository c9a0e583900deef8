"""Partials at the centres of nets, and bounds of third partials over the nets.

Nets have the shape (p+1, q+1, 3 or 4, K), with the K cells as last axis, because operations on long
rows take a third of the time of operations on many short rows. The parameters of a cell are a, b ∈
[−1, 1].

The third partials of a polynomial net are Bézier nets, and their longest control vector is a bound.
For a rational net X / w, with X relative to c, the point of the surface at the centre of the cell,
Leibniz' rule for X = w S gives

    |S_ij| ≤ (|X_ij| + Σ_{(k, l) ≠ 0} C(i, k) C(j, l) |w_kl| |S_{i−k, j−l}|) / min w

for one order (i, j) after another. Each |·| on the right is a maximum over a net, and |S| ≤ r, the
greatest distance of a projected control point from c.
"""

from math import comb

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein
from service.engine.vectors import dot

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
