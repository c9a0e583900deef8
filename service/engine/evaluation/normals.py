"""Unit normals at any parameter of a patch, poles and other degenerate points included.

The normal is the unit vector of S_u × S_v. Where that vector vanishes, the normal is the limit from
inside the patch (`degenerate`). These functions are slow: for grids of samples, `evaluate` calls
them only where its own normals are too imprecise.
"""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bools, FloatArray
from service.bases.bernstein import bernstein
from service.engine.evaluation.degenerate import VANISHING, limit_normals
from service.engine.evaluation.nets import DerivativeNets, nets_of_samples
from service.engine.vectors import cross, length
from service.surface.batches import TensorPatches


def unit_normals(
    patches: TensorPatches, index: NDArray[np.intp], u: FloatArray, v: FloatArray
) -> tuple[FloatArray, int]:
    """Unit normals of patch `index[k]` at (u[k], v[k]), and how many of them are limits.

    Parameters
    ----------
    patches : TensorPatches
    index : ndarray of int, shape (m,)
    u, v : ndarray of float64, shape (m,)
        Parameters in [0, 1].

    Returns
    -------
    normals : ndarray of float64, shape (m, 3)
        Unit length, never NaN. A patch without area has no normals: it gets a unit vector
        perpendicular to the longest difference of its neighbouring control points.
    limit_count : int
        The number of samples at which S_u × S_v vanishes.

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., on degenerate patches, treats one collapsed side.
    All other cases follow from the Taylor expansion of N.
    """
    normals = np.empty((len(index), 3))
    limit_count = 0
    for nets, rows, net_numbers in nets_of_samples(patches, index):
        normals[rows], vanishes = find_normals(nets, net_numbers, u[rows], v[rows])
        limit_count += int(np.count_nonzero(vanishes))
    return normals, limit_count


def find_normals(
    nets: DerivativeNets, net_numbers: NDArray[np.intp], u: FloatArray, v: FloatArray
) -> tuple[FloatArray, Bools]:
    """Unit normals (m, 3) of patch `net_numbers[k]` of the nets at (u[k], v[k]).

    The second result (m,) says where S_u × S_v vanishes: there the normal is a limit.
    """
    p, q = nets.degree
    du, dv = nets.partials(
        net_numbers, (bernstein(p, u), bernstein(p - 1, u)), (bernstein(q, v), bernstein(q - 1, v))
    )
    vectors = cross(du, dv, -1)
    lengths, length_u, length_v = (length(rows, -1) for rows in (vectors, du, dv))
    vanishes: Bools = lengths <= VANISHING * length_u * length_v
    vanishes |= length_u <= VANISHING * nets.longest_u[net_numbers]
    vanishes |= length_v <= VANISHING * nets.longest_v[net_numbers]
    vanishing_rows = np.flatnonzero(vanishes)
    lengths[vanishing_rows] = 1.0
    normals = vectors / lengths[:, None]
    if len(vanishing_rows):
        normals[vanishing_rows] = limit_normals(
            nets, net_numbers[vanishing_rows], u[vanishing_rows], v[vanishing_rows]
        )
    return normals, vanishes
