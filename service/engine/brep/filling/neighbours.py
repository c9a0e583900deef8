"""The triangles of the mesh near others: beyond their edges, at their corners, at their points."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs, find_begins
from service.engine.brep.filling.triangles import Triangles, join_ends
from service.engine.vectors import NEXT

FEW = 4
"""The most triangles at its points with which a flat triangle is compared."""


@dataclass(frozen=True, eq=False, slots=True)
class Neighbours:
    """The triangles beyond the edges of triangles of the mesh.

    `points` (K,) are those of corners, `corners` (3, T) those of triangles; `beyond` (3, T) are the
    triangles beyond edges, −1 across borders.
    """

    points: Ints
    corners: Ints
    beyond: Ints

    def find_outdated(self, triangles: Triangles) -> Bools:
        """Which triangles must be measured, (T,)."""
        outdated = triangles.is_changed | self._has_neighbour(triangles.is_changed)
        if triangles.is_wide.any():
            near = self._share_corners(self._share_corners(triangles.is_changed))
            outdated |= triangles.is_wide & near
        return outdated

    def list_points(self, rows: Ints) -> tuple[Ints, Ints]:
        """The points (3, m) of triangles, and those opposite to each edge beyond it, or −1."""
        own, beyond = self.corners.take(rows, axis=1), self.beyond.take(rows, axis=1)
        opposite = self.corners.take(beyond, axis=1).sum(axis=0) - own - own[NEXT]
        return self.points[own], np.where(
            beyond < 0, -1, self.points[np.where(beyond < 0, 0, opposite)]
        )

    def list_beyond(self, rows: Ints, columns: Ints) -> tuple[Ints, Ints]:
        """All pairs of one of the `columns` of `rows` and a triangle beyond one of its edges.

        Triangles with two equal points are not in the mesh, so they are left out.
        """
        beyond = self.beyond.take(rows[columns], axis=1)
        edge, column = (beyond >= 0).nonzero()
        reference = beyond[edge, column]
        points = self.points[self.corners.take(reference, axis=1)]
        proper = (points != points[NEXT]).all(axis=0).nonzero()[0]
        return columns[column[proper]], reference[proper]

    def list_at_points(self, faces: Ints, rows: Ints, columns: Ints) -> tuple[Ints, Ints]:
        """Pairs of one of the `columns` of `rows`, flat triangles, and a triangle at its points.

        That is a triangle of the mesh, of the same face, which has an edge between the two points,
        or has the point if all three are one. `faces` (T,) are those of all triangles. There are at
        most `FEW` pairs for a column.
        """
        own = self.points[self.corners.take(rows[columns], axis=1)]
        wanted = join_ends(own.min(axis=0), own.max(axis=0))
        owners = faces[rows[columns]]
        points = self.points[self.corners]
        is_candidate = np.isin(faces, owners) & np.all(points != points[NEXT], axis=0)
        candidates = is_candidate.nonzero()[0]
        begins = points.take(candidates, axis=1)
        keys = np.concatenate([join_ends(begins, begins[NEXT]), join_ends(begins, begins)])
        order = np.argsort(keys.ravel(), kind="stable")
        keys = keys.ravel()[order]
        first = np.searchsorted(keys, wanted)
        count = np.minimum(np.searchsorted(keys, wanted, side="right") - first, FEW)
        pair, at = expand_runs(count, first)
        reference = np.tile(candidates, 6)[order[at]]
        same = (faces[reference] == owners[pair]).nonzero()[0]
        return columns[pair[same]], reference[same]

    def list_around(self, rows: Ints) -> tuple[Ints, Ints]:
        """The triangles of the mesh that share a corner with one of `rows` (m,), and itself.

        Returns
        -------
        starts : ndarray of int, shape (m + 1,)
        triangles : ndarray of int, shape (starts[-1],)
            Those for row i are in the columns `starts[i] : starts[i + 1]`, each once.
        """
        own = self.corners.take(rows, axis=1)
        is_used = np.zeros(len(self.points), bool)
        is_used[own] = True
        is_near: Bools = np.any(is_used[self.corners], axis=0)
        near = is_near.nonzero()[0]
        points = self.points[self.corners.take(near, axis=1)]
        near = near[(points != points[NEXT]).all(axis=0)]
        keys = self.corners.take(near, axis=1).ravel()
        order = np.argsort(keys, kind="stable")
        keys = keys[order]
        first = np.searchsorted(keys, own)
        count = np.searchsorted(keys, own, side="right") - first
        run, at = expand_runs(count.ravel(), first.ravel())
        around = near.take(order.take(at) % len(near))
        pairs = np.sort(run % len(rows) * len(self.beyond[0]) + around)
        pairs = pairs.take(find_begins(pairs))
        row, triangles = np.divmod(pairs, len(self.beyond[0]))
        return np.searchsorted(row, np.arange(len(rows) + 1)), triangles

    def _share_corners(self, marked: Bools) -> Bools:
        """Which triangles share a corner with a marked one, or are marked."""
        is_marked = np.zeros(len(self.points), bool)
        is_marked[self.corners[:, marked]] = True
        shares: Bools = np.any(is_marked[self.corners], axis=0)
        return shares

    def _has_neighbour(self, marked: Bools) -> Bools:
        """Which triangles have a marked one beyond an edge."""
        has: Bools = np.any((self.beyond >= 0) & marked[self.beyond], axis=0)
        return has
