"""The patches of a model, ready to be evaluated anywhere, each by itself.

Here the number of the part, of the place or of the patch is the last axis of every array, and all
arithmetic is elementwise, in one order. So what is computed for a patch has the same bits whatever
is computed beside it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.bases.triangle import degree_of, row_starts
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel

CHUNK = 1 << 17
"""Numbers that are worked on at a time: they stay in the processor's cache."""


@dataclass(frozen=True, eq=False)
class Nets:
    """Tensor-product nets of one degree (p, q), each about the middle of its own box.

    Attributes
    ----------
    patches : ndarray of int, shape (k,)
        Their numbers.
    values : ndarray of float64, shape (p+1, q+1, 3, k), or (p+1, q+1, 4, k) if rational
        Points, or (w x, w y, w z, w) with weights of at most 1. Model units.
    """

    patches: Ints
    values: FloatArray

    @property
    def degree(self) -> tuple[int, int]:
        """Degree (p, q)."""
        return self.values.shape[0] - 1, self.values.shape[1] - 1

    @property
    def rational(self) -> bool:
        """Whether there are weights."""
        return int(self.values.shape[2]) == 4

    @cached_property
    def items(self) -> FloatArray:
        """The nets one after another, shape (k, D, p+1, q+1)."""
        return np.ascontiguousarray(self.values.transpose(3, 2, 0, 1))

    def take(self, rows: Ints) -> FloatArray:
        """The nets in these rows, shape (p+1, q+1, D, m)."""
        return self.values.take(rows, axis=3)


