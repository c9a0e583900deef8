"""Nets of single patches, each moved to its middle and scaled, and their normal nets."""

from collections.abc import Iterator
from functools import cached_property
from math import perm

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray
from service.bases.bernstein import multiply
from service.engine.extent import powers_of_two
from service.engine.vectors import cross_polynomial
from service.surface.batches import TensorPatches

PARTIALS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Orders of differentiation along u and along v: S, S_u, S_v, S_uu, S_uv, S_vv."""

CHUNK_BYTES = 8 << 20
"""Working memory for one round of gathered nets."""

CHUNK_SAMPLES = 1024
"""Samples of one patch in one round."""


class DerivativeNets:
    """Homogeneous nets of some patches, each moved to its middle and scaled.

    `point`, `du`, `dv` have shape (K, d, …) with d = 3, or 4 if rational, and are those of (S −
    middle) · scale; `middle` (K, 3), `scale` (K,) powers of two. `du` and `dv` are differences of
    neighbours: the partials without the factor of the degree. `longest_u`, `longest_v` (K,) are the
    lengths of the longest differences; `collapsed` (K, 4) marks the sides that are one point.
    """

    def __init__(self, patches: TensorPatches, used: NDArray[np.intp]) -> None:
        self.degree = patches.degree
        self.collapsed = patches.collapsed[used]
        points = patches.points[used]
        middle = points.mean(axis=(1, 2), keepdims=True)
        local = np.moveaxis(points - middle, -1, 1)
        # A power of two scales without rounding; a patch that is one point keeps scale 1.
        size = np.abs(local).max(axis=(1, 2, 3))
        self.middle: FloatArray = middle[:, 0, 0]
        self.scale: FloatArray = powers_of_two(size)
        local = local * self.scale[:, None, None, None]
        self.rational = patches.weights is not None
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
    def measure(self) -> FloatArray:
        """Upper bound of |S_u| |S_v| for each patch, without the effect of weights."""
        return self.longest_u * self.longest_v

    def partials(
        self,
        which: NDArray[np.intp],
        along_u: tuple[FloatArray, FloatArray],
        along_v: tuple[FloatArray, FloatArray],
    ) -> tuple[FloatArray, FloatArray]:
        """S_u and S_v up to positive factors at one parameter each, shapes (m, 3).

        For a rational patch X_u − S w_u and X_v − S w_v, without a second division.
        """
        du = evaluate_at(self.du, which, along_u[1], along_v[0])
        dv = evaluate_at(self.dv, which, along_u[0], along_v[1])
        if self.rational:
            point = evaluate_at(self.point, which, along_u[0], along_v[0])
            place = point[:, :3] / point[:, 3:]
            du = du[:, :3] - place * du[:, 3:]
            dv = dv[:, :3] - place * dv[:, 3:]
        return du, dv

    def partial_net(self, i: int, j: int) -> FloatArray | None:
        """Net (K, d, p−i+1, q−j+1) of ∂^{i+j}/∂u^i ∂v^j, differenced in float64; None for zero.

        p!/(p−i)! q!/(q−j)! Δ_u^i Δ_v^j P
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

        Polynomial: degree (2p−1, 2q−1). Rational: degree (3p−1, 3q−1), and times w³

            w X_u × X_v + w_u X_v × X + w_v X × X_u
        """
        if not self.rational:
            return cross_polynomial(self.du, self.dv)
        x, w = self.point[:, :3], self.point[:, 3:]
        (xu, wu), (xv, wv) = (self.du[:, :3], self.du[:, 3:]), (self.dv[:, :3], self.dv[:, 3:])
        return (
            multiply(w, cross_polynomial(xu, xv))
            + multiply(wu, cross_polynomial(xv, x))
            + multiply(wv, cross_polynomial(x, xu))
        )


def nets_of_samples(
    patches: TensorPatches, index: NDArray[np.intp]
) -> Iterator[tuple[DerivativeNets, NDArray[np.intp], NDArray[np.intp]]]:
    """The nets that samples of patches `index` (m,) need, some samples at a time.

    Yields
    ------
    nets : PatchNets
    rows : ndarray of int, shape (r,)
        Rows of `index`; each comes once.
    which : ndarray of int, shape (r,)
        The row of `nets` for each of them.
    """
    p, q = patches.degree
    net_bytes = 8 * 4 * 3 * (3 * p + 1) * (3 * q + 1)
    for rows in _rounds(index, max(1, CHUNK_BYTES // net_bytes)):
        used, which = np.unique(index[rows], return_inverse=True)
        nets = DerivativeNets(patches, used)
        for first in range(0, len(rows), CHUNK_SAMPLES):
            part = slice(first, first + CHUNK_SAMPLES)
            yield nets, rows[part], which[part]


def _rounds(index: NDArray[np.intp], step: int) -> Iterator[NDArray[np.intp]]:
    """Groups of samples that are computed together: all of one patch, or a few of several patches.

    The nets of a patch with many samples are prepared once and need not be gathered.
    """
    order = np.argsort(index, kind="stable")
    _, first, counts = np.unique(index[order], return_index=True, return_counts=True)
    many = counts > step
    for begin, count in zip(first[many].tolist(), counts[many].tolist(), strict=True):
        yield order[begin : begin + count]
    rest = order[~np.repeat(many, counts)]
    for begin in range(0, len(rest), step):
        yield rest[begin : begin + step]


def evaluate_along(nets: FloatArray, which: NDArray[np.intp], basis: FloatArray) -> FloatArray:
    """Polynomials (K, d, m, n) at a value of their first parameter: row k with row k (r, d, n)."""
    if len(nets) == 1:
        d, m, n = nets.shape[1:]
        flat = np.moveaxis(nets[0], 1, 0).reshape(m, d * n)
        line: FloatArray = (basis @ flat).reshape(len(basis), d, n)
        return line
    fixed: FloatArray = np.einsum("ri,rdij->rdj", basis, nets[which], optimize=True)
    return fixed


def evaluate_at(
    nets: FloatArray, which: NDArray[np.intp], along_u: FloatArray, along_v: FloatArray
) -> FloatArray:
    """Polynomials (K, d, m, n) at one parameter each, from bases (r, m) and (r, n): (r, d)."""
    values: FloatArray = np.einsum("rdj,rj->rd", evaluate_along(nets, which, along_u), along_v)
    return values


def longest_vectors(nets: FloatArray) -> FloatArray:
    """Longest length among the vectors of each net (K, 3, …): shape (K,)."""
    lengths: FloatArray = np.sqrt(np.square(nets).sum(axis=1).max(axis=(1, 2)))
    return lengths
