"""Nets of the partials of triangular patches, and barycentric coordinates of parameters."""

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray, Ints


def partial_nets(nets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nets of S_s / n and S_t / n, of degree n − 1, from nets (K, …) of degree n.

    A net has K control points, in the order of `service.bases.triangle`.

        S_s / n: b_{i,j+1,k} − b_{i+1,j,k}    S_t / n: b_{i,j,k+1} − b_{i+1,j,k}

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 17.4.
    """
    corner, along, above = neighbour_rows(len(nets))
    return nets[along] - nets[corner], nets[above] - nets[corner]


def to_barycentric(s: FloatArray, t: FloatArray) -> FloatArray:
    """Barycentric coordinates (r, s, t) with r = 1 − s − t, shape (m, 3).

    If rounding makes s + t larger than 1, r is 0.
    """
    return np.stack([np.maximum(1.0 - s - t, 0.0), s, t], axis=1)


def neighbour_rows(count: int) -> tuple[Ints, Ints, Ints]:
    """Rows of b_{i+1,j,k}, b_{i,j+1,k} and b_{i,j,k+1} in a net of `count` control points.

    The result is three arrays, one row for each upright triangle of neighbours in the net, in the
    order of the control points of a net of degree n − 1.
    """
    degree = triangle.degree_of(count)
    corner = np.delete(np.arange(count), triangle.side_rows(degree)[1])
    above = triangle.row_starts(degree)[1] + np.arange(len(corner))
    return corner, corner + 1, above
