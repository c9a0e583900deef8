"""Hits of rays on a surface, with a proof that no hit is missed.

The *thickness* τ of a ray o + t d is a distance: a point of the surface that is nearer to the ray
may count as a hit. The search examines pairs of a ray and a cell of a patch (`cells`), for all rays
and all patches together, level by level (`ray_levels`). It has finished with a pair if

- the cell does not meet the ray;
- the pair is *settled*: the cell meets the ray at most once, and Newton's method decides whether it
  does (`ray_bounds`);
- the pair is *thin*: the ray is almost tangent to the cell, and the part of the cell that it may
  meet is within τ of it (`grazing`);
- the cell is *small*, compared with τ; or
- only first hits are requested, and the cell is behind a proved hit.

Otherwise the cell is halved. The work for a ray is limited. A ray is *reached* if its search does
not end at one of the limits, and if rounding does not require a thickness larger than τ.

**Theorem.** If a ray is reached, the t of every point of the surface on the ray is in the interval
of a hit that the search finds (if only first hits are requested: of every point before the first
proved hit; of the hits found, only the first is then returned). Every position of a hit is a point
of the surface nearer than τ to the ray. *Proof.* A pair is dropped only if its cell does not meet
the ray (Theorem 1 of `ray_bounds`, Theorem 1 of `grazing`); or, if only first hits are requested,
if it is behind a proved hit. A settled pair gives the one point where the cell meets the ray, with
the interval of Theorem 2 of `ray_bounds`; or, by that theorem, there is no such point. A thin pair
gives an interval that contains all of its hits by Theorem 2 of `grazing`; a small cell gives an
interval that contains the cell. Merging only joins intervals. ∎

At a proved hit, the surface and the ray cross. If a ray only comes nearer than τ to the surface, or
to its border, an edge or a pole, a hit may be reported there, too.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.cancellation import checkpoint
from service.engine.cells import models as model_rows
from service.engine.cells.bounding_spheres import FREE_PAIRS, MAX_PAIRS_IN_TREE, PatchTree
from service.engine.cells.shares import Share
from service.engine.cells.tree import CellTree
from service.engine.nets.query_nets import QueryNets
from service.engine.rays.bounds import (
    Rays,
    local_rays,
)
from service.engine.rays.hits import MIN_LENGTH_ALONG, Hits, Kind, merge_hits
from service.engine.rays.levels import MAX_OPEN_PAIRS, MAX_STRAIN, RayLevels
from service.engine.rays.newton import (
    begin_at_origins,
)

MIN_CHUNK, FIRST_CHUNK, MAX_CHUNK = 16, 1 << 14, 1 << 16
"""How many rays are searched together: `FIRST_CHUNK` at first, later up to `MAX_CHUNK` if few pairs
are open. A search of more than `MIN_CHUNK` rays ends if their pairs or cells take too much memory;
then fewer rays are searched again."""

MAX_PAIRS = 8_000_000
"""The most pairs whose bounds are computed in a request. Most rays need 10 to 40; a pair takes 0.5
to 5 µs, including its new cells, so all pairs of a request take at most 40 s."""

MAX_FIRST_CELLS, MAX_NUMBERS = 128, 1 << 16
"""Before the search, patches are halved into at most `MAX_FIRST_CELLS` cells, whose nets have at
most `MAX_NUMBERS` numbers together; these cells are tested with every ray. If there are more
patches, at most `MAX_FIRST_CELLS` spheres of the tree of patches are tested with every ray."""


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
        # The diagonal of the model, divided by the scale, is in the coordinates of the nets.
        self.min_length_along = MIN_LENGTH_ALONG * (thickness * nets.diagonal / nets.scale) ** 0.5
        self.cells = CellTree(nets)
        max_cells = min(
            MAX_FIRST_CELLS, MAX_NUMBERS // max(group.nets[0].size for group in nets.groups)
        )
        # In cells with more strain than this no ray can be settled.
        self.cells.halve_first(max_cells, model_rows.STRAIN, MAX_STRAIN)
        self.patches = PatchTree(self.cells, MAX_FIRST_CELLS)
        self.most_open = 0
        """The most pairs that were open on one level, in all searches."""
        self.in_tree = 0
        """How many pairs the tree of patches could not exclude, for all rays of a request, without
        the first `FREE_PAIRS` of each ray."""
        self.max_pairs_of_ray = FREE_PAIRS
        """The search of a ray that has more pairs on a level of the tree ends there."""

    def find(
        self, origins: FloatArray, directions: FloatArray, *, only_first: bool
    ) -> Iterator[RayHits]:
        """Find the hits of rays (m, 3); yields the hits of some rays at a time.

        The ray numbers of hits are rows of `origins`. If `only_first`, only the first hit of each
        ray is found.
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
            # Twice an equal share of the remaining pairs in the tree: most rays need much less.
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
        # From here on, t is 0 at the origin of the request, where the ray begins.
        begins = rays.near[hits.ray]
        t, low, high = (np.maximum(value - begins, 0.0) for value in (hits.t, hits.low, hits.high))
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
