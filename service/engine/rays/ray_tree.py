"""The beginning of searches over pairs of a ray and a cell, in the tree of bounding spheres."""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.pair_search import PairBudget, Pairs, TreeSearch
from service.engine.rays.bounds import CHUNK_PAIRS, Rays, find_met_spheres, sphere_misses


class RayTree(TreeSearch):
    """A search of m rays that begins with the spheres that they meet.

    Parameters
    ----------
    spheres : BoundingSpheres
    rays : Rays
    budget : PairBudget
    can_split : bool
        Whether the caller can search fewer rays at a time.

    Attributes
    ----------
    farthest : ndarray of float64, shape (m,)
        For each ray, the largest t of interest.
    reached : ndarray of bool, shape (m,)
        For each ray, whether the search has not left out anything that it should find.
    """

    def __init__(
        self, spheres: BoundingSpheres, rays: Rays, budget: PairBudget, *, can_split: bool
    ) -> None:
        super().__init__(spheres, budget, can_split=can_split)
        self.rays = rays
        self.farthest = np.full(self.count, np.inf)
        self.reached = np.isfinite(rays.slack)

    def begin(self) -> Pairs | None:
        """The pairs of rays with the first cells that they may meet, by the spheres of these.

        None if fewer rays must be searched.
        """
        pairs = self.descend_tree(*self.find_first(self.spheres.levels[0]))
        if pairs is None:
            return None
        ray, cell = pairs
        if len(self.spheres.levels) > 1:
            is_met, _ = self.find_met(self.cells.models, ray, cell)
            ray, cell = ray[is_met], cell[is_met]
        self.in_tree = np.bincount(ray, minlength=self.count)
        for _, ended_ray, _ in self.ended:
            # Rays that ended in the tree count with all pairs that they were allowed.
            self.reached[ended_ray], self.in_tree[ended_ray] = False, self.budget.max_spheres
        self.charge_tree()
        return ray, cell

    def find_first(self, spheres: FloatArray) -> Pairs:
        """The pairs of rays with spheres of the first level that they may meet, by rays."""
        return find_met_spheres(spheres, self.rays)

    def examine_spheres(self, level: int, item: Ints, sphere: Ints) -> Ints:
        """The rows of spheres that rays may meet; those of the first level are known to be met."""
        if level == 0:
            return np.arange(len(item))
        return np.flatnonzero(self.find_met(self.spheres.levels[level], item, sphere)[0])

    def find_met(self, spheres: FloatArray, ray: Ints, sphere: Ints) -> tuple[Bools, FloatArray]:
        """Which pairs of a ray and a sphere, or that of a cell, may meet; lower bounds of t."""
        is_met, low, limit = np.empty(len(ray), bool), np.empty(len(ray)), self.farthest[ray]
        for rows in row_slices(len(ray), 1, CHUNK_PAIRS):
            chosen = spheres[:4].take(sphere[rows], axis=1)
            misses, low[rows] = sphere_misses(chosen, self.rays, ray[rows], limit[rows])
            is_met[rows] = ~misses
        return is_met, low

    def halve_open(self, ray: Ints, cell: Ints) -> Pairs:
        """Halve the cells of open pairs; returns the pairs with the halves.

        Rays that have too many pairs, or whose cells cannot be halved, end: they are not `reached`.
        """
        must_end = self.must_end(ray, cell)
        if must_end.any():
            self.reached[ray[must_end]] = False
            is_kept = self.reached[ray]
            ray, cell = ray[is_kept], cell[is_kept]
        order = np.argsort(ray, kind="stable")
        return self.halve(ray[order], cell[order])
