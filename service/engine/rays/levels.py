"""The search for the hits of some rays, level by level (`rays` has the theorem).

A pair of a ray and a cell is open until the cell is proved not to meet the ray, or until the cell
is

- settled: it has at most one hit, which Newton's method finds (`ray_bounds`);
- thin: the ray is almost tangent to the cell, and all hits are in a narrow strip (`grazing`);
- small: the cell counts as a point, because its radius is much less than the thickness of the ray.

If only first hits are requested, the nearer cells of every ray are examined first, because most
other cells are then behind a hit.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.cells import models as model_rows
from service.engine.cells.bounding_spheres import PatchTree
from service.engine.cells.shares import Share
from service.engine.rays.bounds import (
    MAX_CONTRACTION,
    Rays,
    RootBounds,
    root_bounds,
    sphere_misses,
)
from service.engine.rays.grazing import MAX_SLOPE, find_grazed_strips
from service.engine.rays.hits import Hits, Source
from service.engine.rays.newton import (
    find_roots,
    find_strips,
    take_points,
)
from service.engine.vectors import dot

CHUNK_PAIRS = 1 << 13
"""How many pairs of a ray and a cell are computed at once; this limits the memory."""

MAX_PAIRS_OF_RAY, MAX_OPEN_PAIRS = 4096, 1 << 18
"""The most pairs that may be open on one level: of one ray, and of all rays that are searched
together. The search of a ray with more ends; with more in all, fewer rays are searched again."""

MAX_STRAIN = MAX_CONTRACTION / 3
"""A cell with more strain than this is halved without computing bounds, because no ray can be
settled in it. The strain of a cell is REST / min(|A|, |B|), in the notation of `ray_bounds`. With
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

NO_PAIRS = np.zeros(0, np.intp), np.zeros(0, np.intp)
"""An empty list of pairs (ray, cell)."""


def _join_pairs(pairs: list[tuple[Ints, Ints]]) -> tuple[Ints, Ints]:
    """Join lists of pairs of a ray and a cell to one list, in the order of rays."""
    filled = [pair for pair in pairs if len(pair[0])]
    if len(filled) < 2:
        return filled[0] if filled else NO_PAIRS
    ray, cell = (np.concatenate(pair) for pair in zip(*filled, strict=True))
    order = np.argsort(ray, kind="stable")
    return ray[order], cell[order]


