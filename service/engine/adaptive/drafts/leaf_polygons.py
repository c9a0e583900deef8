"""The leaves of a draft and their polygons; only the polygons near a cut change.

A leaf keeps its number. A leaf that is cut is no longer present; new leaves are appended.
"""

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs
from service.engine.adaptive.cutting.cells import NO_LEAVES, NO_NUMBERS, Leaves
from service.engine.adaptive.drafts.cell_boundaries import CellBoundaries


class LeafPolygons:
    """L leaves, with the polygons of those that are present.

    Attributes
    ----------
    leaves : Leaves
        All leaves since the first round, also those that were cut.
    is_present : ndarray of bool, shape (L,)
        Whether the leaf is not cut.
    first, size : ndarray of int, shape (L,)
        The polygon of leaf k is the samples `polygon[first[k] : first[k] + size[k]]`.
    polygon, owner : ndarray of int, shape (C,)
        Samples at the corners of polygons, and the leaf of each.
    touching : ndarray of int, shape (2, E)
        Pairs of a segment of the border and a leaf that touches it (`CellBoundaries`).
    """

    def __init__(self, segments: int) -> None:
        self._segments = segments
        self.leaves = NO_LEAVES
        self.is_present = np.zeros(0, dtype=bool)
        self.first = self.size = self.owner = self.polygon = NO_NUMBERS
        self.touching = np.empty((2, 0), dtype=np.intp)

    def mark_samples(self, leaves: Bools, samples: int) -> Bools:
        """Which of all samples are corners of these leaves (L,)."""
        mark = np.zeros(samples, dtype=bool)
        mark[self.polygon[leaves[self.owner]]] = True
        return mark

    def find_affected(self, cut: Ints, flat: Ints, samples: int) -> tuple[Ints, Ints]:
        """The leaves that may change because other leaves are cut, and the leaves around these.

        `cut` has the leaves to be cut, `flat` the segments of the border whose strips became
        flatter; `samples` is the number of samples of the draft.
        """
        is_cut = np.zeros(len(self.is_present), dtype=bool)
        is_cut[cut] = True
        near = is_cut.copy()
        self._add_neighbours(near, flat, samples)
        far = near.copy()
        self._add_neighbours(far, NO_NUMBERS, samples)
        return (near & ~is_cut).nonzero()[0], (far & ~near).nonzero()[0]

    def _add_neighbours(self, leaves: Bools, segments: Ints, samples: int) -> None:
        """Mark leaves that share a sample, or a segment of the border, with marked leaves (L,).

        Leaves that touch `segments` are marked too; leaves that are not present are unmarked.
        """
        mark = self.mark_samples(leaves, samples)
        is_touched = np.zeros(self._segments, dtype=bool)
        segment, leaf = self.touching
        is_touched[segment[leaves[leaf]]] = True
        is_touched[segments] = True
        leaves[self.owner[mark[self.polygon]]] = True
        leaves[leaf[is_touched[segment]]] = True
        leaves &= self.is_present

    def find_changed(
        self, boundaries: CellBoundaries, polygon: Ints, begin: int, leaves: Ints
    ) -> Bools:
        """Which of these leaves have new polygons that differ from the old ones.

        Parameters
        ----------
        boundaries : CellBoundaries
            The new polygons; those of `leaves` begin with polygon `begin`.
        polygon : ndarray of int
            The corners of the new polygons as samples of the draft.
        """
        start = boundaries.start[begin : begin + len(leaves) + 1]
        size = start[1:] - start[:-1]
        changed: Bools = size != self.size[leaves]
        same = (~changed).nonzero()[0]
        if len(same):
            run, step = expand_runs(size[same])
            row = same[run]
            differs = polygon[start[row] + step] != self.polygon[self.first[leaves[row]] + step]
            changed[row[differs]] = True
        return changed

    def replace(
        self,
        boundaries: CellBoundaries,
        fresh: Leaves,
        cut: Ints,
        renewed: tuple[Ints, Ints],
        polygon: Ints,
    ) -> None:
        """Remove the leaves that were cut; append new leaves, and replace polygons.

        Parameters
        ----------
        boundaries : CellBoundaries
            New polygons, those of the leaves `fresh` first.
        renewed : (rows, numbers)
            Rows of the polygons to be stored, and the numbers of their leaves in this object.
        polygon : ndarray of int
            The corners of all polygons of the boundaries as samples of the draft.
        """
        rows, numbers = renewed
        count, size = len(fresh), boundaries.start[1:] - boundaries.start[:-1]
        self.leaves = Leaves.join([self.leaves, fresh])
        self.is_present[cut] = False
        self.is_present = np.concatenate([self.is_present, np.ones(count, dtype=bool)])
        # Set below, with those of the other polygons that are stored.
        unset = np.zeros(count, dtype=np.intp)
        self.first, self.size = (
            np.concatenate([values, unset]) for values in (self.first, self.size)
        )
        is_removed = ~self.is_present
        is_removed[numbers] = True
        kept = (~is_removed[self.owner]).nonzero()[0]
        # Corners of polygons that stay keep their order, and `shifted` has their new positions in
        # `polygon`; the new polygons follow.
        shifted = np.cumsum(~is_removed[self.owner]) - 1
        staying = (~is_removed[: len(is_removed) - count]).nonzero()[0]
        self.first[staying] = shifted[self.first[staying]]
        size = size[rows]
        run, corner = expand_runs(size, boundaries.start[rows])
        self.first[numbers], self.size[numbers] = len(kept) + np.cumsum(size) - size, size
        self.polygon = np.concatenate([self.polygon[kept], polygon[corner]])
        self.owner = np.concatenate([self.owner[kept], numbers[run]])
        # A leaf touches the same segments as long as it is present, also if its polygon changes.
        added = boundaries.touching[:, boundaries.touching[1] < count]
        added[1] += len(self.is_present) - count
        before = self.touching[:, self.is_present[self.touching[1]]]
        self.touching = np.concatenate([before, added], axis=1)
