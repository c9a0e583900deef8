"""Normals where a side of a patch is one point, the usual pole, without much ado."""

import numpy as np
from numpy.typing import NDArray

from service.engine.mesh import RealArray
from service.surface.lowered import FloatArray, TensorPatches
from service.surface.sides import side_of

FLAT = 2.0**-36
"""A cone whose sides make a smaller angle has no normals that rounding would not decide."""


def pole_normals(
    patches: TensorPatches, side: int, index: NDArray[np.intp], basis: RealArray
) -> FloatArray:
    """Limit normals along sides that are one point, the usual pole.

    About the pole, N = v (C'(u) × C(u)) + O(v²) for a side v = 0, where C is the Bézier curve of
    the next row of control points seen from the pole, times their weights. So the limit is that
    of the cone which the row spans, and no polynomial of high degree is needed.

    Parameters
    ----------
    patches : TensorPatches
    side : int
        0 … 3, see `service.surface.sides`.
    index : ndarray of int, shape (m,)
        Patches of which this side is collapsed.
    basis : ndarray of float64, shape (2k, n+1)
        Bernstein basis of degree n at k parameters along the side, then its derivatives.

    Returns
    -------
    ndarray of float64, shape (m, k, 3)
        Unit length; NaN where the cone has no tangent plane either.
    """
    rows = side_of(patches.points, side, 1)[index]
    rows -= side_of(patches.points, side)[index, :1]
    if patches.weights is not None:
        rows *= side_of(patches.weights, side, 1)[index, :, None]
    normals = _cone_normals(rows, basis)
    # du × dv turns with C on the sides u = 0 and v = 1, against it on the other two.
    return normals if side in {0, 3} else -normals


def _cone_normals(rows: FloatArray, basis: RealArray) -> FloatArray:
    """C × C' made unit for Bézier curves C with control points (m, n+1, 3): (m, k, 3) or NaN."""
    # Coordinates in the two orders that a cross product multiplies: y z x and z x y.
    both = np.matmul(basis, rows[:, :, [1, 2, 0, 2, 0, 1]])
    count = len(basis) // 2
    place, slope = both[:, :count], both[:, count:]
    vectors: FloatArray = place[:, :, :3] * slope[:, :, 3:]
    vectors -= place[:, :, 3:] * slope[:, :, :3]
    length = np.sqrt(np.einsum("mkd,mkd->mk", vectors, vectors))
    measure = np.einsum("mid,mid->m", rows, rows)
    length[length <= FLAT * measure[:, None]] = np.nan
    vectors /= length[:, :, None]
    return vectors
