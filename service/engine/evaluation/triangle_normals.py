"""Unit normals at any parameter of a triangular patch, degenerate points included.

The normal is the unit vector of S_s × S_t. Where that vector vanishes, the normal is the limit of
the same surface as a tensor-product patch (`normals`). These functions are slow: for all
samples of a patch, `triangle_evaluation` calls them only where its own normals are too imprecise.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.bases import triangle_basis
from service.bases.affine_combination import to_homogeneous
from service.bases.arrays import Bools, FloatArray
from service.bases.row_batches import row_slices
from service.engine.evaluation.degenerate import VANISHING
from service.engine.evaluation.normals import unit_normals
from service.engine.evaluation.triangle_nets import partial_nets, to_barycentric
from service.engine.extent import find_unit_scales
from service.engine.vectors import cross, length, project
from service.surface.batches import TrianglePatches

CHUNK_POINTS = 1 << 18
"""The most control points in one chunk, even if each of its samples is on a patch of its own."""


def triangle_normals(
    patches: TrianglePatches, index: NDArray[np.intp], s: FloatArray, t: FloatArray
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
    patches: TrianglePatches, index: NDArray[np.intp], s: FloatArray, t: FloatArray
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


@dataclass(frozen=True, eq=False, slots=True)
class LocalTriangles:
    """K patches as (S − middle) · scale, with the `middle` (K, 3) and the `scale` (K,) of each.

    Converting to a tensor-product patch raises the degree, which rounds. If points are relative to
    the middle, the rounding error depends on the size of the patch and not on its distance from
    zero.
    """

    patches: TrianglePatches
    middle: FloatArray
    scale: FloatArray


def triangles_of_samples(
    patches: TrianglePatches, index: NDArray[np.intp]
) -> Iterator[tuple[LocalTriangles, NDArray[np.intp], NDArray[np.intp]]]:
    """Yields the patches of m samples, for some samples at a time.

    Sample k is on patch `index[k]`.

    Yields
    ------
    local : LocalTriangles
    rows : ndarray of int, shape (r,)
        The numbers of r samples: rows of `index`. Each sample occurs in one item only.
    patch_numbers : ndarray of int, shape (r,)
        For each of these samples, the number of its patch in `local`.
    """
    order = np.argsort(index, kind="stable")
    for part in row_slices(len(order), patches.points.shape[1], CHUNK_POINTS):
        rows = order[part]
        used, patch_numbers = np.unique(index[rows], return_inverse=True)
        yield localize(patches.take(used)), rows, patch_numbers


def _find_regular_normals(
    local: TrianglePatches, patch_numbers: NDArray[np.intp], s: FloatArray, t: FloatArray
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


def _combine(basis: FloatArray, nets: FloatArray, patch_numbers: NDArray[np.intp]) -> FloatArray:
    """Values (m, d) at m parameters: value k is net `patch_numbers[k]` times column k of the basis.

    `nets` (K, P, d) are P nets of K control points; `basis` has the shape (K, m).
    """
    if nets.shape[1] == 1:
        return basis.T @ nets[:, 0]
    values: FloatArray = np.einsum("km,kmd->md", basis, nets[:, patch_numbers])
    return values


def localize(patches: TrianglePatches) -> LocalTriangles:
    """The patches relative to their middles, each scaled by a power of two."""
    middle = patches.points.mean(axis=1, keepdims=True)
    points = patches.points - middle
    size = np.abs(points).max(axis=(1, 2), keepdims=True)
    scale = find_unit_scales(size)
    local = TrianglePatches(points * scale, patches.weights)
    return LocalTriangles(local, middle[:, 0], scale[:, 0, 0])


def tensor_u(
    patches: TrianglePatches, patch_numbers: NDArray[np.intp], barycentric: FloatArray
) -> FloatArray:
    """The parameter u = s / (r + s) of barycentric coordinates (m, 3) in the tensor-product form.

    At the corner t = 1, where r + s = 0, u chooses the direction from which a limit is taken. If
    one of the two sides at the corner is a point, u is on the other side; else u is 1/2.
    """
    r, s, _ = barycentric.T
    sides = patches.collapsed[patch_numbers]
    u_at_corner = (1.0 + sides[:, 0] - sides[:, 1]) / 2.0
    is_regular = r + s > 0
    return np.where(is_regular, s / np.where(is_regular, r + s, 1.0), u_at_corner)


def _longest_vectors(nets: FloatArray) -> FloatArray:
    """Longest length among the vectors of each net: (K, P, d) to (P,)."""
    lengths: FloatArray = np.sqrt(np.square(nets[..., :3]).sum(axis=-1).max(axis=0))
    return lengths
