"""Points, first and second partials, normals and curvatures at any parameters of a batch.

In barycentric coordinates (r, s, t) of a triangle, the partial along s is the derivative in
direction (−1, 1, 0), the partial along t that in direction (−1, 0, 1). Where both are parallel,
curvatures are limits, which are computed on the same surface as a tensor-product patch.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from service.bases import triangle_basis
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.evaluation.nets import PARTIALS, DerivativeNets, evaluate_at, nets_of_samples
from service.engine.evaluation.normals import find_normals, normals_at
from service.engine.evaluation.triangle_nets import (
    find_partial_nets,
    tensor_u,
    to_barycentric,
    triangles_of_samples,
)
from service.engine.nets.partials import project_partials
from service.engine.points.curvatures import find_pole_curvatures, find_regular_curvatures
from service.surface.batches import Patches, TensorPatches, TrianglePatches
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
    curvatures : ndarray of float64, shape (4, m), or None
        K, H, k_1, k_2: Gaussian, mean and principal curvatures, k_1 ≥ k_2; NaN where a limit is
        infinite or does not exist.
    """

    partials: FloatArray
    normals: FloatArray | None
    degenerate: Bools | None
    curvatures: FloatArray | None


_Part: TypeAlias = tuple[
    Ints, tuple[FloatArray, FloatArray], FloatArray, FloatArray, Bools, FloatArray
]
"""Jets of (S − middle) · scale at some parameters: their rows; middle and scale; partials, normals,
where S_u × S_v vanishes, and curvatures. What is not requested has any values."""


def evaluate_jets(patches: Patches, index: Ints, u: FloatArray, v: FloatArray, order: int) -> Jets:
    """Partials up to an order, normals and curvatures of patch `index[k]` at (u[k], v[k]).

    Parameters
    ----------
    patches : TensorPatches or TrianglePatches
    index : ndarray of int, shape (m,)
    u, v : ndarray of float64, shape (m,)
        Parameters in [0, 1]; on triangles the last two barycentric coordinates s and t.
    order : 0, 1 or 2
        The order of the partials. From order 1 on, normals are computed; with order 2, curvatures.

    References
    ----------
    Piegl and Tiller, The NURBS Book, 2nd ed., Algorithm A4.4 (partials of a rational surface).
    """
    m = len(index)
    partials = np.empty((COUNTS[order], m, 3))
    normals, is_degenerate, curvatures = np.empty((m, 3)), np.empty(m, bool), np.empty((4, m))
    parts = (
        _evaluate_triangles(patches, index, u, v, order)
        if isinstance(patches, TrianglePatches)
        else _evaluate_tensors(patches, index, u, v, order)
    )
    for rows, (middle, scale), local_partials, *others in parts:
        partials[:, rows] = local_partials / scale[:, np.newaxis]
        partials[0, rows] += middle
        normals[rows], is_degenerate[rows], local_curvatures = others
        curvatures[:, rows] = local_curvatures * np.stack([scale * scale, scale, scale, scale])
    if isinstance(patches, TrianglePatches):
        _write_corners(patches, index, u, v, partials[0])
    else:
        _write_ends(patches, index, u, v, partials[0])
    return Jets(
        partials,
        normals if order > 0 else None,
        is_degenerate if order > 0 else None,
        curvatures if order > 1 else None,
    )


def _evaluate_tensors(
    patches: TensorPatches, index: Ints, u: FloatArray, v: FloatArray, order: int
) -> Iterator[_Part]:
    """The jets of tensor-product patches, for some parameters at a time."""
    for nets, rows, number in nets_of_samples(patches, index):
        uv = np.stack([u[rows], v[rows]])
        partials = _find_tensor_partials(nets, number, uv, order)
        normals, is_degenerate = np.empty((len(rows), 3)), np.zeros(len(rows), bool)
        curvatures = np.zeros((4, len(rows)))
        if order > 0:
            normals, is_degenerate = find_normals(nets, number, *uv)
        if order > 1:
            curvatures = find_regular_curvatures(partials, normals)
            curvatures[:, is_degenerate] = np.nan
            at_poles = find_pole_curvatures(nets, number, uv, normals, is_degenerate)
            curvatures = np.where(np.isnan(at_poles), curvatures, at_poles)
        frame = nets.middle[number], nets.scale[number]
        yield rows, frame, partials, normals, is_degenerate, curvatures


