"""Normals where a side of a patch is one point, the usual pole, without much ado."""

import numpy as np
from numpy.typing import NDArray

from service.engine.mesh import RealArray
from service.engine.vectors import cross
from service.surface.lowered import FloatArray, TensorPatches
from service.surface.sides import side_of

FLAT = 2.0**-36
"""A cone whose sides make a smaller angle has no normals that rounding would not decide."""


def pole_normals(
    patches: TensorPatches, side: int, index: NDArray[np.intp], basis: tuple[RealArray, RealArray]
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
    basis : ndarrays of float64, shapes (k, n+1) and (k, n)
        Bernstein bases of degrees n and n − 1 at k parameters along the side.

    Returns
    -------
    ndarray of float64, shape (m, k, 3)
        Unit length; NaN where the cone has no tangent plane either.
    """
    rows = side_of(patches.points, side, 1)[index]
    rows -= side_of(patches.points, side)[index, :1]
    if patches.weights is not None:
        rows *= side_of(patches.weights, side, 1)[index, :, None]
    normals = _cone_normals(rows, *basis)
    # du × dv turns with C on the sides u = 0 and v = 1, against it on the other two.
    return normals if side in {0, 3} else -normals


def _cone_normals(rows: FloatArray, basis: RealArray, basis_below: RealArray) -> FloatArray:
    """C × C' made unit for Bézier curves C with control points (m, n+1, 3): (m, k, 3) or NaN."""
    steps = rows[:, 1:] - rows[:, :-1]
    vectors = cross(np.matmul(basis, rows), np.matmul(basis_below, steps))
    length = np.sqrt(np.einsum("mkd,mkd->mk", vectors, vectors))
    measure = np.einsum("mid,mid->m", rows, rows)
    length[length <= FLAT * measure[:, None]] = np.nan
    vectors /= length[:, :, None]
    return vectors
