"""Normals where a side of a patch is one point, the usual pole, without much ado."""

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.surface.batches import Poles

FLAT = 2.0**-36
"""A cone whose sides make a smaller angle has no normals that rounding would not decide."""


def pole_normals(poles: Poles, basis: RealArray) -> FloatArray:
    """Limit normals along sides that are one point, the usual pole.

    About the pole, N = v (C'(u) × C(u)) + O(v²) for a side v = 0, where C is the Bézier curve of
    the next row of control points seen from the pole, times their weights. So the limit is that
    of the cone which the row spans, and no polynomial of high degree is needed.

    Parameters
    ----------
    poles : Poles
        m patches and their cones.
    basis : ndarray of float64, shape (2k, n+1)
        Bernstein basis of degree n at k parameters along the side, then its derivatives.

    Returns
    -------
    ndarray of float64, shape (m, k, 3)
        Unit length; NaN where the cone has no tangent plane either.
    """
    # Coordinates in the two orders that a cross product multiplies: y z x and z x y.
    both = np.matmul(basis, poles.cones[:, :, [1, 2, 0, 2, 0, 1]])
    count = len(basis) // 2
    place, slope = both[:, :count], both[:, count:]
    # du × dv turns with C on the sides u = 0 and v = 1, against it on the other two.
    if poles.side not in {0, 3}:
        place, slope = slope, place
    normals: FloatArray = place[:, :, :3] * slope[:, :, 3:]
    normals -= place[:, :, 3:] * slope[:, :, :3]
    length = np.sqrt(np.einsum("mkd,mkd->mk", normals, normals))
    measure = np.einsum("mid,mid->m", poles.cones, poles.cones)
    length[length <= FLAT * measure[:, None]] = np.nan
    normals /= length[:, :, None]
    return normals
