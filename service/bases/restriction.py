"""Pieces of Bézier curves: the control points over an interval, for many intervals at once."""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein


def restriction_matrices(degree: int, breaks: FloatArray) -> FloatArray:
    """Control points of a Bézier curve over each interval of a division of its domain.

    Over [s, e], control point j is the value of the blossom with s taken n − j times and e taken
    j times, hence

        R_ji = Σ_k B_{i−k}^{n−j}(s) B_k^j(e)

    Only products of non-negative numbers are added, and the rows add up to one. The last row of an
    interval is the first of the next, bit for bit.

    Parameters
    ----------
    degree : int
        n ≥ 0.
    breaks : ndarray of float64, shape (M+1,)
        Strictly increasing; the first and the last are the ends of the curve.

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
        begin, end = bernstein(degree - j, t[:-1]), bernstein(j, t[1:])
        for k in range(j + 1):
            rows[:, j, k : k + degree - j + 1] += end[:, k, np.newaxis] * begin
    return rows


def restrict_to_cells(net: FloatArray, breaks_u: FloatArray, breaks_v: FloatArray) -> FloatArray:
    """The nets of one tensor-product polynomial over every cell of a grid of intervals.

    Parameters
    ----------
    net : ndarray of float64, shape (a+1, b+1, d)
        Over [first, last] of the breaks in both directions.

    Returns
    -------
    ndarray of float64, shape (M_u M_v, a+1, b+1, d)
        Cell (k, l) is number k M_v + l.
    """
    rows, columns, dimension = net.shape
    along_u = np.tensordot(restriction_matrices(rows - 1, breaks_u), net, axes=(2, 0))
    cells = np.tensordot(restriction_matrices(columns - 1, breaks_v), along_u, axes=(2, 2))
    # (M_v, b+1, M_u, a+1, d) so far.
    ordered = np.ascontiguousarray(cells.transpose(2, 0, 3, 1, 4))
    return ordered.reshape(-1, rows, columns, dimension)
