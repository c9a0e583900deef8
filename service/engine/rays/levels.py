"""The search for the hits of some rays, level by level (`intersect`).

A pair of a ray and a cell is open until the cell is proved not to meet the ray, or until the cell
is

- settled: it has at most one hit, which Newton's method finds (`bounds`);
- thin: the ray is almost tangent to the cell, and all hits are in a narrow strip (`grazing`);
- small: the cell counts as a point, because its radius is much less than the thickness of the ray.

If only first hits are requested, the nearer cells of every ray are examined first, because most
other cells are then behind a hit.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import count_runs, find_begins, row_slices
from service.cancellation import checkpoint
from service.engine.cells import models as model_rows
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.pair_search import (
    NO_PAIRS,
    PairBudget,
    Pairs,
    join_pairs,
    split_nearest,
)
from service.engine.rays.bounds import (
    CHUNK_PAIRS,
    MAX_CONTRACTION,
    Rays,
    RootBounds,
    root_bounds,
)
from service.engine.rays.grazing import MAX_SLOPE, find_grazed_strips
from service.engine.rays.hits import NO_HITS, Evidence, Hits
from service.engine.rays.newton import (
    Roots,
    find_roots,
    find_strips,
    take_points,
)
from service.engine.rays.ray_tree import RayTree
from service.engine.rays.trimming import RayTrims
from service.engine.vectors import dot

MAX_STRAIN = MAX_CONTRACTION / 3
"""A cell with more strain than this is halved without computing bounds, because no ray can be
settled in it. The strain of a cell is REST / min(|A|, |B|), in the notation of `bounds`. With
the unit normal n of the cell, |D| = |A × B| |d · n| and |X| = |B × d| ≥ |B| |d · n| give ν ≥ 3 |X|
REST / |D| ≥ 3 REST / |A|; and Y gives ν ≥ 3 REST / |B|."""

MAX_POINT_RADIUS = 1 / 8
"""A cell whose radius is at most this, in units of the thickness of the ray, counts as a point."""

MAX_DISTANCE_BEHIND = 4
"""Cells are examined up to this distance behind a crossing, in units of the thickness of the
ray, to find other hits at the same place."""

MAX_NEAR_SHARE = 1 / 4
"""If only first hits are requested, the pairs with farther cells join the search later: when the
open pairs with nearer cells are at most this share of the pairs with farther cells."""


class RayLevels(RayTree):
    """The search for the hits of some rays.

    Parameters
    ----------
    spheres : BoundingSpheres
    rays : Rays
    budget : PairBudget
    only_first : bool
        Whether only the first hit of each ray is needed.
    can_split : bool
        Whether the caller can search fewer rays at a time.
    trims : RayTrims or None
        The trims of the nets, and where the rays pass edges.
    """

    def __init__(
        self,
        spheres: BoundingSpheres,
        rays: Rays,
        budget: PairBudget,
        *,
        only_first: bool,
        can_split: bool,
        trims: RayTrims | None = None,
    ) -> None:
        super().__init__(spheres, rays, budget, can_split=can_split)
        self.only_first, self.trims = only_first, trims
        # Which rays have hits of which it is not clear whether they are inside of the trims.
        self.is_unclear = np.zeros(self.count, bool)
        if trims is not None and only_first:
            # A ray that passes an edge has a hit there.
            ends = trims.find_ends(rays.near)
            self.limit_search(np.arange(self.count), ends)
        # Which rays have pairs with farther cells that have not joined the search.
        self.is_later = np.zeros(self.count, bool)
        self.settled: list[RootBounds] = []  # for `apply_newton`
        self.hits: list[Hits] = []

    def search(self) -> Hits | None:
        """Search all levels until no pair is open; None if fewer rays must be searched."""
        pairs = self.begin()
        if pairs is None:
            return None
        ray, cell = pairs
        (ray, cell), later_pairs = self.split_by_distance(ray, cell)
        self.is_later[later_pairs[0]] = True
        while len(ray) or self.settled or len(later_pairs[0]):
            checkpoint()
            if len(ray) - len(self.waiting_pairs[0]) <= MAX_NEAR_SHARE * len(later_pairs[0]):
                ray, cell = join_pairs([(ray, cell), later_pairs])
                later_pairs = NO_PAIRS
                self.is_later[:] = False
            next_pairs = [self.step(ray, cell)]
            # Collect settled pairs until there are no more open pairs than settled pairs, because
            # Newton's method is faster for many pairs together.
            if sum(len(bounds.ray) for bounds in self.settled) >= len(next_pairs[0][0]):
                next_pairs.append(self.apply_newton())
            ray, cell = join_pairs([*next_pairs, self.waiting_pairs])
        if self.takes_too_much:
            return None
        self.reached &= ~self.is_unclear
        hits = Hits.join(self.hits or [NO_HITS])
        # Hits before the beginning of the ray do not count.
        return hits.take(hits.high >= self.rays.near[hits.ray])

    def split_by_distance(self, ray: Ints, cell: Ints) -> tuple[Pairs, Pairs]:
        """Split the first pairs into those with the nearer cells, and those with the farther cells.

        If all hits are needed, all pairs are in the first list.
        """
        if not self.only_first or not len(ray):
            return (ray, cell), NO_PAIRS
        center, radius = self.cells.models[:3, cell], self.cells.models[model_rows.RADIUS, cell]
        # The origins of rays are perpendicular to their directions, so (c − o) · d = c · d.
        low = dot(center, self.rays.direction[:, ray]) - radius
        starts = find_begins(ray)
        middle = (np.minimum.reduceat(low, starts) + np.maximum.reduceat(low, starts)) / 2
        is_near = low <= np.repeat(middle, count_runs(starts, len(ray)))
        return (ray[is_near], cell[is_near]), (ray[~is_near], cell[~is_near])

    def step(self, ray: Ints, cell: Ints) -> Pairs:
        """Examine one level of pairs; returns the pairs of the next level.

        Pairs that are settled on this level are stored for `apply_newton`.
        """
        models = self.cells.models
        is_met, low = self.find_met(models, ray, cell)
        met_rows = np.flatnonzero(is_met)
        is_point = (
            models[model_rows.RADIUS, cell[met_rows]]
            <= MAX_POINT_RADIUS * self.rays.thickness[ray[met_rows]]
        )
        if is_point.any():
            points = met_rows[is_point]
            hits = take_points(self.cells, self.rays, ray[points], cell[points])
            if self.trims is not None:
                hits = self.trims.trim_points(hits, self.cells.is_cut[cell[points]])
            self.hits.append(hits)
            met_rows = met_rows[~is_point]
        met_rows, ended = self.allot_pairs(met_rows, ray, cell, self.is_later)
        self.reached[ray[ended]] = False
        is_coarse = models[model_rows.STRAIN, cell[met_rows]] > MAX_STRAIN
        open_pairs = [(ray[met_rows[is_coarse]], cell[met_rows[is_coarse]])]
        met_rows = met_rows[~is_coarse]
        for rows in row_slices(len(met_rows), 1, CHUNK_PAIRS):
            chunk = met_rows[rows]
            open_pairs.append(self.bound_pairs(ray[chunk], cell[chunk], low[chunk]))
        return self.halve_open(*(np.concatenate(c) for c in zip(*open_pairs, strict=True)))

    def bound_pairs(self, ray: Ints, cell: Ints, low: FloatArray) -> Pairs:
        """Compute the bounds of pairs; returns the pairs that stay open."""
        models, rays = self.cells.models, self.rays
        is_empty, is_settled, bounds = root_bounds(self.cells, rays, ray, cell, low)
        if len(bounds.ray):
            self.settled.append(bounds)
            if self.only_first:
                is_sure = bounds.exists & (bounds.low > rays.near[bounds.ray])
                sure = bounds.take(is_sure & ~self.cells.is_cut[bounds.cell])
                # A hit is at most 2 (radius + slack) behind `low`. That is less than 3 radii: the
                # radius is at least 8 times the slack, because smaller cells count as points.
                self.limit_search(sure.ray, sure.low + 3 * models[model_rows.RADIUS, sure.cell])
        rows = np.flatnonzero(~(is_empty | is_settled))
        normals = models[model_rows.NORMAL : model_rows.NORMAL + 3].take(cell[rows], axis=1)
        directions = rays.direction.take(ray[rows], axis=1)
        is_grazed = np.abs(dot(normals, directions)) <= MAX_SLOPE
        grazed = rows[is_grazed]
        open_rows = [rows[~is_grazed]]
        if len(grazed):
            open_rows.append(grazed[self.graze(ray[grazed], cell[grazed])])
        rows = np.concatenate(open_rows)
        return ray[rows], cell[rows]

    def graze(self, ray: Ints, cell: Ints) -> Bools:
        """Examine pairs whose ray is almost tangent to the cell; returns which stay open."""
        is_empty, is_thin, strips = find_grazed_strips(self.cells, self.rays, ray, cell)
        is_open, rows = ~is_empty, np.flatnonzero(is_thin)
        if len(rows):
            hits, is_done = find_strips(self.cells, self.rays, strips)
            rows = rows[is_done]
            if self.trims is not None:
                hits, is_done = self.trims.trim_strips(hits, self.cells.is_cut[cell[rows]])
                rows = rows[is_done]
            self.hits.append(hits)
            is_open[rows] = False
        return is_open

    def limit_search(self, ray: Ints, t: FloatArray) -> None:
        """Do not search behind the hit at t, except for other hits at the same place."""
        np.minimum.at(self.farthest, ray, t + MAX_DISTANCE_BEHIND * self.rays.thickness[ray])

    def apply_newton(self) -> Pairs:
        """Apply Newton's method to the settled pairs.

        If only first hits are requested, the nearest cell of each ray comes first: a hit there may
        make the others unnecessary. Returns the pairs of the next level, with the halves of cells
        in which the method failed.
        """
        if not self.settled:
            return NO_PAIRS
        bounds = RootBounds.join(self.settled)
        ray, cell, low = bounds.ray, bounds.cell, bounds.low
        self.settled = []
        parts = split_nearest(ray, cell, low) if self.only_first else (np.arange(len(ray)),)
        open_rows = []
        for part in parts:
            rows = part[low[part] <= self.farthest[ray[part]]]
            for chunk in row_slices(len(rows), 1, CHUNK_PAIRS):
                roots = find_roots(self.cells, self.rays, bounds.take(rows[chunk]))
                hits, is_certain = self.trim_roots(roots, cell[rows[chunk]])
                self.hits.append(hits)
                open_rows.append(rows[chunk][~roots.is_done])
                if self.only_first:
                    is_sure = is_certain & (hits.label == Evidence.PROVED)
                    is_sure &= hits.low > self.rays.near[hits.ray]
                    self.limit_search(hits.ray[is_sure], hits.t[is_sure])
        rows = np.concatenate(open_rows) if open_rows else np.zeros(0, np.intp)
        return self.halve_open(ray[rows], cell[rows])

    def trim_roots(self, roots: Roots, cell: Ints) -> tuple[Hits, Bools]:
        """The hits of roots of pairs with cells (N,) that are not outside; which are inside."""
        if self.trims is None:
            return roots.hits, np.ones(len(roots.row), bool)
        own = cell[roots.row]
        hits, is_certain, is_unclear = self.trims.trim_roots(self.cells, self.rays, roots, own)
        self.is_unclear[hits.ray[is_unclear]] = True
        return hits, is_certain
