"""Nets of the partials of triangular patches."""

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray


def differences(nets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nets of the partials along s and t, ÷ n: (K, …) to two of degree n − 1.

        S_s: b_{i,j+1,k} − b_{i+1,j,k}    S_t: b_{i,j,k+1} − b_{i+1,j,k}

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 17.4.
    """
    degree = triangle.degree_of(len(nets)) or 0
    here = np.delete(np.arange(len(nets)), triangle.side_rows(degree)[1])
    above = triangle.row_starts(degree)[1] + np.arange(len(here))
    return nets[here + 1] - nets[here], nets[above] - nets[here]
