"""Normals where a side of a patch is one point, the usual pole, without much ado."""

import numpy as np

from service.bases.arrays import FloatArray, RealArray
from service.surface.batches import Poles

YZX_ZXY = np.array([1, 2, 0, 2, 0, 1])

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
    # Planes of coordinates in the two orders that a cross product multiplies: y z x and z x y.
    count, rows, _ = poles.cones.shape
    planes = poles.cones.transpose(2, 0, 1).take(YZX_ZXY, axis=0)
    both = np.matmul(planes.reshape(-1, rows), basis.T).reshape(6, count, 2, -1)
    place, slope = both[:, :, 0], both[:, :, 1]
    normals: FloatArray = place[:3] * slope[3:]
    normals -= place[3:] * slope[:3]
    squares = np.add.reduce(normals * normals)
    length = np.sqrt(squares, out=squares)
    flat = poles.cones.reshape(count, -1)
    unclear = length <= FLAT * np.vecdot(flat, flat)[:, np.newaxis]
    if np.count_nonzero(unclear):
        length[unclear] = np.nan
    # du × dv turns with C on the sides u = 0 and v = 1, against it on the other two.
    np.negative(length, out=length, where=(poles.end != poles.axis)[:, np.newaxis])
    normals /= length
    return normals.transpose(1, 2, 0)
