"""Restriction of Bézier curves and patches to parts of their domain, for many parts at once."""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.bernstein import bernstein


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
