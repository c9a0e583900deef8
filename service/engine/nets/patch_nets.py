"""The patches of a model as nets about their own middles, and points of the patches.

The arithmetic is elementwise, in one order, on arrays whose last axis counts patches or points. So
the bits of the numbers of a patch do not depend on other patches.

Proof in docs/proofs.md: "Lowered splines".
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.engine.nets.nets import Nets, build_tensor_nets, group_nets, split_by_group
from service.engine.vectors import project
from service.surface.batches import Patches, TrianglePatches
from service.surface.lowered import PatchModel

CHUNK = 1 << 17
"""Numbers in the nets of one chunk: they stay in the processor's cache."""


@dataclass(frozen=True, eq=False, slots=True)
class PatchNets:
    """All patches of a model; triangular patches are tensor patches whose side v = 1 is one point.

    Attributes
    ----------
    groups : tuple of Nets
        One group for each degree of polynomial patches, and for each degree of rational ones.
    group, row : ndarray of int, shape (P,)
        Group and row of the net of each patch. Patches are numbered across the batches, as in
        `Seams`.
    middles : ndarray of float64, shape (3, P)
        Model coordinates that are subtracted from the control points of each patch.
    sizes : ndarray of float64, shape (P,)
        The largest absolute coordinate of each net, about its middle.
    lowering : float
        Bound of the distance between the patches and the surface of the request. It comes from the
        rounding of lowering, and from points that were made equal.
    """

    groups: tuple[Nets, ...]
    group: Ints
    row: Ints
    middles: FloatArray
    sizes: FloatArray
    lowering: float

    @classmethod
    def of(cls, model: PatchModel) -> "PatchNets":
        """The nets of all patches of a model."""
        count = model.patch_count
        middles, sizes = np.empty((3, count)), np.empty(count)
        parts, first = [], 0
        for batch in model.batches:
            patches = np.arange(first, first + batch.count)
            first += batch.count
            values, middles[:, patches], sizes[patches] = center_nets(batch)
            parts.append((patches, values))
        groups = group_nets(parts)
        group, row = np.empty((2, count), dtype=np.intp)
        for number, nets in enumerate(groups):
            group[nets.patches], row[nets.patches] = number, np.arange(len(nets.patches))
        return cls(groups, group, row, middles, sizes, bound_lowering_error(model) + model.moved)

    def replace_first(self, batch: Patches, lowering: float) -> "PatchNets":
        """The nets after the first batch, which alone has its degree, has become another one."""
        values, middles, sizes = center_nets(batch)
        first = replace(self.groups[0], values=values)
        return PatchNets(
            (first, *self.groups[1:]),
            self.group,
            self.row,
            np.concatenate([middles, self.middles[:, batch.count :]], axis=1),
            np.concatenate([sizes, self.sizes[batch.count :]]),
            lowering,
        )

    def split_by_group(self, patch: Ints) -> Iterator[tuple[Nets, Ints]]:
        """The groups that have some of the patches (m,), each with their indices in `patch`."""
        return split_by_group(self.groups, self.group[patch])

    def evaluate_points(self, patch: Ints, u: FloatArray, v: FloatArray) -> FloatArray:
        """Points (m, 3) of patches at parameters u, v in [0, 1], in model coordinates."""
        points = np.empty((3, len(patch)))
        for nets, indices in self._chunks(patch):
            ids = patch[indices]
            net = nets.values.take(self.row[ids], axis=3)
            p, q = nets.degree
            if p == q:  # one call for both directions is faster than two
                both = bernstein(p, np.concatenate([u[indices], v[indices]])).T
                along_u, along_v = both[:, : len(ids)], both[:, len(ids) :]
            else:
                along_u, along_v = bernstein(p, u[indices]).T, bernstein(q, v[indices]).T
            local = _combine(net, along_u, along_v)
            points[:, indices] = project(local) + self.middles.take(ids, axis=1)
        return np.ascontiguousarray(points.T)

    def _chunks(self, patch: Ints) -> Iterator[tuple[Nets, Ints]]:
        """As `split_by_group`, in runs whose nets have about `CHUNK` numbers together."""
        for nets, indices in self.split_by_group(patch):
            for chunk in row_slices(len(indices), nets.values[..., 0].size, CHUNK):
                yield nets, indices[chunk]


def bound_lowering_error(model: PatchModel) -> float:
    """Bound of the rounding in patches lowered from B-splines; 0 for others, which are as given."""
    if not model.control_nets:
        return 0.0
    points = np.concatenate([net.points.reshape(-1, 3) for net in model.control_nets])
    extent = float((points.max(axis=0) - points.min(axis=0)).max())
    return 2.0**-38 * extent + 2.0**-50 * float(np.abs(points).max())


def _combine(net: FloatArray, along_u: FloatArray, along_v: FloatArray) -> FloatArray:
    """Σ_i a_i Σ_j b_j P_ij, one term after another: net (p+1, q+1, D, m) to (D, m)."""
    lines = np.add.reduce(net * along_v[:, np.newaxis], axis=1)
    lines *= along_u[:, np.newaxis]
    total: FloatArray = np.add.reduce(lines, axis=0)
    return total


def center_nets(batch: Patches) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nets (p+1, q+1, D, k) about the patches' middles (3, k), and their sizes (k,)."""
    points = np.ascontiguousarray(np.moveaxis(batch.points, (0, -1), (-1, -2)))
    flat = points.reshape(-1, *points.shape[-2:])
    low, high = flat.min(axis=0), flat.max(axis=0)
    middles = low + (high - low) / 2
    values = points - middles
    sizes = np.abs(values).max(axis=tuple(range(values.ndim - 1)))
    if batch.weights is not None:
        weights = np.moveaxis(batch.weights, 0, -1)
        # Only the ratio of weights matters, and division by a power of two is exact.
        largest = weights.max(axis=tuple(range(weights.ndim - 1)))
        weights = np.ldexp(weights, -np.frexp(largest)[1])[..., np.newaxis, :]
        values = np.concatenate([values * weights, weights], axis=-2)
    if isinstance(batch, TrianglePatches):
        values = build_tensor_nets(values)
    return values, middles, sizes
