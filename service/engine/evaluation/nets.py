"""Nets of single patches, each relative to its middle and scaled, and their normal nets.

Nets of rational patches are homogeneous: (X, w) with X = w S.
"""

from collections.abc import Iterator
from functools import cached_property
from math import perm

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import multiply
from service.engine.extent import find_unit_scales
from service.engine.vectors import BEFORE, NEXT, project
from service.surface.batches import TensorPatches

PARTIALS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Orders of differentiation along u and along v: S, S_u, S_v, S_uu, S_uv, S_vv."""

CHUNK_BYTES = 8 << 20
"""The most memory for the nets of one group of samples."""

CHUNK_SAMPLES = 1024
"""The most samples that are computed together: it limits the memory if all are on one patch."""


class DerivativeNets:
    """The nets of K patches, each relative to its middle and scaled.

    `used` (K,) are the numbers of these patches in the batch.

    Attributes
    ----------
    point, du, dv : ndarray of float64, shape (K, d, …)
        The net of (S − middle) · scale, and the differences of neighbours along u and along v: the
        nets of the partials without the factors of the degrees. d is 3, or 4 for rational patches,
        whose nets are homogeneous.
    middle : ndarray of float64, shape (K, 3)
        The mean of the control points of each patch.
    scale : ndarray of float64, shape (K,)
        Powers of two.
    longest_u, longest_v : ndarray of float64, shape (K,)
        The lengths of the longest differences.
    collapsed : ndarray of bool, shape (K, 4)
        Which sides are one point.
    """

    def __init__(self, patches: TensorPatches, used: Ints) -> None:
        self.degree = patches.degree
        self.collapsed = patches.collapsed[used]
        points = patches.points[used]
        middle = points.mean(axis=(1, 2), keepdims=True)
        local = np.moveaxis(points - middle, -1, 1)
        # A power of two scales without rounding; a patch that is one point keeps scale 1.
        size = np.abs(local).max(axis=(1, 2, 3))
        self.middle: FloatArray = middle[:, 0, 0]
        self.scale: FloatArray = find_unit_scales(size)
        local = local * self.scale[:, None, None, None]
        self.is_rational = patches.weights is not None
        if patches.weights is not None:
            weights = patches.weights[used][:, None]
            weights = weights / weights.max(axis=(2, 3), keepdims=True)
            local = np.concatenate([local * weights, weights], axis=1)
        self.point: FloatArray = local
        self.du: FloatArray = np.diff(local, axis=2)
        self.dv: FloatArray = np.diff(local, axis=3)
        self._partial_nets: dict[tuple[int, int], FloatArray] = {}
        self.longest_u: FloatArray = longest_vectors(self.du[:, :3])
        self.longest_v: FloatArray = longest_vectors(self.dv[:, :3])

    @property
    def longest_product(self) -> FloatArray:
        """The product of the longest differences of each patch along u and along v, (K,)."""
        return self.longest_u * self.longest_v

    def partials(
        self,
        net_numbers: Ints,
        along_u: tuple[FloatArray, FloatArray],
        along_v: tuple[FloatArray, FloatArray],
    ) -> tuple[FloatArray, FloatArray]:
        """S_u and S_v at m parameters, up to positive factors, shapes (m, 3).

        For a rational patch they are X_u − S w_u and X_v − S w_v, which are w S_u and w S_v.

        Parameters
        ----------
        net_numbers : ndarray of int, shape (m,)
            The patch at each parameter, as its number among the K patches.
        along_u, along_v : pair of ndarray of float64
            The basis of degree n at the parameters, (m, n+1), and the basis of degree n − 1.
        """
        du = evaluate_at(self.du, net_numbers, along_u[1], along_v[0])
        dv = evaluate_at(self.dv, net_numbers, along_u[0], along_v[1])
        if self.is_rational:
            point = evaluate_at(self.point, net_numbers, along_u[0], along_v[0])
            position = project(point, -1)
            du = du[:, :3] - position * du[:, 3:]
            dv = dv[:, :3] - position * dv[:, 3:]
        return du, dv

    def partial_net(self, i: int, j: int) -> FloatArray | None:
        """The net (K, d, p−i+1, q−j+1) of the partial ∂^{i+j}/∂u^i ∂v^j, differenced in float64.

            p!/(p−i)! q!/(q−j)! Δ_u^i Δ_v^j P

        The result is None if the partial is zero because i > p or j > q.
        """
        p, q = self.degree
        if i > p or j > q:
            return None
        if (i, j) not in self._partial_nets:
            factor = perm(p, i) * perm(q, j)
            net = np.diff(np.diff(self.point, i, axis=2), j, axis=3)
            self._partial_nets[i, j] = net * float(factor)
        return self._partial_nets[i, j]

    @cached_property
    def normal_net(self) -> FloatArray:
        """N = S_u × S_v in the Bernstein basis, up to a positive factor; shape (K, 3, …).

        For a polynomial patch, its degree is (2p−1, 2q−1). For a rational patch, the result is the
        net of w³ N, of degree (3p−1, 3q−1):

            w X_u × X_v + w_u X_v × X + w_v X × X_u
        """
        if not self.is_rational:
            return cross_polynomial(self.du, self.dv)
        x, w = self.point[:, :3], self.point[:, 3:]
        (xu, wu), (xv, wv) = (self.du[:, :3], self.du[:, 3:]), (self.dv[:, :3], self.dv[:, 3:])
        return (
            multiply(w, cross_polynomial(xu, xv))
            + multiply(wu, cross_polynomial(xv, x))
            + multiply(wv, cross_polynomial(x, xu))
        )


def nets_of_samples(
    patches: TensorPatches, index: Ints
) -> Iterator[tuple[DerivativeNets, Ints, Ints]]:
    """Yields the nets of the patches of m samples, for some samples at a time.

    Sample k is on patch `index[k]`.

    Yields
    ------
    nets : DerivativeNets
    rows : ndarray of int, shape (r,)
        The numbers of r samples: rows of `index`. Each sample occurs in one item only.
    net_numbers : ndarray of int, shape (r,)
        For each of these samples, the number of its patch in `nets`.
    """
    p, q = patches.degree
    # The largest net is the normal net of a rational patch, of degree (3p − 1, 3q − 1). The memory
    # for it and its terms is estimated as three such nets, of 4 coordinates of 8 bytes.
    net_bytes = 8 * 4 * 3 * (3 * p + 1) * (3 * q + 1)
    for rows in _group_samples(index, max(1, CHUNK_BYTES // net_bytes)):
        used, net_numbers = np.unique(index[rows], return_inverse=True)
        nets = DerivativeNets(patches, used)
        for first in range(0, len(rows), CHUNK_SAMPLES):
            part = slice(first, first + CHUNK_SAMPLES)
            yield nets, rows[part], net_numbers[part]


def _group_samples(index: Ints, step: int) -> Iterator[Ints]:
    """Groups of samples that are computed together: all of one patch, or a few of several patches.

    The samples of a patch with more than `step` samples are a group, so that the nets of this patch
    are prepared once. All other groups have at most `step` samples.
    """
    order = np.argsort(index, kind="stable")
    _, first, counts = np.unique(index[order], return_index=True, return_counts=True)
    has_many = counts > step
    for begin, count in zip(first[has_many].tolist(), counts[has_many].tolist(), strict=True):
        yield order[begin : begin + count]
    remaining = order[~np.repeat(has_many, counts)]
    for begin in range(0, len(remaining), step):
        yield remaining[begin : begin + step]


def evaluate_along(nets: FloatArray, net_numbers: Ints, basis: FloatArray) -> FloatArray:
    """Nets of polynomials in v, (r, d, q+1): row k is net `net_numbers[k]` at u = u_k.

    `nets` has the shape (K, d, p+1, q+1). Row k of `basis` (r, p+1) is the Bernstein basis at u_k.
    """
    if len(nets) == 1:
        d, rows, columns = nets.shape[1:]
        row_vectors = np.moveaxis(nets[0], 1, 0).reshape(rows, d * columns)
        polynomials_of_one_net: FloatArray = (basis @ row_vectors).reshape(len(basis), d, columns)
        return polynomials_of_one_net
    polynomials: FloatArray = np.einsum("ri,rdij->rdj", basis, nets[net_numbers], optimize=True)
    return polynomials


def evaluate_at(
    nets: FloatArray, net_numbers: Ints, along_u: FloatArray, along_v: FloatArray
) -> FloatArray:
    """Values (r, d): row k is the polynomial of net `net_numbers[k]` at (u_k, v_k).

    `nets` has the shape (K, d, p+1, q+1). Row k of `along_u` (r, p+1) is the Bernstein basis at
    u_k, and row k of `along_v` (r, q+1) that at v_k.
    """
    values: FloatArray = np.einsum(
        "rdj,rj->rd", evaluate_along(nets, net_numbers, along_u), along_v
    )
    return values


def longest_vectors(nets: FloatArray) -> FloatArray:
    """Longest length among the vectors of each net (K, 3, …): shape (K,)."""
    lengths: FloatArray = np.sqrt(np.square(nets).sum(axis=1).max(axis=(1, 2)))
    return lengths


def cross_polynomial(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product a × b of vector polynomials (K, 3, …), K patches, in the Bernstein basis."""
    product = multiply(a[:, NEXT], b[:, BEFORE])
    product -= multiply(a[:, BEFORE], b[:, NEXT])
    return product
