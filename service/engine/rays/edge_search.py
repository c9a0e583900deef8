"""The places where rays pass edges, within reaches such as the gaps of the edges.

The search examines pairs of a ray and a piece of an edge, level by level. A piece is halved until
it is nearly its chord.

Proof in docs/proofs.md: "Rays near edges".
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins, row_slices
from service.cancellation import checkpoint
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.models import RADIUS
from service.engine.cells.pair_search import Chunks, PairBudget, Pairs, join_pairs
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.nets.partials import net_partials
from service.engine.nets.query_nets import QueryNets
from service.engine.rays.bounds import CHUNK_PAIRS, Rays
from service.engine.rays.edge_cells import EDGES, SIZE_A, bound_passes, find_near_spheres
from service.engine.rays.intervals import number_clusters
from service.engine.rays.ray_tree import RayTree
from service.engine.vectors import Items, cross, dot, length

MAX_FIRST_CELLS, MAX_ROOTS = 512, 2048
"""Before the search, edges are halved while there are fewer pieces than `MAX_FIRST_CELLS`. All
pieces, or at most `MAX_ROOTS` spheres about them, are tested with every ray."""

STEPS = 3
"""Gauss-Newton steps to the points of edges that are nearest to rays."""

FIRST_LENGTH = 1 / 16
"""Pieces that are shorter than this, in the coordinates of the nets, are not halved before."""


@dataclass(frozen=True, eq=False, slots=True)
class EdgePasses(Items):
    """n places where rays pass edges, at most one for each part of an edge near the ray.

    Attributes
    ----------
    ray, net : ndarray of int, shape (n,)
    parameter : ndarray of float64, shape (n,)
        The parameter of the net, from 0 to 1, of the point of the edge that is about the nearest.
    position : ndarray of float64, shape (3, n)
        This point.
    t, distance : ndarray of float64, shape (n,)
        The nearest point of the ray to it, and how far this is.
    low, high : ndarray of float64, shape (n,)
        The interval of t in which the edge is within its reach.
    """

    ray: Ints
    net: Ints
    parameter: FloatArray
    position: FloatArray
    t: FloatArray
    distance: FloatArray
    low: FloatArray
    high: FloatArray

    def of_rays(self, rays: Ints) -> "EdgePasses":
        """The passes of some rays, (m,); these get the numbers 0 to m − 1. Passes are by ray."""
        first = np.searchsorted(self.ray, rays)
        ray, row = expand_runs(np.searchsorted(self.ray, rays, side="right") - first, first)
        return replace(self.take(row), ray=ray)


_NUMBERS, _VALUES = np.zeros(0, np.intp), np.zeros(0)

NO_PASSES = EdgePasses(
    *(_NUMBERS, _NUMBERS, _VALUES, np.zeros((3, 0)), _VALUES, _VALUES, _VALUES, _VALUES)
)
"""An empty list of passes."""


class EdgeSearch:
    """Finds where rays pass edges.

    Parameters
    ----------
    nets : QueryNets
        Of degree (n, 0).
    edge : ndarray of int, shape (N,)
        The edge of each net.
    reach : ndarray of float64, shape (N,)
        How near each net counts, besides the thickness of the ray; in the coordinates of the nets.
    limits : WorkLimits
    sizes : (int, int, int)
        How many rays are searched together (`Chunks`).
    """

    def __init__(
        self,
        nets: QueryNets,
        edge: Ints,
        reach: FloatArray,
        limits: WorkLimits,
        sizes: tuple[int, int, int],
    ) -> None:
        self.nets, self.edge, self.sizes = nets, edge, sizes
        self.reach = reach
        self.cells = CellTree(nets, limits, EDGES)
        self.cells.halve_first(MAX_FIRST_CELLS, SIZE_A, FIRST_LENGTH)
        # The spheres contain all that is within the reaches.
        models, net = self.cells.models, self.cells.net
        models[RADIUS, : self.cells.count] += self.reach[net[: self.cells.count]]
        self.spheres = BoundingSpheres(self.cells, MAX_ROOTS)

    def find(self, rays: Rays) -> tuple[EdgePasses, Bools]:
        """All passes of the lines of m rays, by rays and by `low`; and which rays are reached.

        Passes behind the beginning of a ray count, too: they say where a strip is inside of trims.
        """
        rays = replace(rays, near=np.full(len(rays.near), -np.inf))
        chunks = Chunks(self.cells, len(rays.near), self.sizes)
        parts, reached = [NO_PASSES], []
        for rows, budget in chunks:
            chosen = rays.take(rows)
            levels = EdgeLevels(self, chosen, budget, can_split=chunks.can_split)
            passes = levels.search()
            if passes is None:
                chunks.split()
                continue
            parts.append(replace(passes, ray=passes.ray + rows.start))
            reached.append(levels.reached)
            chunks.grow(levels.most_open)
        return EdgePasses.join(parts), np.concatenate(reached)


class EdgeLevels(RayTree):
    """The search for the passes of some rays."""

    def __init__(
        self, search: EdgeSearch, rays: Rays, budget: PairBudget, *, can_split: bool
    ) -> None:
        super().__init__(search.spheres, rays, budget, can_split=can_split)
        self.nets, self.edge, self.reach = search.nets, search.edge, search.reach
        self.passes: list[EdgePasses] = [NO_PASSES]

    def search(self) -> EdgePasses | None:
        """Search all levels until no pair is open; None if fewer rays must be searched."""
        pairs = self.begin()
        if pairs is None:
            return None
        ray, cell = pairs
        while len(ray):
            checkpoint()
            ray, cell = join_pairs([self.step(ray, cell), self.waiting_pairs])
        if self.takes_too_much:
            return None
        return self.join(EdgePasses.join(self.passes))

    def find_first(self, spheres: FloatArray) -> Pairs:
        """The pairs of rays with spheres of the first level that they may meet, by rays."""
        return find_near_spheres(spheres, self.rays)

    def step(self, ray: Ints, cell: Ints) -> Pairs:
        """Examine one level of pairs; returns the pairs of the next level."""
        rows, ended = self.allot_pairs(np.arange(len(ray)), ray, cell)
        self.reached[ray[ended]] = False
        open_rows = []
        for chunk in row_slices(len(rows), 1, CHUNK_PAIRS):
            own = rows[chunk]
            item, piece = ray[own], cell[own]
            net = self.cells.net[piece]
            reach = self.reach[net] + self.rays.thickness[item]
            is_met, is_done, passes = bound_passes(self.cells, self.rays, item, piece, reach)
            open_rows.append(own[is_met & ~is_done])
            done = np.flatnonzero(is_met & is_done)
            if len(done):
                low, high, share, distance = passes[:, done]
                begin, end = self.cells.rectangle[:2, piece[done]]
                places = begin + share * (end - begin), np.zeros((3, len(done))), low
                self.passes.append(EdgePasses(item[done], net[done], *places, distance, low, high))
        own = np.concatenate([*open_rows, np.zeros(0, np.intp)])
        return self.halve_open(ray[own], cell[own])

    def join(self, passes: EdgePasses) -> EdgePasses:
        """One pass for each part of an edge that is near, at the nearest point of its pieces."""
        edge = self.edge[passes.net]
        order = np.lexsort((passes.low, edge, passes.ray))
        passes, edge = passes.take(order), edge[order]
        group = passes.ray * (int(self.edge.max(initial=0)) + 1) + edge
        cluster = number_clusters(group, passes.low, passes.high)
        first = find_begins(cluster)
        if not len(first):
            return passes
        low = np.minimum.reduceat(passes.low, first)
        high = np.maximum.reduceat(passes.high, first)
        nearest = np.lexsort((passes.parameter, passes.net, passes.distance, cluster))[first]
        chosen = replace(passes.take(nearest), low=low, high=high)
        chosen = chosen.take(np.lexsort((chosen.net, chosen.low, chosen.ray)))
        return self.approach(chosen)

    def approach(self, passes: EdgePasses) -> EdgePasses:
        """Passes with the positions of their parameters, after some steps to nearer points."""
        d, origin = self.rays.direction[:, passes.ray], self.rays.origin[:, passes.ray]
        parameter, best = passes.parameter, passes
        for step in range(STEPS + 1):
            parameters = np.stack([parameter, np.zeros(len(parameter))])
            position, along, _ = net_partials(self.nets, passes.net, parameters, 1)
            y = position - origin
            off, turn = cross(y, d), cross(along, d)
            distance = length(off)
            t = dot(y, d)
            places = {"parameter": parameter, "position": position, "t": t}
            is_nearer = (distance < best.distance) & (passes.low <= t) & (t <= passes.high)
            is_nearer |= step == 0
            columns = {
                name: np.where(is_nearer, values, getattr(best, name))
                for name, values in (places | {"distance": distance}).items()
            }
            best = replace(best, **columns)
            square = dot(turn, turn)
            change = dot(off, turn) / np.where(square > 0, square, 1.0)
            parameter = np.clip(parameter - change, 0.0, 1.0)
        return best
