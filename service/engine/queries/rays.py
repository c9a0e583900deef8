"""Hits of rays on a surface, with a proof that no hit is missed.

The search treats all rays and all patches together, level by level, and examines each pair of a ray
and a cell of a patch (`cells`) once. A pair ends if the cell does not meet the ray, if they meet at
most once and Newton's method decides (`ray_bounds`), if the ray grazes the cell within the
thickness (`grazing`), or if the cell is smaller than the thickness; otherwise its cell is halved.
If only first hits are requested, cells behind a proved hit end, too. `ray_levels` does this.

**Theorem.** Let τ be the thickness. If a ray is `reached`, every point of the surface on the ray
has its t in the interval of a reported hit (of first hits: every point before the first crossing);
and every reported position is a point of the surface nearer than τ to the ray. *Proof.* A pair is
dropped only if its cell does not meet the ray (Theorems 1), or its place is behind the ray's origin
by more than τ. A settled pair reports the one place where the cell meets the ray, in an interval
that Theorem 2 of `ray_bounds` gives, or is outside by that theorem. A thin pair reports an interval
that contains all of its hits by Theorem 2 of `grazing`, a small cell an interval that contains the
cell. Merging only joins intervals. ∎

A proved hit is a crossing: the point exists. If a ray comes nearer than τ to a border, an edge or a
pole of the surface, or to touching the surface, a hit may be reported there.

The work on a ray has a budget: if more cells are open, it ends, and `reached` is false.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.cancellation import checkpoint
from service.engine.queries import cell_models as columns
from service.engine.queries.cells import CellTree
from service.engine.queries.nets import QueryNets
from service.engine.queries.patch_tree import FREE, PatchTree
from service.engine.queries.patch_tree import ROOM as ROOM_IN_TREE
from service.engine.queries.ray_bounds import (
    Rays,
    local_rays,
)
from service.engine.queries.ray_hits import LONG, Hits, Kind, merge_hits
from service.engine.queries.ray_levels import COARSE, MOST_OPEN, RayLevels
from service.engine.queries.ray_newton import (
    begin_at_origins,
)
from service.engine.queries.shares import Share

FEWEST, CHUNK, MOST_RAYS = 16, 1 << 14, 1 << 16
"""Rays that are searched together: `CHUNK` at first, fewer if their cells take much memory, and
more if they take little."""

MOST_CLOSE = 8_000_000
"""The most pairs whose bounds are computed in a request. Most rays need 10 to 40; a pair takes 0.5
to 5 µs, including its new cells, so that the response comes within half a minute."""

FEW, ROOM = 128, 1 << 16
"""The most cells that are tested with every ray without a tree of patches, and the most numbers of
their nets."""


@dataclass(frozen=True, eq=False, slots=True)
class RayHits:
    """Hits of m rays, in the coordinates of the nets.

    Attributes
    ----------
    hits : Hits
        Ordered by ray and by t, which is measured from the origin in the request.
    sines : ndarray of float64, shape (n,)
        Sines of the angles of rays and surface; negative where the ray enters the surface.
    reached : ndarray of bool, shape (m,)
    """

    hits: Hits
    sines: FloatArray
    reached: Bools


class RaySearch:
    """Finds the hits of rays on one surface.

    Parameters
    ----------
    nets : QueryNets
    thickness : float
        τ, in the coordinates of the nets.
    """

    def __init__(self, nets: QueryNets, thickness: float) -> None:
        self.thickness = thickness
        self.long = LONG * (thickness * nets.diagonal / nets.scale) ** 0.5
        self.cells = CellTree(nets)
        most = min(FEW, ROOM // max(group.nets[0].size for group in nets.groups))
        self.cells.halve_first(most, columns.STRAIN, COARSE)
        self.patches = PatchTree(self.cells, FEW)
        self.most_open = self.in_tree = 0
        self.each = FREE

    def find(
        self, origins: FloatArray, directions: FloatArray, *, only_first: bool
    ) -> Iterator[RayHits]:
        """Hits of rays (m, 3), some rays at a time; ray numbers are those of the query."""
        rays = local_rays(self.cells.nets, origins, directions, self.thickness)
        first, size, pairs, self.in_tree = 0, CHUNK, MOST_CLOSE, 0
        while first < len(origins):
            checkpoint()
            left = len(origins) - first
            chunk_rays = rays.take(slice(first, first + size))
            share = Share(pairs * len(chunk_rays.near) // left, len(chunk_rays.near))
            self.each = max(FREE, 2 * (ROOM_IN_TREE - self.in_tree) // left)
            result = self._search(chunk_rays, share, only_first=only_first, can_split=size > FEWEST)
            pairs -= int(share.spent.sum())
            if result is None:
                # The pairs and cells of fewer rays take less memory.
                size = max(1, min(size, len(chunk_rays.near)) // 4)
            else:
                result.hits.ray[:] += first
                yield result
                first = first + size
                if 2 * self.most_open <= MOST_OPEN:
                    size = min(2 * size, MOST_RAYS)
            self.cells.drop_if_large()

    def _search(
        self, rays: Rays, share: Share, *, only_first: bool, can_split: bool
    ) -> RayHits | None:
        """Hits of some rays; None if their cells take too much memory."""
        merged = self._search_merged(rays, share, only_first=only_first, can_split=can_split)
        if merged is None:
            return None
        hits, reached = merged
        if only_first:
            hits = _firsts(hits)
            # An interval is reported in full, although a crossing may be within it.
            rows = np.flatnonzero(hits.origin != Kind.CROSSING)
            which = hits.ray[rows]
            again = Share(share.pairs - int(share.spent.sum()), len(rows))
            complete = None
            if len(rows):
                complete = self._search_merged(
                    rays.take(which), again, only_first=False, can_split=False
                )
                share.spent[which] += again.spent
            if complete:
                strips = _firsts(complete[0])
                strips.ray[:] = which[strips.ray]
                reached[which] &= complete[1]
                others = np.flatnonzero(hits.origin == Kind.CROSSING)
                hits = Hits.join([hits.take(others), strips])
                hits = hits.take(np.argsort(hits.ray, kind="stable"))
        near = rays.near[hits.ray]
        t, low, high = (np.maximum(ends - near, 0.0) for ends in (hits.t, hits.low, hits.high))
        hits = replace(hits, t=t, low=low, high=high)
        reached &= rays.thickness <= self.thickness
        return RayHits(hits, hits.sines(rays.direction[:, hits.ray]), reached)

    def _search_merged(
        self, rays: Rays, share: Share, *, only_first: bool, can_split: bool
    ) -> tuple[Hits, Bools] | None:
        """Hits of some rays, one for each place, and which rays are reached."""
        levels = RayLevels(
            self.patches, rays, share, self.each, only_first=only_first, can_split=can_split
        )
        hits = levels.search()
        self.most_open = max(self.most_open, levels.most_open)
        if hits is None or (can_split and (levels.is_crowded or self.cells.is_full)):
            return None
        self.in_tree += int(np.maximum(levels.in_tree - FREE, 0).sum())
        return begin_at_origins(self.cells, rays, merge_hits(hits, rays, self.long)), levels.reached


def _firsts(hits: Hits) -> Hits:
    """The first hit of each ray."""
    return hits.take(np.diff(hits.ray, prepend=-1) > 0)
