"""Degree elevation, splitting and restriction of Bézier control nets.

A net is a pair of points and weights (None if all are 1). All functions work along axis 0 and do
not change the other axes. Each step computes weighted means of two neighbouring rows. So no digits
are lost to cancellation, the first and the last row keep their bits, and equal rows stay equal.

Farin, Curves and Surfaces for CAGD, 5th ed., sections 5.3 and 6.1.
"""

from typing import TypeAlias

import numpy as np

from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray

Net: TypeAlias = tuple[FloatArray, FloatArray | None]
"""Points (n+1, …, d) and weights (n+1, …) or None."""


def elevate(net: Net, degree: int) -> Net:
    """The net of the same polynomials in a higher degree; each step raises the degree by one.

        P*_i = i/(n+1) P_{i−1} + (1 − i/(n+1)) P_i,   i = 0 … n+1

    Elevating the reversed net gives the reversed result, bit for bit.
    """
    points, weights = net
    for n in range(len(points) - 1, degree):
        i = np.arange(n + 2)
        index = np.stack([np.maximum(i - 1, 0), np.minimum(i, n)])
        points, weights = combine(points, weights, index, np.stack([i, n + 1 - i]) / (n + 1))
    return points, weights


def split(net: Net, t: float) -> tuple[Net, Net]:
    """The polynomials over [0, t] and over [t, 1], each with its own parameter from 0 to 1.

    This is de Casteljau's algorithm, b_i ← (1 − t) b_i + t b_{i+1}: the first points of all steps
    are the net over [0, t], and the last points of all steps are the net over [t, 1]. The last row
    of the first net equals the first row of the second, bit for bit.
    """
    points, weights = net
    first_net, second_net = [(points[0], _row(weights, 0))], [(points[-1], _row(weights, -1))]
    for n in range(len(points) - 1, 0, -1):
        i = np.arange(n)
        shares = np.repeat([[1 - t], [t]], n, axis=1)
        points, weights = combine(points, weights, np.stack([i, i + 1]), shares)
        first_net.append((points[0], _row(weights, 0)))
        second_net.append((points[-1], _row(weights, -1)))
    return _stack_rows(first_net), _stack_rows(second_net[::-1])


def restrict(net: Net, first: float, last: float) -> Net:
    """The polynomials over [first, last] ⊆ [0, 1], with a parameter of their own from 0 to 1."""
    if first > 0:
        _, net = split(net, first)
    if last < 1:
        net, _ = split(net, (last - first) / (1 - first))
    return net


def _row(weights: FloatArray | None, row: int) -> FloatArray | None:
    return None if weights is None else weights[row]


def _stack_rows(rows: list[tuple[FloatArray, FloatArray | None]]) -> Net:
    weights = [weight for _, weight in rows if weight is not None]
    return np.stack([point for point, _ in rows]), np.stack(weights) if weights else None
