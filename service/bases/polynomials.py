"""Degree elevation, splitting and restriction of Bézier control nets.

A net is a pair of points and weights (None if all are 1). The functions of nets work along axis 0
and do not change the other axes. Each step computes weighted means of two neighbouring rows. So no
digits are lost to cancellation, the first and the last row keep their bits, and equal rows stay
equal. Matrices restrict polynomials to many parts of their domain at once.

Farin, Curves and Surfaces for CAGD, 5th ed., sections 5.3 and 6.1.
"""

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import TypeAlias

import numpy as np

from service.bases.affine_combination import combine
from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein

Net: TypeAlias = tuple[FloatArray, FloatArray | None]
"""Points (n+1, …, d) and weights (n+1, …) or None."""


def map_net(net: Net, change: Callable[[FloatArray], FloatArray]) -> Net:
    """The net after `change` was applied to its points, and to its weights if it has any."""
    points, weights = net
    return change(points), None if weights is None else change(weights)


def stack_nets(nets: Sequence[Net]) -> Net:
    """Stack nets along a new first axis."""
    weights = [weights for _, weights in nets if weights is not None]
    return np.stack([points for points, _ in nets]), np.stack(weights) if weights else None


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
    steps = [net]
    for n in range(len(net[0]) - 1, 0, -1):
        i = np.arange(n)
        shares = np.repeat([[1 - t], [t]], n, axis=1)
        steps.append(combine(*steps[-1], np.stack([i, i + 1]), shares))
    return (
        stack_nets([map_net(step, itemgetter(0)) for step in steps]),
        stack_nets([map_net(step, itemgetter(-1)) for step in steps[::-1]]),
    )


def restrict(net: Net, first: float, last: float) -> Net:
    """The polynomials over [first, last] ⊆ [0, 1], with a parameter of their own from 0 to 1."""
    if first > 0:
        _, net = split(net, first)
    if last < 1:
        net, _ = split(net, (last - first) / (1 - first))
    return net


def restriction_matrices(degree: int, breaks: FloatArray) -> FloatArray:
    """Matrices that restrict a Bézier curve to each interval between consecutive breaks.

    Matrix m times the control points of the curve gives the control points over interval m. Over
    the interval [s, e], control point j is the blossom at n − j times the argument s and j times
    the argument e, hence

        R_ji = Σ_k B_{i−k}^{n−j}(s) B_k^j(e)

    Only products of non-negative numbers are added, and each row has the sum 1. The last row of a
    matrix equals the first row of the next, bit for bit.

    Parameters
    ----------
    degree : int
        n ≥ 0.
    breaks : ndarray of float64, shape (M+1,)
        Strictly increasing; the first and the last break are the ends of the curve.

    Returns
    -------
    ndarray of float64, shape (M, n+1, n+1)

    References
    ----------
    Ramshaw, Blossoms are polar forms, CAGD 6 (1989).
    """
    t = (breaks - breaks[0]) / (breaks[-1] - breaks[0])
    rows = np.zeros((len(t) - 1, degree + 1, degree + 1))
    for j in range(degree + 1):
        start_basis, end_basis = bernstein(degree - j, t[:-1]), bernstein(j, t[1:])
        for k in range(j + 1):
            rows[:, j, k : k + degree - j + 1] += end_basis[:, k, np.newaxis] * start_basis
    return rows


def restrict_to_cells(net: FloatArray, breaks_u: FloatArray, breaks_v: FloatArray) -> FloatArray:
    """The nets of one tensor-product polynomial over every cell between the breaks.

    Parameters
    ----------
    net : ndarray of float64, shape (a+1, b+1, d)
        The polynomial from the first to the last break in both directions.
    breaks_u, breaks_v : ndarray of float64, shapes (M_u+1,) and (M_v+1,)
        Strictly increasing.

    Returns
    -------
    ndarray of float64, shape (M_u M_v, a+1, b+1, d)
        Cell (k, l) is number k M_v + l.
    """
    rows, columns, dimension = net.shape
    strips = np.tensordot(restriction_matrices(rows - 1, breaks_u), net, axes=(2, 0))
    cells = np.tensordot(restriction_matrices(columns - 1, breaks_v), strips, axes=(2, 2))
    # `cells` has the axes (M_v, b+1, M_u, a+1, d).
    ordered = np.ascontiguousarray(cells.transpose(2, 0, 3, 1, 4))
    return ordered.reshape(-1, rows, columns, dimension)
