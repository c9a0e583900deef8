"""Points, first and second partials, normals and curvatures at any parameters of a batch."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.evaluation.nets import PARTIALS, DerivativeNets, evaluate_at, nets_of_samples
from service.engine.evaluation.normals import find_normals
from service.engine.points.curvature import Curvatures, regular_curvatures
from service.engine.points.pole_curvature import find_curvatures_near, find_limit_curvatures
from service.surface.batches import TensorPatches
from service.surface.sides import take_corners

COUNTS = (1, 3, 6)
"""The number of partials up to the orders 0, 1 and 2."""


@dataclass(frozen=True, eq=False, slots=True)
class Jets:
    """Partials, normals and curvatures at m parameters; values that are not requested are None.

    Attributes
    ----------
    partials : ndarray of float64, shape (1, 3 or 6, m, 3)
        S, then S_u and S_v, then S_uu, S_uv and S_vv.
    normals : ndarray of float64, shape (m, 3), or None
        Unit normals; limits where S_u × S_v vanishes.
    degenerate : ndarray of bool, shape (m,), or None
        Whether S_u × S_v vanishes.
    curvatures : Curvatures or None
    """

    partials: FloatArray
    normals: FloatArray | None
    degenerate: Bools | None
    curvatures: Curvatures | None


def evaluate_jets(
    patches: TensorPatches, index: Ints, u: FloatArray, v: FloatArray, order: int
) -> Jets:
    """Partials up to an order, normals and curvatures of patch `index[k]` at (u[k], v[k]).

    Parameters
    ----------
    patches : TensorPatches
    index : ndarray of int, shape (m,)
    u, v : ndarray of float64, shape (m,)
        Parameters in [0, 1].
    order : 0, 1 or 2
        The order of the partials. From order 1 on, normals are computed; with order 2, curvatures.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., Algorithm A4.4 (partials of a rational surface).
    """
    m = len(index)
    partials = np.empty((COUNTS[order], m, 3))
    normals = np.empty((m, 3))
    is_degenerate = np.empty(m, dtype=bool)
    curvatures = np.empty((4, m))
    for nets, rows, net_numbers in nets_of_samples(patches, index):
        # `local` has the partials of (S − middle) · scale at the parameters `rows`.
        parameters = u[rows], v[rows]
        local = _partials(nets, net_numbers, *parameters, order)
        scale = nets.scale[net_numbers]
        partials[:, rows] = local / scale[:, None]
        partials[0, rows] += nets.middle[net_numbers]
        if order > 0:
            normals[rows], is_degenerate[rows] = find_normals(nets, net_numbers, *parameters)
        if order > 1:
            local_curvatures = regular_curvatures(local, normals[rows])
            is_pole = is_degenerate[rows]
            if is_pole.any():
                u_pole, v_pole = u[rows[is_pole]], v[rows[is_pole]]
                local_curvatures[:, is_pole] = find_limit_curvatures(
                    nets, net_numbers[is_pole], u_pole, v_pole, normals[rows[is_pole]]
                )
            # NaN except near poles.
            from_series = find_curvatures_near(nets, net_numbers, *parameters, normals[rows])
            local_curvatures = np.where(np.isnan(from_series), local_curvatures, from_series)
            curvatures[:, rows] = local_curvatures * np.stack([scale * scale, scale, scale, scale])
    _write_ends(patches, index, u, v, partials[0])
    return Jets(
        partials,
        normals if order > 0 else None,
        is_degenerate if order > 0 else None,
        Curvatures(*curvatures) if order > 1 else None,
    )


def _partials(
    nets: DerivativeNets, net_numbers: Ints, u: FloatArray, v: FloatArray, order: int
) -> FloatArray:
    """Partials of the surface, (1, 3 or 6, m, 3), in the local coordinates of the nets."""
    p, q = nets.degree
    along_u = [bernstein(p - k, u) if k <= p else None for k in range(order + 1)]
    along_v = [bernstein(q - k, v) if k <= q else None for k in range(order + 1)]
    partials = []
    for i, j in PARTIALS[: COUNTS[order]]:
        net, bu, bv = nets.partial_net(i, j), along_u[i], along_v[j]
        if net is None or bu is None or bv is None:
            partials.append(np.zeros((len(net_numbers), nets.point.shape[1])))
        else:
            partials.append(evaluate_at(net, net_numbers, bu, bv))
    return project_partials(np.stack(partials)) if nets.is_rational else np.stack(partials)


def project_partials(x: FloatArray) -> FloatArray:
    """Partials (1, 3 or 6, m, 3) of S = X/w from the partials of the homogeneous (X, w), (…, m, 4).

        S_u = (X_u − w_u S)/w,  S_uv = (X_uv − w_uv S − w_u S_v − w_v S_u)/w

    The coordinates should be relative to a point near the surface: rounding errors are then
    smallest.
    """
    w = x[..., 3:]
    s = np.empty((*x.shape[:-1], 3))
    s[0] = x[0, :, :3] / w[0]
    if len(x) > 1:
        s[1:3] = (x[1:3, :, :3] - w[1:3] * s[0]) / w[0]
    if len(x) > 3:
        s[3] = x[3, :, :3] - w[3] * s[0] - 2 * w[1] * s[1]
        s[4] = x[4, :, :3] - w[4] * s[0] - w[1] * s[2] - w[2] * s[1]
        s[5] = x[5, :, :3] - w[5] * s[0] - 2 * w[2] * s[2]
        s[3:] /= w[0]
    return s


def _write_ends(
    patches: TensorPatches, index: Ints, u: FloatArray, v: FloatArray, points: FloatArray
) -> None:
    """Replaces points at corners and on sides that are one point by the exact control points."""
    corners = take_corners(patches.points)  # (0, 0), (0, 1), (1, 0), (1, 1)
    for side, (is_on_side, corner) in enumerate(
        ((u == 0, 0), (u == 1, 2), (v == 0, 0), (v == 1, 1))
    ):
        rows = np.flatnonzero(is_on_side)
        rows = rows[patches.collapsed[index[rows], side]]
        points[rows] = corners[index[rows], corner]
    rows = np.flatnonzero(((u == 0) | (u == 1)) & ((v == 0) | (v == 1)))
    points[rows] = corners[index[rows], (2 * u[rows] + v[rows]).astype(np.intp)]
