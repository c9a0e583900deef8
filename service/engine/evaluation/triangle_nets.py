"""Nets of the partials of triangular patches, and their parameters."""

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray, Ints


def partial_nets(nets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nets of the partials along s and t, ÷ n: (K, …) to two of degree n − 1.

        S_s: b_{i,j+1,k} − b_{i+1,j,k}    S_t: b_{i,j,k+1} − b_{i+1,j,k}

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 17.4.
    """
    corner, along, above = neighbour_rows(len(nets))
    return nets[along] - nets[corner], nets[above] - nets[corner]


def to_barycentric(s: FloatArray, t: FloatArray) -> FloatArray:
    """(r, s, t) with the sum 1, shape (m, 3); r is never negative, whatever s and t add up to."""
    return np.stack([np.maximum(1.0 - s - t, 0.0), s, t], axis=1)


def neighbour_rows(count: int) -> tuple[Ints, Ints, Ints]:
    """Rows of b_{i+1,j,k}, b_{i,j+1,k} and b_{i,j,k+1} in a net of `count` control points.

    They are the upright triangles of the net, in the order of the b_ijk of degree n − 1.
    """
    degree = triangle.degree_of(count)
    corner = np.delete(np.arange(count), triangle.side_rows(degree)[1])
    above = triangle.row_starts(degree)[1] + np.arange(len(corner))
    return corner, corner + 1, above