@dataclass(frozen=True, eq=False, slots=True)
class PatchNets:
    """All patches of a model; triangles as tensor patches of which the side v = 1 is one point.

    Attributes
    ----------
    groups : tuple of Nets
        The nets, by degree.
    group, row : ndarray of int, shape (P,)
        Where the net of each patch is. Patches are numbered across the batches, as in `Seams`.
    middles : ndarray of float64, shape (3, P)
        What the nets are about.
    sizes : ndarray of float64, shape (P,)
        No coordinate of a net is further from its middle.
    lowering : float
        No patch is further than this from the surface that it was made of, for rounding and for
        points that were made equal.
    """

    groups: tuple[Nets, ...]
    group: Ints
    row: Ints
    middles: FloatArray
    sizes: FloatArray
    lowering: float

    @classmethod
    def of(cls, model: PatchModel) -> "PatchNets":
        """The ground of a model."""
        count = model.patch_count
        middles, sizes = np.empty((3, count)), np.empty(count)
        found: dict[tuple[int, ...], list[tuple[Ints, FloatArray]]] = {}
        first = 0
        for batch in model.batches:
            patches = np.arange(first, first + batch.count)
            first += batch.count
            values, middles[:, patches], sizes[patches] = _local(batch)
            found.setdefault(values.shape[:3], []).append((patches, values))
        group, row = np.empty((2, count), dtype=np.intp)
        groups = []
        for number, members in enumerate(found.values()):
            patches = np.concatenate([ids for ids, _ in members])
            group[patches], row[patches] = number, np.arange(len(patches))
            groups.append(Nets(patches, np.concatenate([net for _, net in members], axis=3)))
        return cls(tuple(groups), group, row, middles, sizes, lowering_error(model) + model.moved)

    def by_group(self, patch: Ints) -> Iterator[tuple[Nets, Ints]]:
        """The groups that patches (m,) belong to, each with which of the m are of it."""
        if len(self.groups) == 1:
            yield self.groups[0], np.arange(len(patch))
            return
        number = self.group[patch]
        for k, nets in enumerate(self.groups):
            here = (number == k).nonzero()[0]
            if len(here):
                yield nets, here

    def positions(self, patch: Ints, u: FloatArray, v: FloatArray) -> FloatArray:
        """Points of the surface at parameters of patches, shape (m, 3), model coordinates."""
        points = np.empty((3, len(patch)))
        for nets, here in self._chunks(patch):
            ids = patch[here]
            net = nets.take(self.row[ids])
            p, q = nets.degree
            place = _combined(net, bernstein(p, u[here]).T, bernstein(q, v[here]).T)
            if nets.rational:
                place = place[:3] / place[3]
            points[:, here] = place + self.middles[:, ids]
        return np.ascontiguousarray(points.T)

    def partials(self, patch: Ints, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """S_u and S_v at parameters of patches, shapes (m, 3).

        The net is differenced before it is evaluated; where it is homogeneous, X, then
        S_u = (X_u − w_u S) / w.
        """
        along = np.empty((2, 3, len(patch)))
        for nets, here in self._chunks(patch):
            net = nets.take(self.row[patch[here]])
            p, q = nets.degree
            bases = bernstein(p, u[here]).T, bernstein(q, v[here]).T
            slopes = [
                p * _combined(net[1:] - net[:-1], bernstein(p - 1, u[here]).T, bases[1]),
                q * _combined(net[:, 1:] - net[:, :-1], bases[0], bernstein(q - 1, v[here]).T),
            ]
            if nets.rational:
                place = _combined(net, *bases)
                point = place[:3] / place[3]
                slopes = [(slope[:3] - slope[3] * point) / place[3] for slope in slopes]
            along[0][:, here], along[1][:, here] = slopes
        return np.ascontiguousarray(along[0].T), np.ascontiguousarray(along[1].T)

    def _chunks(self, patch: Ints) -> Iterator[tuple[Nets, Ints]]:
        """The same as `by_group`, so few places at a time that their nets stay small."""
        for nets, here in self.by_group(patch):
            for rows in row_slices(len(here), nets.values[..., 0].size, CHUNK):
                yield nets, here[rows]


def lowering_error(model: PatchModel) -> float:
    """What rounding may have done to the patches of a B-spline; all others are what was given.

    A Bézier point is M + Σ c_i w_i (P_i − M) / Σ c_i w_i over p + 1 control points and then q + 1,
    M near them. The c_i come of 2 p convex combinations the factors of which have 3 roundings, so
    they are right to 10 p ε/2, and a few more for means and sums; up to degree 64 that is 2^-40.
    The shares at the ends of a closed curve may be made equal, which changes them by 2^-41
    (`SAME_SHARE`). Two directions, numerator and denominator: 2^-38 of the extent of the control
    points. Adding M rounds once a direction, relative to the coordinate.
    """
    if not model.control_nets:
        return 0.0
    points = np.concatenate([net.points.reshape(-1, 3) for net in model.control_nets])
    extent = float((points.max(axis=0) - points.min(axis=0)).max())
    return 2.0**-38 * extent + 2.0**-50 * float(np.abs(points).max())


def _combined(net: FloatArray, along_u: FloatArray, along_v: FloatArray) -> FloatArray:
    """Σ_i a_i Σ_j b_j P_ij, one term after another: net (p+1, q+1, D, m) to (D, m)."""
    lines = np.add.reduce(net * along_v[:, np.newaxis], axis=1)
    lines *= along_u[:, np.newaxis]
    total: FloatArray = np.add.reduce(lines, axis=0)
    return total


def _local(batch: Patches) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nets (p+1, q+1, D, k) about the patches' middles (3, k), and how large they are (k,)."""
    points = np.ascontiguousarray(np.moveaxis(batch.points, (0, -1), (-1, -2)))
    flat = points.reshape(-1, *points.shape[-2:])
    low, high = flat.min(axis=0), flat.max(axis=0)
    middles = low + (high - low) / 2
    values = points - middles
    sizes = np.abs(values).max(axis=tuple(range(values.ndim - 1)))
    if batch.weights is not None:
        weights = np.moveaxis(batch.weights, 0, -1)
        # Only the ratio of weights matters, and a power of two costs no digit.
        largest = weights.max(axis=tuple(range(weights.ndim - 1)))
        weights = np.ldexp(weights, -np.frexp(largest)[1])[..., np.newaxis, :]
        values = np.concatenate([values * weights, weights], axis=-2)
    if isinstance(batch, TrianglePatches):
        values = _squared(values)
    return values, middles, sizes


def _squared(nets: FloatArray) -> FloatArray:
    """Triangular nets (K, D, k) as tensor nets (n+1, n+1, D, k), with s = u (1 − v) and t = v.

    Row j of a triangle, a curve of degree n − j, becomes column j of the square by raising its
    degree to n, one by one: P*_i = (i P_{i−1} + (d − i) P_i) / d for i = 0 … d.
    """
    n = degree_of(len(nets))
    starts = row_starts(n)
    square = np.empty((n + 1, n + 1, *nets.shape[1:]))
    for j in range(n + 1):
        row = nets[starts[j] : starts[j + 1]]
        while len(row) <= n:
            d = len(row)
            share = (np.arange(1, d) / d)[:, np.newaxis, np.newaxis]
            raised = np.empty((d + 1, *row.shape[1:]))
            raised[0], raised[d] = row[0], row[-1]
            raised[1:d] = share * row[:-1] + (1.0 - share) * row[1:]
            row = raised
        square[:, j] = row
    return square
