"""Unit normals at any parameters of any patches, poles and other degenerate points included.

The normal is the unit vector of S_u × S_v, or S_s × S_t of triangles. Where that vector vanishes,
the normal is the limit from inside the patch (`degenerate`); for a triangle, of the same surface as
a tensor-product patch. These functions are slow: for grids of samples, `evaluate` calls them only
where its own normals are too imprecise.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from service.bases import triangle_basis
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.evaluation.degenerate import VANISHING, limit_normals
from service.engine.evaluation.nets import DerivativeNets, nets_of_samples
from service.engine.evaluation.triangle_nets import (
    localize,
    partial_nets,
    tensor_u,
    to_barycentric,
    triangles_of_samples,
)
from service.engine.vectors import cross, length, project
from service.surface.batches import Patches, TensorPatches, TrianglePatches


def unit_normals(
    patches: TensorPatches, index: Ints, u: FloatArray, v: FloatArray
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
    nets: DerivativeNets, net_numbers: Ints, u: FloatArray, v: FloatArray
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


def triangle_normals(
    patches: TrianglePatches, index: Ints, s: FloatArray, t: FloatArray
) -> tuple[FloatArray, int]:
    """Unit normals of patch `index[k]` at (s[k], t[k]), and how many of them are limits.

    Parameters
    ----------
    patches : TrianglePatches
    index : ndarray of int, shape (m,)
    s, t : ndarray of float64, shape (m,)
        Parameters ≥ 0 with s + t ≤ 1.

    Returns
    -------
    normals : ndarray of float64, shape (m, 3)
        Unit length, never NaN.
    limit_count : int
        The number of samples at which S_s × S_t vanishes.
    """
    normals, vanishes = normals_at(patches, index, s, t)
    return normals, int(np.count_nonzero(vanishes))


def normals_at(
    patches: TrianglePatches, index: Ints, s: FloatArray, t: FloatArray
) -> tuple[FloatArray, Bools]:
    """Unit normals (m, 3) of patch `index[k]` at (s[k], t[k]).

    The second result (m,) says where S_s × S_t vanishes: there the normal is a limit.
    """
    normals = np.empty((len(index), 3))
    vanishes = np.empty(len(index), dtype=bool)
    for local, rows, patch_numbers in triangles_of_samples(patches, index):
        regular = _find_regular_normals(local.patches, patch_numbers, s[rows], t[rows])
        normals[rows], vanishes[rows] = regular
    vanishing_rows = np.flatnonzero(vanishes)
    if len(vanishing_rows):
        # One call computes all limits, because preparing a patch of high degree takes half of the
        # time.
        used, patch_numbers = np.unique(index[vanishing_rows], return_inverse=True)
        local_patches = localize(patches.take(used)).patches
        u = tensor_u(
            local_patches, patch_numbers, to_barycentric(s[vanishing_rows], t[vanishing_rows])
        )
        normals[vanishing_rows], _ = unit_normals(
            local_patches.to_tensor(), patch_numbers, u, t[vanishing_rows]
        )
    return normals, vanishes


def _find_regular_normals(
    local: TrianglePatches, patch_numbers: Ints, s: FloatArray, t: FloatArray
) -> tuple[FloatArray, Bools]:
    """Unit vectors (m, 3) of S_s × S_t on patch `patch_numbers[k]` at (s[k], t[k]).

    The second result (m,) says where S_s × S_t vanishes: there the vector is meaningless.
    """
    barycentric = to_barycentric(s, t)
    nets = to_homogeneous(local.points, local.weights).swapaxes(0, 1)
    nets_of_partials = partial_nets(nets)
    lower_basis = triangle_basis.triangle_bernstein(local.degree - 1, barycentric)
    ds, dt = (_combine(lower_basis, net, patch_numbers) for net in nets_of_partials)
    if local.weights is not None:
        basis = triangle_basis.triangle_bernstein(local.degree, barycentric)
        point = _combine(basis, nets, patch_numbers)
        position = project(point, -1)
        ds = ds[:, :3] - position * ds[:, 3:]
        dt = dt[:, :3] - position * dt[:, 3:]
    vectors = cross(ds, dt, -1)
    lengths, length_s, length_t = (length(rows, -1) for rows in (vectors, ds, dt))
    longest_s, longest_t = (_longest_vectors(net)[patch_numbers] for net in nets_of_partials)
    vanishes: Bools = lengths <= VANISHING * length_s * length_t
    vanishes |= length_s <= VANISHING * longest_s
    vanishes |= length_t <= VANISHING * longest_t
    lengths[vanishes] = 1.0
    return vectors / lengths[:, None], vanishes


def _combine(basis: FloatArray, nets: FloatArray, patch_numbers: Ints) -> FloatArray:
    """Values (m, d) at m parameters: value k is net `patch_numbers[k]` times column k of the basis.

    `nets` (K, P, d) are P nets of K control points; `basis` has the shape (K, m).
    """
    if nets.shape[1] == 1:
        return basis.T @ nets[:, 0]
    values: FloatArray = np.einsum("km,kmd->md", basis, nets[:, patch_numbers])
    return values


def _longest_vectors(nets: FloatArray) -> FloatArray:
    """Longest length among the vectors of each net: (K, P, d) to (P,)."""
    lengths: FloatArray = np.sqrt(np.square(nets[..., :3]).sum(axis=-1).max(axis=0))
    return lengths


def group_by_batch(batches: Sequence[Patches], patch: Ints) -> Iterator[tuple[Patches, int, Ints]]:
    """Yields the batches that contain some of the patches (N,), numbered over all batches.

    For each batch it yields the batch, the number of its first patch, and which rows (m,) of
    `patch` are in the batch.
    """
    first = np.cumsum([0, *(batch.count for batch in batches)])
    batch_numbers = np.searchsorted(first, patch, side="right") - 1
    order = np.argsort(batch_numbers, kind="stable")
    ends = np.searchsorted(batch_numbers[order], np.arange(len(batches) + 1))
    for batch_number, batch in enumerate(batches):
        rows = order[ends[batch_number] : ends[batch_number + 1]]
        if len(rows):
            yield batch, int(first[batch_number]), rows


def evaluate_scattered_normals(
    batches: Sequence[Patches], patch: Ints, u: FloatArray, v: FloatArray
) -> tuple[FloatArray, int]:
    """Unit normals (N, 3) at parameters of patches, and how many of them are limits.

    A triangle has the parameters (u, v) of a tensor-product patch whose side v = 1 is one point:
    s = u (1 − v), t = v.
    """
    normals = np.empty((len(patch), 3))
    total_limits = 0
    for batch, first, rows in group_by_batch(batches, patch):
        index, u_of_batch, v_of_batch = patch[rows] - first, u[rows], v[rows]
        if isinstance(batch, TrianglePatches):
            normals[rows], limit_count = triangle_normals(
                batch, index, u_of_batch * (1.0 - v_of_batch), v_of_batch
            )
        else:
            normals[rows], limit_count = unit_normals(batch, index, u_of_batch, v_of_batch)
        total_limits += limit_count
    return normals, total_limits