def _evaluate_triangles(
    patches: TrianglePatches, index: Ints, s: FloatArray, t: FloatArray, order: int
) -> Iterator[_Part]:
    """The jets of triangles, for some places at a time."""
    all_normals, all_degenerate = np.empty((len(index), 3)), np.zeros(len(index), bool)
    if order > 0:
        all_normals, all_degenerate = normals_at(patches, index, s, t)
    for local, rows, number in triangles_of_samples(patches, index):
        places = to_barycentric(s[rows], t[rows])
        partials = _find_triangle_partials(local.patches, number, places, order)
        normals, is_degenerate = all_normals[rows], all_degenerate[rows]
        curvatures = np.zeros((4, len(rows)))
        if order > 1:
            curvatures = find_regular_curvatures(partials, normals)
            curvatures[:, is_degenerate] = np.nan
            # Only places at or near a pole are changed.
            chosen = local.patches.collapsed[number, :3].any(axis=1) | is_degenerate
            if chosen.any():
                curvatures[:, chosen] = _correct_near_poles(
                    local.patches,
                    number[chosen],
                    places[chosen],
                    normals[chosen],
                    curvatures[:, chosen],
                )
        frame = local.middle[number], local.scale[number]
        yield rows, frame, partials, normals, is_degenerate, curvatures


def _find_tensor_partials(
    nets: DerivativeNets, net_numbers: Ints, uv: FloatArray, order: int
) -> FloatArray:
    """Partials of the surface, (1, 3 or 6, m, 3), in the local coordinates of the nets."""
    p, q = nets.degree
    along_u = [bernstein(p - k, uv[0]) if k <= p else None for k in range(order + 1)]
    along_v = [bernstein(q - k, uv[1]) if k <= q else None for k in range(order + 1)]
    partials = np.zeros((COUNTS[order], len(net_numbers), nets.point.shape[1]))
    for row, (i, j) in enumerate(PARTIALS[: COUNTS[order]]):
        net, bu, bv = nets.partial_net(i, j), along_u[i], along_v[j]
        if net is not None and bu is not None and bv is not None:
            partials[row] = evaluate_at(net, net_numbers, bu, bv)
    return _project(partials)


def _find_triangle_partials(
    local: TrianglePatches, patch_numbers: Ints, places: FloatArray, order: int
) -> FloatArray:
    """Partials of patches `patch_numbers` at barycentric places (m, 3): shape (1, 3 or 6, m, 3)."""
    n = local.degree
    net = to_homogeneous(local.points, local.weights).swapaxes(0, 1)
    partials = np.zeros((COUNTS[order], len(patch_numbers), net.shape[-1]))
    for key, partial_net in find_partial_nets(net, order).items():
        basis = triangle_basis.triangle_bernstein(n - sum(key), places)
        values = np.einsum("km,kmd->md", basis, partial_net[:, patch_numbers])
        partials[PARTIALS.index(key)] = values
    return _project(partials)


def _project(partials: FloatArray) -> FloatArray:
    """Partials (1, 3 or 6, m, 3) from partials (1, 3 or 6, m, d), homogeneous if d is 4."""
    if partials.shape[2] == 3:
        return partials
    return np.stack(project_partials([*partials.swapaxes(1, 2)])).swapaxes(1, 2)


def _correct_near_poles(
    local: TrianglePatches,
    patch_numbers: Ints,
    places: FloatArray,
    normals: FloatArray,
    curvatures: FloatArray,
) -> FloatArray:
    """Curvatures (4, m): limits in place of NaN, and series near sides that are one point."""
    used, net_numbers = np.unique(patch_numbers, return_inverse=True)
    nets = DerivativeNets(local.take(used).to_tensor(), np.arange(len(used)))
    # The side v = 1 is a pole of the tensor-product form, but not of the triangle.
    nets.collapsed[:, 3] = False
    uv = np.stack([tensor_u(local, patch_numbers, places), places[:, 2]])
    is_missing = np.asarray(np.isnan(curvatures).all(axis=0))
    # Curvatures K, H, k_1, k_2 of `nets` times these are those of `local`.
    units = np.stack([nets.scale**2, nets.scale, nets.scale, nets.scale])[:, net_numbers]
    at_poles = find_pole_curvatures(nets, net_numbers, uv, normals, is_missing) * units
    return np.where(np.isnan(at_poles), curvatures, at_poles)


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


def _write_corners(
    patches: TrianglePatches, index: Ints, s: FloatArray, t: FloatArray, points: FloatArray
) -> None:
    """Replaces points at corners of triangles by the exact control points."""
    # Corners 0, 1 and 2 are (s, t) = (0, 0), (0, 1) and (1, 0).
    for number, is_at_corner in enumerate(((s == 0) & (t == 0), t == 1, s == 1)):
        rows = np.flatnonzero(is_at_corner)
        points[rows] = patches.corners[index[rows], number]
