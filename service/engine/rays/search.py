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
from service.engine.cells import models as model_rows
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.pair_search import Chunks, PairBudget
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.nets.query_nets import QueryNets
from service.engine.rays.bounds import Rays, local_rays
from service.engine.rays.hits import MIN_LENGTH_ALONG, Hits, Kind, merge_hits
from service.engine.rays.levels import MAX_STRAIN, RayLevels
from service.engine.rays.newton import begin_at_origins

CHUNK_SIZES = 16, 1 << 14, 1 << 16
"""How many rays are searched together (`Chunks`)."""

MAX_FIRST_CELLS, MAX_NUMBERS = 128, 1 << 16
"""Before the search, patches are halved into at most `MAX_FIRST_CELLS` cells, whose nets have at
most `MAX_NUMBERS` numbers together; these cells are tested with every ray. If there are more
patches, at most `MAX_FIRST_CELLS` spheres of the tree of spheres are tested with every ray."""


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
    limits : WorkLimits
    """

    def __init__(self, nets: QueryNets, thickness: float, limits: WorkLimits) -> None:
        self.thickness = thickness
        # The diagonal of the model, divided by the scale, is in the coordinates of the nets.
        self.min_length_along = MIN_LENGTH_ALONG * (thickness * nets.diagonal / nets.scale) ** 0.5
        self.cells = CellTree(nets, limits)
        max_cells = min(
            MAX_FIRST_CELLS, MAX_NUMBERS // max(group.nets[0].size for group in nets.groups)
        )
        # In cells with more strain than this no ray can be settled.
        self.cells.halve_first(max_cells, model_rows.STRAIN, MAX_STRAIN)
        self.spheres = BoundingSpheres(self.cells, MAX_FIRST_CELLS)
        # The most pairs that were open on one level, in all searches.
        self.most_open = 0

    def find(
        self, origins: FloatArray, directions: FloatArray, *, only_first: bool
    ) -> Iterator[RayHits]:
        """Find the hits of rays (m, 3); yields the hits of some rays at a time.

        The ray numbers of hits are rows of `origins`. If `only_first`, only the first hit of each
        ray is found.
        """
        rays = local_rays(self.cells.nets, origins, directions, self.thickness)
        chunks = Chunks(self.cells, len(origins), CHUNK_SIZES)
        for rows, budget in chunks:
            result = self._search(
                rays.take(rows), budget, only_first=only_first, can_split=chunks.can_split
            )
            if result is None:
                chunks.split()
            else:
                result.hits.ray[:] += rows.start
                yield result
                chunks.grow(self.most_open)

    def _search(
        self, rays: Rays, budget: PairBudget, *, only_first: bool, can_split: bool
    ) -> RayHits | None:
        """Find the hits of some rays; None if fewer rays must be searched."""
        merged = self._search_merged(rays, budget, only_first=only_first, can_split=can_split)
        if merged is None:
            return None
        hits, reached = merged
        if only_first:
            hits = _take_first_hits(hits)
            # The search ended behind proved crossings, so the intervals of other first hits may be
            # incomplete: search these rays again for all hits.
            rows = np.flatnonzero(hits.label != Kind.CROSSING)
            if len(rows):
                repeated_rays = hits.ray[rows]
                rest = PairBudget(
                    budget.pairs - int(budget.spent.sum()), len(rows), budget.max_spheres
                )
                complete_result = self._search_merged(
                    rays.take(repeated_rays), rest, only_first=False, can_split=False
                )
                budget.spent[repeated_rays] += rest.spent
                budget.spent_spheres += rest.spent_spheres
                if complete_result:
                    complete_hits = _take_first_hits(complete_result[0])
                    complete_hits.ray[:] = repeated_rays[complete_hits.ray]
                    reached[repeated_rays] &= complete_result[1]
                    crossings = hits.take(hits.label == Kind.CROSSING)
                    hits = Hits.join([crossings, complete_hits])
                    hits = hits.take(np.argsort(hits.ray, kind="stable"))
        # From here on, t is 0 at the origin of the request, where the ray begins.
        begins = rays.near[hits.ray]
        t, low, high = (np.maximum(value - begins, 0.0) for value in (hits.t, hits.low, hits.high))
        hits = replace(hits, t=t, low=low, high=high)
        # The theorem needs τ; rounding may have required a larger thickness of a ray.
        reached &= rays.thickness <= self.thickness
        return RayHits(hits, hits.sines(rays.direction[:, hits.ray]), reached)

    def _search_merged(
        self, rays: Rays, budget: PairBudget, *, only_first: bool, can_split: bool
    ) -> tuple[Hits, Bools] | None:
        """Find the hits of some rays, merged to one for each place, and which rays are reached."""
        levels = RayLevels(self.spheres, rays, budget, only_first=only_first, can_split=can_split)
        hits = levels.search()
        self.most_open = max(self.most_open, levels.most_open)
        if hits is None:
            return None
        merged = merge_hits(hits, rays, self.min_length_along)
        return begin_at_origins(self.cells, rays, merged), levels.reached


def _take_first_hits(hits: Hits) -> Hits:
    """The first hit of each ray."""
    return hits.take(np.diff(hits.ray, prepend=-1) > 0)
