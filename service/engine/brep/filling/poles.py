"""Poles: edges that are one point of space get samples where the triangles beside them need some.

At a pole all places of a side of the surface are one point. Samples there have one vertex, but
different places, so that triangles beside the pole are long and few.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.brep.borders.border import Polygons
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.halving import insert_samples
from service.engine.brep.filling.inner_points import LeafPoints
from service.engine.brep.prepared import PreparedBrep

NEAR = 2.0
"""Units of places: points nearer than this to the line of a pole are on it, and those nearer to a
sample are left out."""

REACH = 1.5
"""Corners of polygons are near a pole up to this many sides of the leaves there."""


def split_poles(
    prepared: PreparedBrep, samples: EdgeSamples, leaves: LeafPoints, border: Polygons
) -> tuple[EdgeSamples, Ints] | None:
    """Insert samples of poles where leaves of their faces end, and across from near corners.

    A corner of a polygon is near if it is not further from the pole than the leaves there reach.
    Without a sample across from it, a triangle at the pole would be beside two triangles of the
    mesh, and near neither of them. Such samples replace those of the leaves beside them.

    Returns
    -------
    samples : EdgeSamples
    source : ndarray of int, shape (T,)
        The old number of each sample; −1 for new samples. None if no sample is new.
    """
    coedges = prepared.is_degenerate[prepared.coedge_edges].nonzero()[0]
    if not len(coedges):
        return None
    ranges = prepared.edge_ranges[prepared.coedge_edges[coedges]]
    ends = prepared.pcurves.evaluate(coedges.repeat(2), ranges.ravel()).reshape(-1, 2, 2)
    lines = _Lines(prepared.coedge_faces[coedges], ends, np.abs(ends[:, 1] - ends[:, 0]))
    pole, point, share = lines.find_near(leaves.faces, leaves.places, np.full(len(coedges), NEAR))
    reach = np.zeros(len(coedges))
    np.maximum.at(reach, pole, leaves.sizes[point, lines.across[pole]])
    across, _, share_across = lines.find_near(border.faces, border.begins, REACH * reach)
    width = leaves.sizes[point, 1 - lines.across[pole]] / lines.extents.max(axis=1)[pole]
    rest = ~_are_beside(pole, share, width, np.sort(2.0 * across + share_across))
    pole = np.concatenate([pole[rest], across])
    share = np.concatenate([share[rest], share_across])
    parameters = ranges[pole, 0] + share * (ranges[pole, 1] - ranges[pole, 0])
    edges = prepared.coedge_edges[coedges[pole]]
    least = lines.insets[pole] * (ranges[pole, 1] - ranges[pole, 0])
    return _insert(prepared, samples, edges, parameters, least)


def _are_beside(pole: Ints, share: FloatArray, width: FloatArray, keys: FloatArray) -> Bools:
    """Whether shares (m,) of poles have one of the `keys`, 2 pole + share, within a width (m,)."""
    ends = np.concatenate([[-np.inf], keys, [np.inf]])
    key = 2.0 * pole + share
    after = np.searchsorted(ends, key)
    beside: Bools = np.minimum(key - ends[after - 1], ends[after] - key) <= width
    return beside


@dataclass(frozen=True, eq=False, slots=True)
class _Lines:
    """The places of n poles, as lines along one axis.

    Attributes
    ----------
    faces : ndarray of int, shape (n,)
    ends : ndarray of float64, shape (n, 2, 2)
    extents : ndarray of float64, shape (n, 2)
        Absolute differences of the ends.
    """

    faces: Ints
    ends: FloatArray
    extents: FloatArray

    @property
    def across(self) -> Ints:
        """The axis across each line, (n,)."""
        across: Ints = self.extents.argmin(axis=1)
        return across

    @property
    def insets(self) -> FloatArray:
        """The share (n,) of each line that is `NEAR` units long."""
        insets: FloatArray = NEAR / np.maximum(self.extents.max(axis=1), 1.0)
        return insets

    def find_near(
        self, faces: Ints, places: Ints, reach: FloatArray
    ) -> tuple[Ints, Ints, FloatArray]:
        """Pairs of a line and a point that is within its `reach` (n,), and inside of its ends.

        `faces` (m,) are those of points, in ascending order. The result is the number of the line,
        that of the point, and the share of the line at which the point is.
        """
        begin, end = (np.searchsorted(faces, self.faces, side=side) for side in ("left", "right"))
        line, point = expand_runs(end - begin, begin)
        across, along = self.across[line], 1 - self.across[line]
        origin = self.ends[line, 0]
        rows = np.arange(len(line))
        width = (self.ends[line, 1] - origin)[rows, along]
        offset = places[point, along] - origin[rows, along]
        share = offset / np.where(width != 0, width, 1.0)
        aside = np.abs(places[point, across] - origin[rows, across])
        inset = self.insets[line]
        is_near = (aside < reach[line]) & (share > inset) & (share < 1.0 - inset) & (width != 0)
        near = is_near.nonzero()[0]
        return line[near], point[near], share[near]


def _insert(
    prepared: PreparedBrep,
    samples: EdgeSamples,
    edges: Ints,
    parameters: FloatArray,
    least: FloatArray,
) -> tuple[EdgeSamples, Ints] | None:
    """Insert samples of edges, in any order, that are at least `least` (m,) from others."""
    order = np.lexsort((parameters, edges))
    edges, parameters, least = edges[order], parameters[order], least[order]
    new = np.ones(len(edges), bool)
    new[1:] = (np.diff(edges) != 0) | (np.diff(parameters) > least[1:])
    edges, parameters, least = edges[new], parameters[new], least[new]
    # The piece of each: the last sample of the edge before it.
    merged = np.lexsort(
        (np.concatenate([samples.parameters, parameters]), np.concatenate([samples.edges, edges]))
    )
    is_old = merged < len(samples.edges)
    before = np.maximum.accumulate(np.where(is_old, merged, 0))
    pieces = np.empty(len(edges), np.intp)
    pieces[merged[~is_old] - len(samples.edges)] = before[~is_old]
    apart = parameters - samples.parameters[pieces] > least
    apart &= samples.parameters[pieces + 1] - parameters > least
    if not apart.any():
        return None
    return insert_samples(prepared, samples, pieces[apart], parameters[apart])
