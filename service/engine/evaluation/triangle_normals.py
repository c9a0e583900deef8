"""Unit normals at any parameter of a triangular patch, degenerate points included.

The normal is the unit vector of S_s × S_t. Where that vector vanishes, the normal is the limit of
the same surface as a tensor-product patch (`normals`). These functions are slow:
`triangle_evaluation` uses them only for samples whose normals are doubtful.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.bases import triangle_basis
from service.bases.arrays import Bools, FloatArray
from service.bases.homogeneous import to_homogeneous
from service.bases.row_batches import row_slices
from service.engine.evaluation.degenerate import VANISHING
from service.engine.evaluation.normals import unit_normals
from service.engine.evaluation.triangle_nets import partial_nets, to_barycentric
from service.engine.extent import powers_of_two
from service.engine.vectors import cross
from service.surface.batches import TrianglePatches

CHUNK_NUMBERS = 1 << 18
"""Control points in one chunk."""


def triangle_normals(
    patches: TrianglePatches, index: NDArray[np.intp], s: FloatArray, t: FloatArray
) -> tuple[FloatArray, int]:
    """Unit normals of patch `index[m]` at (s[m], t[m]), and how many of them are limits.

    Parameters
    ----------
    patches : TrianglePatches
    index : ndarray of int, shape (m,)
    s, t : ndarray of float64, shape (m,)
        From 0, with a sum of at most 1.

    Returns
    -------
    normals : ndarray of float64, shape (m, 3)
        Unit length, never NaN.
    limits : int
        Samples at which S_s × S_t vanishes.
    """
    normals, vanishes = normals_at(patches, index, s, t)
    return normals, int(np.count_nonzero(vanishes))


def normals_at(
    patches: TrianglePatches, index: NDArray[np.intp], s: FloatArray, t: FloatArray
) -> tuple[FloatArray, Bools]:
    """Unit normals of triangles at (s, t), and whether S_s × S_t vanishes at each place."""
    normals = np.empty((len(index), 3))
    vanishes = np.empty(len(index), dtype=bool)
    for local, rows, which in triangles_of_samples(patches, index):
        regular = _find_regular_normals(local.patches, which, s[rows], t[rows])
        normals[rows], vanishes[rows] = regular
    zero = np.flatnonzero(vanishes)
    if len(zero):
        # All limits in one call: the preparation of a patch of high degree takes half of the time.
        used, which = np.unique(index[zero], return_inverse=True)
        around = localize(patches.take(used)).patches
        u = tensor_u(around, which, to_barycentric(s[zero], t[zero]))
        normals[zero], _ = unit_normals(around.to_tensor(), which, u, t[zero])
    return normals, vanishes


@dataclass(frozen=True, eq=False, slots=True)
class LocalTriangles:
    """Some patches as (S − middle) · scale: their own middles (K, 3) and scales (K,).

    Raising the degree rounds; about the middle, the error depends on the size of the patch and not
    on its distance from zero.
    """

    patches: TrianglePatches
    middle: FloatArray
    scale: FloatArray


def triangles_of_samples(
    patches: TrianglePatches, index: NDArray[np.intp]
) -> Iterator[tuple[LocalTriangles, NDArray[np.intp], NDArray[np.intp]]]:
    """The patches that samples of patches `index` (m,) need, some samples at a time.

    Yields
    ------
    local : LocalTriangles
    rows : ndarray of int, shape (r,)
        Rows of `index`; each comes once.
    which : ndarray of int, shape (r,)
        The row of `local` for each of them.
    """
    order = np.argsort(index, kind="stable")
    for part in row_slices(len(order), patches.points.shape[1], CHUNK_NUMBERS):
        rows = order[part]
        used, which = np.unique(index[rows], return_inverse=True)
        yield localize(patches.take(used)), rows, which


def _find_regular_normals(
    local: TrianglePatches, which: NDArray[np.intp], s: FloatArray, t: FloatArray
) -> tuple[FloatArray, Bools]:
    """Unit vectors of S_s × S_t for rows `which` of local patches, and where S_s × S_t vanishes."""
    places = to_barycentric(s, t)
    nets = to_homogeneous(local.points, local.weights).swapaxes(0, 1)
    along = partial_nets(nets)
    below = triangle_basis.triangle_bernstein(local.degree - 1, places)
    ds, dt = (_sums(below, net, which) for net in along)
    if local.weights is not None:
        basis = triangle_basis.triangle_bernstein(local.degree, places)
        at = _sums(basis, nets, which)
        place = at[:, :3] / at[:, 3:]
        ds = ds[:, :3] - place * ds[:, 3:]
        dt = dt[:, :3] - place * dt[:, 3:]
    vectors = cross(ds, dt)
    length, length_s, length_t = (np.linalg.norm(rows, axis=-1) for rows in (vectors, ds, dt))
    longest_s, longest_t = (_longest_vectors(net)[which] for net in along)
    vanishes: Bools = length <= VANISHING * length_s * length_t
    vanishes |= length_s <= VANISHING * longest_s
    vanishes |= length_t <= VANISHING * longest_t
    length[vanishes] = 1.0
    return vectors / length[:, None], vanishes


def _sums(basis: FloatArray, nets: FloatArray, which: NDArray[np.intp]) -> FloatArray:
    """Values (m, d) of nets (K, P, d): value k is of net `which[k]`."""
    if nets.shape[1] == 1:
        return basis.T @ nets[:, 0]
    values: FloatArray = np.einsum("km,kmd->md", basis, nets[:, which])
    return values


def localize(patches: TrianglePatches) -> LocalTriangles:
    """The patches, each moved to its middle and scaled."""
    middle = patches.points.mean(axis=1, keepdims=True)
    points = patches.points - middle
    size = np.abs(points).max(axis=(1, 2), keepdims=True)
    scale = powers_of_two(size)
    local = TrianglePatches(points * scale, patches.weights)
    return LocalTriangles(local, middle[:, 0], scale[:, 0, 0])


def tensor_u(patches: TrianglePatches, which: NDArray[np.intp], places: FloatArray) -> FloatArray:
    """The parameter u = s / (r + s) of barycentric places in the tensor-product form.

    At the corner t = 1 it is the direction from which the limit is taken: along a side if the other
    side is a point, else from the middle.
    """
    r, s, _ = places.T
    sides = patches.collapsed[which]
    middle = (1.0 + sides[:, 0] - sides[:, 1]) / 2.0
    inside = r + s > 0
    return np.where(inside, s / np.where(inside, r + s, 1.0), middle)


def _longest_vectors(nets: FloatArray) -> FloatArray:
    """Longest length among the vectors of each net: (K, P, d) to (P,)."""
    lengths: FloatArray = np.sqrt(np.square(nets[..., :3]).sum(axis=-1).max(axis=0))
    return lengths
