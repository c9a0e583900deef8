"""Hits of rays on a surface, with a proof that no hit is missed.

The search examines pairs of a ray and a cell of a patch (`cells`), for all rays and all patches
together, level by level. A pair ends in four cases: the cell does not meet the ray; the cell meets
the ray at most once, and Newton's method decides (`ray_bounds`); the ray is almost tangent to the
cell and within the thickness (`grazing`); or the cell is smaller than the thickness. Otherwise the
cell is halved. If only first hits are requested, pairs behind a proved hit end, too. `ray_levels`
does all this. The *thickness* τ of a ray is a distance: a point of the surface that is nearer to
the ray may count as a hit.

**Theorem.** If a ray is `reached`, the t of every point of the surface on the ray is in the
interval of a reported hit (if only first hits are requested: of every point before the first
crossing). Every reported position is a point of the surface nearer than τ to the ray. *Proof.* A
pair is dropped only if its cell does not meet the ray (Theorem 1 of `ray_bounds`, Theorem 1 of
`grazing`); or, if only first hits are requested, if it is behind a proved crossing. A settled pair
reports the one place where the cell meets the ray, with the interval of Theorem 2 of `ray_bounds`;
or, by that theorem, the root is outside the cell. A thin pair reports an interval that contains all
of its hits by Theorem 2 of `grazing`; a small cell reports an interval that contains the cell.
Merging only joins intervals. ∎

At a proved hit, the surface and the ray cross. If a ray only comes nearer than τ to the surface, or
to its border, an edge or a pole, a hit may be reported there, too.

The work for a ray has a budget. If the ray needs more, its search ends, and `reached` is false.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.cancellation import checkpoint
from service.engine.queries import cell_models as model_rows
from service.engine.queries.cells import CellTree
from service.engine.queries.nets import QueryNets
from service.engine.queries.patch_tree import FREE_PAIRS, MAX_PAIRS_IN_TREE, PatchTree
from service.engine.queries.ray_bounds import (
    Rays,
    local_rays,
)
from service.engine.queries.ray_hits import MIN_LENGTH_ALONG, Hits, Kind, merge_hits
from service.engine.queries.ray_levels import MAX_OPEN_PAIRS, MAX_STRAIN, RayLevels
from service.engine.queries.ray_newton import (
    begin_at_origins,
)
from service.engine.queries.shares import Share

MIN_CHUNK, FIRST_CHUNK, MAX_CHUNK = 16, 1 << 14, 1 << 16
"""How many rays are searched together: `FIRST_CHUNK` at first, later up to `MAX_CHUNK` if their
cells take little memory. A search of more than `MIN_CHUNK` rays ends if their cells take too much
memory; then fewer rays are searched again."""

MAX_PAIRS = 8_000_000
"""The most pairs whose bounds are computed in a request. Most rays need 10 to 40; a pair takes 0.5
to 5 µs, including its new cells, so that the response comes within half a minute."""

MAX_FIRST_CELLS, MAX_NUMBERS = 128, 1 << 16
"""The most cells that are tested with every ray, without a tree of patches; and the most numbers
that the nets of these cells may have."""


@dataclass(frozen=True, eq=False, slots=True)
class RayHits:
    """Hits of m rays, in the coordinates of the nets.

    Attributes
    ----------
    hits : Hits
        Ordered by ray and by t; t = 0 is the origin of the ray in the request.
    sines : ndarray of float64, shape (n,)
        Sines of the angles of rays and surface; negative where the ray runs against du × dv.
    reached : ndarray of bool, shape (m,)
        For which rays the theorem holds.
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
        self.min_length_along = MIN_LENGTH_ALONG * (thickness * nets.diagonal / nets.scale) ** 0.5
        self.cells = CellTree(nets)
        max_cells = min(
            MAX_FIRST_CELLS, MAX_NUMBERS // max(group.nets[0].size for group in nets.groups)
        )
        self.cells.halve_first(max_cells, model_rows.STRAIN, MAX_STRAIN)
        self.patches = PatchTree(self.cells, MAX_FIRST_CELLS)
        self.most_open = 0
        """The most pairs that were open on one level, in all searches."""
        self.in_tree = 0
        """How many pairs the tree left for the rays of a request, without `FREE_PAIRS` each."""
        self.max_pairs_of_ray = FREE_PAIRS

    def find(
        self, origins: FloatArray, directions: FloatArray, *, only_first: bool
    ) -> Iterator[RayHits]:
        """Find the hits of rays (m, 3); yields the hits of some rays at a time.

        Ray numbers are those of the query. If `only_first`, only the first hit of each ray is
        found.
        """
        rays = local_rays(self.cells.nets, origins, directions, self.thickness)
        first, size, remaining_pairs, self.in_tree = 0, FIRST_CHUNK, MAX_PAIRS, 0
        while first < len(origins):
            checkpoint()
            remaining_rays = len(origins) - first
            chunk_rays = rays.take(slice(first, first + size))
            share = Share(
                remaining_pairs * len(chunk_rays.near) // remaining_rays, len(chunk_rays.near)
            )
            # Twice an equal share, because most rays need much less.
            self.max_pairs_of_ray = max(
                FREE_PAIRS, 2 * (MAX_PAIRS_IN_TREE - self.in_tree) // remaining_rays
            )
            result = self._search(
                chunk_rays, share, only_first=only_first, can_split=size > MIN_CHUNK
            )
            remaining_pairs -= int(share.spent.sum())
            if result is None:
                # Search again with fewer rays, whose pairs and cells take less memory.
                size = max(1, min(size, len(chunk_rays.near)) // 4)
            else:
                result.hits.ray[:] += first
                yield result
                first = first + size
                if 2 * self.most_open <= MAX_OPEN_PAIRS:
                    size = min(2 * size, MAX_CHUNK)
            self.cells.drop_if_large()

    def _search(
        self, rays: Rays, share: Share, *, only_first: bool, can_split: bool
    ) -> RayHits | None:
        """Find the hits of some rays; None if their cells take too much memory."""
        merged = self._search_merged(rays, share, only_first=only_first, can_split=can_split)
        if merged is None:
            return None
        hits, reached = merged
        if only_first:
            hits = _take_first_hits(hits)
            # The search ended behind proved crossings, so the intervals of other first hits may be
            # incomplete: search these rays again for all hits.
            rows = np.flatnonzero(hits.label != Kind.CROSSING)
            repeated_rays = hits.ray[rows]
            share_of_repeated = Share(share.pairs - int(share.spent.sum()), len(rows))
            complete_result = None
            if len(rows):
                complete_result = self._search_merged(
                    rays.take(repeated_rays), share_of_repeated, only_first=False, can_split=False
                )
                share.spent[repeated_rays] += share_of_repeated.spent
            if complete_result:
                complete_hits = _take_first_hits(complete_result[0])
                complete_hits.ray[:] = repeated_rays[complete_hits.ray]
                reached[repeated_rays] &= complete_result[1]
                crossing_rows = np.flatnonzero(hits.label == Kind.CROSSING)
                hits = Hits.join([hits.take(crossing_rows), complete_hits])
                hits = hits.take(np.argsort(hits.ray, kind="stable"))
        begins = rays.near[hits.ray]
        t, low, high = (np.maximum(ends - begins, 0.0) for ends in (hits.t, hits.low, hits.high))
        hits = replace(hits, t=t, low=low, high=high)
        # The theorem needs τ; rounding may have required a larger thickness of a ray.
        reached &= rays.thickness <= self.thickness
        return RayHits(hits, hits.sines(rays.direction[:, hits.ray]), reached)

    def _search_merged(
        self, rays: Rays, share: Share, *, only_first: bool, can_split: bool
    ) -> tuple[Hits, Bools] | None:
        """Find the hits of some rays, merged to one for each place, and which rays are reached."""
        levels = RayLevels(
            self.patches,
            rays,
            share,
            self.max_pairs_of_ray,
            only_first=only_first,
            can_split=can_split,
        )
        hits = levels.search()
        self.most_open = max(self.most_open, levels.most_open)
        if hits is None or (can_split and (levels.is_crowded or self.cells.is_full)):
            return None
        self.in_tree += int(np.maximum(levels.in_tree - FREE_PAIRS, 0).sum())
        return begin_at_origins(
            self.cells, rays, merge_hits(hits, rays, self.min_length_along)
        ), levels.reached


def _take_first_hits(hits: Hits) -> Hits:
    """The first hit of each ray."""
    return hits.take(np.diff(hits.ray, prepend=-1) > 0)
