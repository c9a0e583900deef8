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
    # Planes of coordinates in the two orders that a cross product multiplies: y z x and z x y.
    planes = poles.cones.transpose(2, 0, 1).take([1, 2, 0, 2, 0, 1], axis=0)
    count, rows = planes.shape[1:]
    both = np.matmul(planes.reshape(-1, rows), basis.T).reshape(6, count, 2, -1)
    # du × dv turns with C on the sides u = 0 and v = 1, against it on the other two.
    against = poles.end != poles.axis
    both = np.where(against[:, np.newaxis, np.newaxis], both[:, :, ::-1], both)
    place, slope = both[:, :, 0], both[:, :, 1]
    normals: FloatArray = place[:3] * slope[3:]
    normals -= place[3:] * slope[:3]
    length = np.sqrt(np.square(normals).sum(axis=0))
    measure = np.einsum("mid,mid->m", poles.cones, poles.cones)
    length[length <= FLAT * measure[:, np.newaxis]] = np.nan
    normals /= length
    return normals.transpose(1, 2, 0)
