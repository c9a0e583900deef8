"""Points, partials, normals and curvatures at any barycentric places of triangular patches.

In barycentric coordinates (r, s, t), the partial along s is the derivative in direction (−1, 1, 0),
the partial along t that in direction (−1, 0, 1). Where both are parallel, curvatures are limits,
which are computed on the same surface as a tensor-product patch.
"""

import numpy as np

from service.bases import triangle_basis
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import FloatArray, Ints
from service.engine.evaluation.nets import PARTIALS, DerivativeNets
from service.engine.evaluation.triangle_nets import partial_nets, to_barycentric
from service.engine.evaluation.triangle_normals import normals_at, tensor_u, triangles_of_samples
from service.engine.points.curvature import Curvatures, regular_curvatures
from service.engine.points.differential import COUNTS, Jets, project_partials
from service.engine.points.pole_curvature import find_curvatures_near, find_limit_curvatures
from service.surface.batches import TrianglePatches


def evaluate_triangle_jets(
    patches: TrianglePatches, index: Ints, s: FloatArray, t: FloatArray, order: int
) -> Jets:
    """Partials up to an order, normals and curvatures of patch `index[k]` at (s[k], t[k]).

    Parameters
    ----------
    patches : TrianglePatches
    index : ndarray of int, shape (m,)
    s, t : ndarray of float64, shape (m,)
        The last two barycentric coordinates.
    order : 0, 1 or 2
        The order of the partials. From order 1 on, normals are computed; with order 2, curvatures.
    """
    m = len(index)
    partials = np.empty((COUNTS[order], m, 3))
    normals, is_degenerate = np.empty((m, 3)), np.empty(m, dtype=bool)
    if order > 0:
        normals, is_degenerate = normals_at(patches, index, s, t)
    curvatures = np.empty((4, m))
    for local, rows, patch_numbers in triangles_of_samples(patches, index):
        # `local_partials` are those of (S − middle) · scale at the places `rows`.
        places = to_barycentric(s[rows], t[rows])
        local_partials = _partials(local.patches, patch_numbers, places, order)
        scale = local.scale[patch_numbers]
        partials[:, rows] = local_partials / scale[:, None]
        partials[0, rows] += local.middle[patch_numbers]
        if order > 1:
            local_curvatures = regular_curvatures(local_partials, normals[rows])
            local_curvatures[:, is_degenerate[rows]] = np.nan
            # `_correct_near_poles` changes only those of these places that are at or near a pole.
            has_pole = local.patches.collapsed[patch_numbers, :3].any(axis=1) | is_degenerate[rows]
            if has_pole.any():
                local_curvatures[:, has_pole] = _correct_near_poles(
                    local.patches,
                    patch_numbers[has_pole],
                    places[has_pole],
                    normals[rows[has_pole]],
                    local_curvatures[:, has_pole],
                )
            curvatures[:, rows] = local_curvatures * np.stack([scale * scale, scale, scale, scale])
    _write_corners(patches, index, (s, t), partials[0])
    return Jets(
        partials,
        normals if order > 0 else None,
        is_degenerate if order > 0 else None,
        Curvatures(*curvatures) if order > 1 else None,
    )


def _partials(
    local: TrianglePatches, patch_numbers: Ints, places: FloatArray, order: int
) -> FloatArray:
    """Partials of patches `patch_numbers` at barycentric places (m, 3): shape (1, 3 or 6, m, 3)."""
    n = local.degree
    net = to_homogeneous(local.points, local.weights).swapaxes(0, 1)
    nets = {(0, 0): net}
    if order > 0:
        nets[1, 0], nets[0, 1] = partial_nets(net)
    if order > 1 and n > 1:
        nets[2, 0], nets[1, 1] = partial_nets(nets[1, 0])
        nets[0, 2] = partial_nets(nets[0, 1])[1]
    partials = np.zeros((COUNTS[order], len(patch_numbers), net.shape[-1]))
    for row, key in enumerate(PARTIALS[: COUNTS[order]]):
        if key in nets:
            total_order = sum(key)
            basis = triangle_basis.triangle_bernstein(n - total_order, places)
            factor = (1, n, n * (n - 1))[total_order]
            partials[row] = factor * np.einsum("km,kmd->md", basis, nets[key][:, patch_numbers])
    return project_partials(partials) if local.weights is not None else partials


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
    u, v = tensor_u(local, patch_numbers, places), places[:, 2]
    # Curvatures K, H, k_1, k_2 of `nets` times these are those of `local`.
    units = np.stack([nets.scale**2, nets.scale, nets.scale, nets.scale])[:, net_numbers]
    missing = np.flatnonzero(np.isnan(curvatures).all(axis=0))
    curvatures[:, missing] = find_limit_curvatures(
        nets, net_numbers[missing], u[missing], v[missing], normals[missing]
    )
    curvatures[:, missing] *= units[:, missing]
    # NaN except near poles.
    from_series = find_curvatures_near(nets, net_numbers, u, v, normals) * units
    return np.where(np.isnan(from_series), curvatures, from_series)


def _write_corners(
    patches: TrianglePatches, index: Ints, st: tuple[FloatArray, FloatArray], points: FloatArray
) -> None:
    """Replaces points at corners by the exact control points."""
    s, t = st
    # Corners 0, 1 and 2 are (s, t) = (0, 0), (0, 1) and (1, 0).
    for number, is_at_corner in enumerate(((s == 0) & (t == 0), t == 1, s == 1)):
        rows = np.flatnonzero(is_at_corner)
        points[rows] = patches.corners[index[rows], number]
