"""Nets of triangular patches about their middles, nets of their partials, and their parameters."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases import triangle
from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.extent import find_unit_scales
from service.surface.batches import TrianglePatches

CHUNK_POINTS = 1 << 18
"""The most control points in one chunk, even if each of its samples is on a patch of its own."""


def partial_nets(nets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nets of S_s / n and S_t / n, of degree n − 1, from nets (K, …) of degree n.

    A net has K control points, in the order of `service.bases.triangle`.

        S_s / n: b_{i,j+1,k} − b_{i+1,j,k}    S_t / n: b_{i,j,k+1} − b_{i+1,j,k}

    References
    ----------
    Farin, Curves and Surfaces for CAGD, 5th ed., section 17.4.
    """
    corner, along, above = neighbour_rows(len(nets))
    return nets[along] - nets[corner], nets[above] - nets[corner]


def find_partial_nets(net: FloatArray, order: int = 2) -> dict[tuple[int, int], FloatArray]:
    """Nets of all partials up to an order 0, 1 or 2, by their orders along s and t.

    Those that vanish, because the degree of the net (K, …) is too low, are left out.
    """
    nets = {(0, 0): net}
    if order > 0:
        nets[1, 0], nets[0, 1] = _differentiate(net)
    if order > 1 and len(net) > 3:
        nets[2, 0], nets[1, 1] = _differentiate(nets[1, 0])
        _, nets[0, 2] = _differentiate(nets[0, 1])
    return nets


def _differentiate(net: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The nets of both first partials."""
    degree = triangle.degree_of(len(net))
    along_s, along_t = partial_nets(net)
    return degree * along_s, degree * along_t


def to_barycentric(s: FloatArray, t: FloatArray) -> FloatArray:
    """Barycentric coordinates (r, s, t) with r = 1 − s − t, shape (m, 3).

    If rounding makes s + t larger than 1, r is 0.
    """
    return np.stack([np.maximum(1.0 - s - t, 0.0), s, t], axis=1)


def neighbour_rows(count: int) -> tuple[Ints, Ints, Ints]:
    """Rows of b_{i+1,j,k}, b_{i,j+1,k} and b_{i,j,k+1} in a net of `count` control points.

    The result is three arrays, one row for each upright triangle of neighbours in the net, in the
    order of the control points of a net of degree n − 1.
    """
    degree = triangle.degree_of(count)
    corner = np.delete(np.arange(count), triangle.side_rows(degree)[1])
    above = triangle.row_starts(degree)[1] + np.arange(len(corner))
    return corner, corner + 1, above


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
    patches: TrianglePatches, index: Ints
) -> Iterator[tuple[LocalTriangles, Ints, Ints]]:
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


def localize(patches: TrianglePatches) -> LocalTriangles:
    """The patches relative to their middles, each scaled by a power of two."""
    middle = patches.points.mean(axis=1, keepdims=True)
    points = patches.points - middle
    size = np.abs(points).max(axis=(1, 2), keepdims=True)
    scale = find_unit_scales(size)
    local = TrianglePatches(points * scale, patches.weights)
    return LocalTriangles(local, middle[:, 0], scale[:, 0, 0])


def tensor_u(patches: TrianglePatches, patch_numbers: Ints, barycentric: FloatArray) -> FloatArray:
    """The parameter u = s / (r + s) of barycentric coordinates (m, 3) in the tensor-product form.

    At the corner t = 1, where r + s = 0, u chooses the direction from which a limit is taken. If
    one of the two sides at the corner is a point, u is on the other side; else u is 1/2.
    """
    r, s, _ = barycentric.T
    sides = patches.collapsed[patch_numbers]
    u_at_corner = (1.0 + sides[:, 0] - sides[:, 1]) / 2.0
    is_regular = r + s > 0
    return np.where(is_regular, s / np.where(is_regular, r + s, 1.0), u_at_corner)