class RayLevels:
    """The search for the hits of some rays.

    Parameters
    ----------
    patches : PatchTree
    rays : Rays
    share : Share
        How many pairs may still have their bounds computed; this number is divided among the rays.
    max_pairs_of_ray : int
        The most pairs that one ray may have in the tree of patches.
    only_first : bool
        Whether only the first hit of each ray is needed.
    can_split : bool
        Whether the search may end without a result if too many pairs are open, because the caller
        can then search fewer rays at a time.

    Attributes
    ----------
    reached : ndarray of bool, shape (m,)
        For each ray, whether `search` returns all of its hits.
    is_crowded : bool
        Whether the search ended because too many pairs were open.
    most_open : int
        The most pairs that were open on one level.
    in_tree : ndarray of int, shape (m,)
        How many pairs of each ray the tree of patches could not exclude.
    """

    def __init__(
        self,
        patches: PatchTree,
        rays: Rays,
        share: Share,
        max_pairs_of_ray: int,
        *,
        only_first: bool,
        can_split: bool,
    ) -> None:
        self.can_split, self.is_crowded, self.most_open = can_split, False, 0
        self.max_pairs_of_ray, self.in_tree = max_pairs_of_ray, np.zeros(len(rays.near), np.intp)
        self.share, self.waiting_pairs = share, NO_PAIRS
        """Pairs of the rays whose share is too small for this level; they are examined again."""
        self.only_first = only_first
        self.cells, self.patches, self.rays = patches.cells, patches, rays
        self.farthest = np.full(len(rays.near), np.inf)
        """For each ray, the largest t of interest."""
        self.reached = np.isfinite(rays.slack)
        self.is_later = np.zeros(len(rays.near), bool)
        """Which rays have pairs with farther cells that have not joined the search."""
        self.settled_pairs: list[tuple[Ints, Ints, FloatArray, RootBounds]] = []
        """Pairs for `apply_newton`: rays, cells, lower bounds of t, and bounds of the roots."""
        self.hits: list[Hits] = []

    def search(self) -> Hits | None:
        """Search all levels until no pair is open; None if the tree of patches leaves too many."""
        candidates = self.patches.candidates_on(self.rays, self.max_pairs_of_ray)
        if candidates is None:
            return None
        self.reached &= ~candidates.is_ended
        self.in_tree = np.bincount(candidates.ray, minlength=len(candidates.is_ended))
        # Rays that ended in the tree count with all pairs that they were allowed.
        self.in_tree[candidates.is_ended] = self.max_pairs_of_ray
        self.most_open = candidates.max_pairs
        (ray, cell), later_pairs = self.split_by_distance(candidates.ray, candidates.cell)
        self.is_later[later_pairs[0]] = True
        while len(ray) or self.settled_pairs or len(later_pairs[0]):
            if len(ray) - len(self.waiting_pairs[0]) <= MAX_NEAR_SHARE * len(later_pairs[0]):
                ray, cell = _join_pairs([(ray, cell), later_pairs])
                later_pairs = NO_PAIRS
                self.is_later[:] = False
            pairs = [self.step(ray, cell)]
            # Collect settled pairs until there are no more open pairs than settled pairs, because
            # Newton's method is faster for many pairs together.
            if sum(len(pair[0]) for pair in self.settled_pairs) >= len(pairs[0][0]):
                pairs.append(self.apply_newton())
            ray, cell = _join_pairs([*pairs, self.waiting_pairs])
        hits = Hits.join(self.hits)
        # Hits before the beginning of the ray do not count.
        return hits.take(hits.high >= self.rays.near[hits.ray])

    def split_by_distance(
        self, ray: Ints, cell: Ints
    ) -> tuple[tuple[Ints, Ints], tuple[Ints, Ints]]:
        """Split the first pairs into those with the nearer cells, and those with the farther cells.

        If all hits are needed, all pairs are in the first list.
        """
        if not self.only_first or not len(ray):
            return (ray, cell), NO_PAIRS
        center, radius = self.cells.models[:3, cell], self.cells.models[model_rows.RADIUS, cell]
        # The origins of rays are perpendicular to their directions, so (c − o) · d = c · d.
        low = dot(center, self.rays.direction[:, ray]) - radius
        starts = np.flatnonzero(np.diff(ray, prepend=-1))
        middle = (np.minimum.reduceat(low, starts) + np.maximum.reduceat(low, starts)) / 2
        is_near = low <= np.repeat(middle, np.diff(starts, append=len(ray)))
        return (ray[is_near], cell[is_near]), (ray[~is_near], cell[~is_near])

    def step(self, ray: Ints, cell: Ints) -> tuple[Ints, Ints]:
        """Examine one level of pairs; returns the pairs of the next level.

        Pairs that are settled on this level are stored for `apply_newton`.
        """
        self.waiting_pairs = NO_PAIRS
        meets, low = np.zeros(len(ray), bool), np.empty(len(ray))
        models, limit = self.cells.models, self.farthest[ray]
        for rows in row_slices(len(ray), 1, CHUNK_PAIRS):
            spheres = models[:4].take(cell[rows], axis=1)
            misses, low[rows] = sphere_misses(spheres, self.rays, ray[rows], limit[rows])
            meets[rows] = ~misses
        met_rows = np.flatnonzero(meets)
        is_point = (
            models[model_rows.RADIUS, cell[met_rows]]
            <= MAX_POINT_RADIUS * self.rays.thickness[ray[met_rows]]
        )
        if is_point.any():
            points = met_rows[is_point]
            self.hits.append(take_points(self.cells, self.rays, ray[points], cell[points]))
            met_rows = met_rows[~is_point]
        met_rows = self.allot_pairs(met_rows, ray, cell)
        is_coarse = models[model_rows.STRAIN, cell[met_rows]] > MAX_STRAIN
        open_pairs = [(ray[met_rows[is_coarse]], cell[met_rows[is_coarse]])]
        met_rows = met_rows[~is_coarse]
        # At least one chunk, which may be empty, so that each level has a checkpoint.
        for chunk in (
            met_rows[k : k + CHUNK_PAIRS] for k in range(0, max(len(met_rows), 1), CHUNK_PAIRS)
        ):
            checkpoint()
            open_pairs.append(self.bound_pairs(ray[chunk], cell[chunk], low[chunk]))
        return self.halve(*(np.concatenate(column) for column in zip(*open_pairs, strict=True)))

    def allot_pairs(self, met_rows: Ints, ray: Ints, cell: Ints) -> Ints:
        """Allot pairs to rays; returns the rows of `met_rows` whose rays may continue.

        The pairs of other rays wait for a later level, or end now.
        """
        counts = np.bincount(ray[met_rows], minlength=len(self.reached))
        is_served, is_ended = self.share.allot(counts, self.is_later)
        self.reached &= ~is_ended
        rows = met_rows[~(is_served | is_ended)[ray[met_rows]]]
        self.waiting_pairs = ray[rows], cell[rows]
        return met_rows[is_served[ray[met_rows]]]

    def bound_pairs(self, ray: Ints, cell: Ints, low: FloatArray) -> tuple[Ints, Ints]:
        """Compute the bounds of pairs; returns the pairs that stay open."""
        models, rays = self.cells.models, self.rays
        o, d = rays.origin.take(ray, axis=1), rays.direction.take(ray, axis=1)
        model = models[: model_rows.ROUND + 1].take(cell, axis=1)
        is_empty, is_settled, bounds = root_bounds(model, o, d, rays.slack[ray])
        rows = np.flatnonzero(is_settled)
        if len(rows):
            self.settled_pairs.append((ray[rows], cell[rows], low[rows], bounds))
            if self.only_first:
                is_sure = rows[bounds.exists & (low[rows] > rays.near[ray[rows]])]
                # A hit is at most 2 (radius + slack) behind `low`. That is less than 3 radii: the
                # radius is at least 8 times the slack, because smaller cells count as points.
                self.limit_search(
                    ray[is_sure], low[is_sure] + 3 * models[model_rows.RADIUS, cell[is_sure]]
                )
        rows = np.flatnonzero(~(is_empty | is_settled))
        normals = models[model_rows.NORMAL : model_rows.NORMAL + 3].take(cell[rows], axis=1)
        is_grazed = np.abs(dot(normals, d[:, rows])) <= MAX_SLOPE
        grazed = rows[is_grazed]
        open_rows = [rows[~is_grazed]]
        if len(grazed):
            open_rows.append(grazed[self.graze(ray[grazed], cell[grazed])])
        rows = np.concatenate(open_rows)
        return ray[rows], cell[rows]

    def graze(self, ray: Ints, cell: Ints) -> Bools:
        """Examine pairs whose ray is almost tangent to the cell; returns which stay open."""
        rays = self.rays
        model = self.cells.models.take(cell, axis=1)
        o, d = rays.origin.take(ray, axis=1), rays.direction.take(ray, axis=1)
        is_empty, is_thin, strips = find_grazed_strips(
            model, o, d, rays.slack[ray], rays.thickness[ray]
        )
        is_open = ~is_empty
        rows = np.flatnonzero(is_thin)
        if len(rows):
            hits, is_done = find_strips(self.cells, rays, ray[rows], cell[rows], strips)
            self.hits.append(hits)
            is_open[rows[is_done]] = False
        return is_open

    def limit_search(self, ray: Ints, t: FloatArray) -> None:
        """Do not search behind the hit at t, except for other hits at the same place."""
        np.minimum.at(self.farthest, ray, t + MAX_DISTANCE_BEHIND * self.rays.thickness[ray])

    def halve(self, ray: Ints, cell: Ints) -> tuple[Ints, Ints]:
        """Halve the cells of open pairs; returns the pairs with the halves.

        Rays that have too many pairs, or whose cells cannot be halved, end: they are not `reached`.
        """
        is_ended = np.bincount(ray, minlength=len(self.reached))[ray] > MAX_PAIRS_OF_RAY
        is_ended |= ~self.cells.can_halve(cell)
        if is_ended.any():
            self.reached[ray[is_ended]] = False
            is_kept = self.reached[ray]
            ray, cell = ray[is_kept], cell[is_kept]
        self.most_open = max(self.most_open, len(ray))
        if len(ray) > MAX_OPEN_PAIRS and self.can_split:
            self.is_crowded = True
            ray, cell = ray[:0], cell[:0]
        if not len(ray):
            return ray, cell
        order = np.argsort(ray, kind="stable")
        children, parents = self.cells.children(cell[order])
        return ray[order][parents], children

    def apply_newton(self) -> tuple[Ints, Ints]:
        """Apply Newton's method to the settled pairs.

        If only first hits are requested, the nearest cell of each ray comes first: a hit there may
        make the others unnecessary. Returns the pairs of the next level, with the halves of cells
        in which the method failed.
        """
        if not self.settled_pairs:
            return NO_PAIRS
        ray, cell, low = (
            np.concatenate([pairs[k] for pairs in self.settled_pairs]) for k in range(3)
        )
        bounds = RootBounds.join([pairs[3] for pairs in self.settled_pairs])
        self.settled_pairs = []
        parts = [np.arange(len(ray))]
        if self.only_first:
            order = np.lexsort((cell, low, ray))
            is_first = np.diff(ray[order], prepend=-1) > 0
            parts = [order[is_first], order[~is_first]]
        open_rows = []
        for part in parts:
            rows = part[low[part] <= self.farthest[ray[part]]]
            for chunk in (rows[k : k + CHUNK_PAIRS] for k in range(0, len(rows), CHUNK_PAIRS)):
                checkpoint()
                hits, is_done = find_roots(
                    self.cells, self.rays, ray[chunk], cell[chunk], bounds.take(chunk)
                )
                self.hits.append(hits)
                open_rows.append(chunk[~is_done])
                if self.only_first:
                    is_sure = (hits.label == Source.PROVED) & (hits.low > self.rays.near[hits.ray])
                    self.limit_search(hits.ray[is_sure], hits.t[is_sure])
        rows = np.concatenate(open_rows) if open_rows else np.zeros(0, np.intp)
        return self.halve(ray[rows], cell[rows])
