"""Hits of rays on a surface, with a proof that no hit is missed.

The *thickness* τ of a ray o + t d is a distance: a point of the surface that is nearer to the ray
may count as a hit. The search examines pairs of a ray and a cell of a patch, for all rays and all
patches together, level by level (`levels`). It has finished with a pair if

- the cell does not meet the ray;
- the pair is *settled*: the cell meets the ray at most once, and Newton's method decides whether it
  does (`bounds`);
- the pair is *thin*: the ray is almost tangent to the cell, and the part of the cell that it may
  meet is within τ of it (`grazing`);
- the cell is *small*, compared with τ; or
- only first hits are requested, and the cell is behind a proved hit.

Otherwise the cell is halved. The work for a ray is limited. A ray is *reached* if its search does
not end at one of the limits, and if rounding does not require a thickness larger than τ.

At a proved hit, the surface and the ray cross. If a ray only comes nearer than τ to the surface, or
to its border, an edge or a pole, a hit may be reported there, too.

Proof in docs/proofs.md: "No hit is missed".
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.cells import models as model_rows
from service.engine.cells.bounding_spheres import BoundingSpheres
from service.engine.cells.pair_search import Chunks, PairBudget
from service.engine.cells.tree import CellTree, WorkLimits
from service.engine.nets.query_nets import QueryNets, surface_nets
from service.engine.points.surface_columns import surface_columns
from service.engine.rays.bounds import Rays, local_rays
from service.engine.rays.edge_merging import merge_at_edges
from service.engine.rays.edge_search import NO_PASSES, EdgePasses, EdgeSearch
from service.engine.rays.hits import MIN_LENGTH_ALONG, NO_HITS, Hits, Kind, merge_hits
from service.engine.rays.levels import MAX_STRAIN, RayLevels
from service.engine.rays.net_sides import NetSides
from service.engine.rays.newton import begin_at_origins
from service.engine.rays.trimming import RayTrims
from service.engine.trims.trimmed_nets import NetTrims
from service.engine.vectors import length
from service.errors import Issue, TooLarge
from service.surface.lowered import PatchModel

RELATIVE_THICKNESS = 1e-9
"""The default thickness of rays, in diagonals of the box of control points."""

LIMITS = WorkLimits(pairs=8_000_000, of_item=4096)
"""Most rays need 10 to 40 pairs; a pair takes 0.5 to 5 µs, including its new cells, so all pairs of
a request take at most 40 s. The search of a ray with too many pairs on a level ends."""

NAMES = np.array([kind.name.lower() for kind in Kind])
"""The name of each `Kind`, in lower case."""

CHUNK_SIZES = 16, 1 << 14, 1 << 16
"""How many rays are searched together (`Chunks`)."""

MAX_FIRST_CELLS, MAX_NUMBERS = 128, 1 << 16
"""Before the search, patches are halved into at most `MAX_FIRST_CELLS` cells, whose nets have at
most `MAX_NUMBERS` numbers together; these cells are tested with every ray. If there are more
patches, at most `MAX_FIRST_CELLS` spheres of the tree of spheres are tested with every ray."""


@dataclass(frozen=True, eq=False, slots=True)
class RayQuery:
    """Rays, and which of their hits the service shall report.

    Attributes
    ----------
    origins, directions : ndarray of float64, shape (m, 3)
        In model units; directions of any length but 0.
    only_first : bool
        Whether to report only the first hit of each ray, or all hits.
    relative_thickness : float
        The largest distance from a ray at which a point of the surface may count as a hit, in
        diagonals of the box of control points.
    limits : WorkLimits
        The most work of the search.
    """

    origins: FloatArray
    directions: FloatArray
    only_first: bool = True
    relative_thickness: float = RELATIVE_THICKNESS
    limits: WorkLimits = LIMITS


@dataclass(frozen=True, eq=False, slots=True)
class RayBorders:
    """The trims and the edges of nets of trimmed faces.

    Attributes
    ----------
    trims : NetTrims
    edges : EdgeSearch or None
        None if there are no edges.
    sides : NetSides
    list_hits : callable or None
        Makes hits of passes: for each pass one for each face at the edge, on a net of this face,
        with the label `EDGE` or `LONG_EDGE`.
    """

    trims: NetTrims
    edges: EdgeSearch | None
    sides: NetSides
    list_hits: Callable[[EdgePasses], Hits] | None

    def find_passes(self, rays: Rays) -> tuple[EdgePasses, Bools]:
        """Where rays (m,) pass edges, and whether all of these places are found."""
        if self.edges is None:
            return NO_PASSES, np.ones(len(rays.near), bool)
        return self.edges.find(rays)

    def merge(self, hits: Hits, passes: EdgePasses, rays: Rays, min_length_along: float) -> Hits:
        """Merge hits and passes of edges to one hit for each place."""
        passes = passes.take(passes.high >= rays.near[passes.ray])
        if self.list_hits is not None and len(passes.ray):
            hits = Hits.join([hits, self.list_hits(passes)])
        return merge_at_edges(hits, self.sides, rays, min_length_along)


def intersect_rays(model: PatchModel, query: RayQuery, max_hits: int) -> dict[str, Any]:
    """Find the hits of rays on a surface.

    Returns
    -------
    dict of ndarray or list
        For m rays:

        - reached (m,): whether the search of the ray was completed, so that no requested hit is
          missing
        - counts (m,): the number of hits

        For n hits:

        - ray (n,): the number of the ray
        - t (n,): in units of the direction in the request
        - t_bounds (n, 2): the ends of an interval of t. It contains all points on the ray that are
          also on the surface and that this hit represents.
        - positions (n, 3), normals (n, 3), patch (n,) and uv (n, 2), as in `project_on_surface`
        - kind: a list of "crossing", "touching" or "along"
        - entering: a list of True (the ray crosses against the normal), False (it crosses in the
          direction of the normal) or None (it does not cross)

    Raises
    ------
    TooLarge
        `too_many_hits`: more than `max_hits`.
    """
    nets = surface_nets(model.batches)
    rays, hits, columns = find_hits(RaySearch(nets, query), query, max_hits)
    patch, local = nets.patch[hits.net], nets.parameters(hits.net, hits.parameters.T)
    columns |= surface_columns(model, patch, local, hits.du, hits.dv)
    return columns | list_kinds(hits, hits.sines(rays.direction[:, hits.ray]))


def find_hits(
    search: "RaySearch", query: RayQuery, max_hits: int
) -> tuple[Rays, Hits, dict[str, Any]]:
    """The rays in the coordinates of nets, their hits, and columns that do not depend on patches.

    Raises
    ------
    TooLarge
        `too_many_hits`: more than `max_hits`.
    """
    nets = search.cells.nets
    rays = local_rays(nets, query.origins, query.directions, search.thickness)
    count = 0
    parts: list[Hits] = []
    reached = []
    for chunk_hits, chunk_reached in search.find(rays, only_first=query.only_first):
        parts.append(chunk_hits)
        reached.append(chunk_reached)
        count += len(chunk_hits.ray)
        if count > max_hits:
            message = "The rays have more hits than one response may list."
            needed = f"at most {max_hits}; fewer rays, or their first hits alone"
            got = f"more than {max_hits} hits"
            raise TooLarge(Issue("too_many_hits", message, "/rays", got, needed))
    hits = Hits.join(parts or [NO_HITS])
    with np.errstate(all="ignore"):
        lengths = length(query.directions, -1)[hits.ray]
        units = nets.scale / lengths
    # If a ray begins too far away for the search, its intervals are infinite. Replace their upper
    # ends: no point of the surface is farther than this from the origin of the ray.
    x, y, z = (nets.origin - query.origins[hits.ray]).T
    farthest = (np.hypot(np.hypot(x, y), z) + nets.diagonal) * (1 + 1e-14) / lengths
    high = np.where(np.isinf(hits.high), farthest, hits.high * units)
    return (
        rays,
        hits,
        {
            "reached": np.concatenate(reached),
            "counts": np.bincount(hits.ray, minlength=len(query.origins)),
            "ray": hits.ray,
            "t": hits.t * units,
            "t_bounds": np.stack([hits.low * units, high], axis=1),
            "positions": nets.origin + hits.position.T * nets.scale,
        },
    )


def list_kinds(hits: Hits, sines: FloatArray) -> dict[str, Any]:
    """The columns `kind` and `entering` of merged hits (n,)."""
    kind = hits.label  # after merging, `label` has the `Kind` of each hit
    is_crossing = (kind == Kind.CROSSING).tolist()
    # A ray enters if it runs against the normal.
    entering = (sines < 0).tolist()
    return {
        "kind": NAMES[kind].tolist(),
        "entering": [
            enters if crosses else None
            for enters, crosses in zip(entering, is_crossing, strict=True)
        ],
    }


class RaySearch:
    """Finds the hits of rays on one surface, or on trimmed faces.

    Parameters
    ----------
    nets : QueryNets
    query : RayQuery
    borders : RayBorders or None
        The trims of the nets, and their edges.

    Attributes
    ----------
    thickness : float
        τ, in the coordinates of the nets.
    """

    def __init__(self, nets: QueryNets, query: RayQuery, borders: RayBorders | None = None) -> None:
        # The diagonal of the model, divided by the scale, is in the coordinates of the nets.
        diagonal = nets.diagonal / nets.scale
        self.thickness = query.relative_thickness * diagonal
        self.min_length_along = MIN_LENGTH_ALONG * (self.thickness * diagonal) ** 0.5
        self.borders = borders
        trims = None if borders is None else borders.trims
        self.cells = CellTree(nets, query.limits, trims=trims)
        max_cells = min(
            MAX_FIRST_CELLS, MAX_NUMBERS // max(group.nets[0].size for group in nets.groups)
        )
        # In cells with more strain than this no ray can be settled.
        self.cells.halve_first(max_cells, model_rows.STRAIN, MAX_STRAIN)
        self.spheres = BoundingSpheres(self.cells, MAX_FIRST_CELLS)
        # The most pairs that were open on one level, in all searches.
        self.most_open = 0

    def find(self, rays: Rays, *, only_first: bool) -> Iterator[tuple[Hits, Bools]]:
        """Find the hits of rays; yields the hits of some rays, and which of these are reached.

        Hits are in the order of rays and of t; t = 0 is the origin of the ray in the request. If
        `only_first`, only the first hit of each ray is found.
        """
        passes = None
        if self.borders is not None:
            passes, passes_reached = self.borders.find_passes(rays)
        chunks = Chunks(self.cells, len(rays.near), CHUNK_SIZES)
        for rows, budget in chunks:
            chosen = rays.take(rows)
            own = None if passes is None else passes.of_rays(np.arange(len(rays.near))[rows])
            result = self._search(
                chosen, own, budget, only_first=only_first, can_split=chunks.can_split
            )
            if result is None:
                chunks.split()
                continue
            hits, reached = result
            if only_first:
                hits = self._complete_first_hits(chosen, own, budget, hits, reached)
            if passes is not None:
                reached &= passes_reached[rows]
            # From here on, t is 0 at the origin of the request, where the ray begins.
            begins = chosen.near[hits.ray]
            ends = (np.maximum(value - begins, 0.0) for value in (hits.t, hits.low, hits.high))
            t, low, high = ends
            # The proof needs τ; rounding may have required a larger thickness of a ray.
            reached &= chosen.thickness <= self.thickness
            yield replace(hits, ray=hits.ray + rows.start, t=t, low=low, high=high), reached
            chunks.grow(self.most_open)

    def _complete_first_hits(
        self,
        rays: Rays,
        passes: EdgePasses | None,
        budget: PairBudget,
        hits: Hits,
        reached: Bools,
    ) -> Hits:
        """The first hits of rays, with complete intervals; `reached` is updated.

        The search ended behind proved crossings, so the intervals of other first hits may be
        incomplete: these rays are searched again for all hits.
        """
        hits = hits.take(is_first(hits))
        is_crossing = (hits.label == Kind.CROSSING) & ~hits.is_near_edge
        repeated = hits.ray[~is_crossing]
        if not len(repeated):
            return hits
        pairs = budget.pairs - int(budget.spent.sum())
        rest = PairBudget(pairs, len(repeated), budget.max_spheres)
        own = None if passes is None else passes.of_rays(repeated)
        result = self._search(rays.take(repeated), own, rest, only_first=False, can_split=False)
        budget.spent[repeated] += rest.spent
        budget.spent_spheres += rest.spent_spheres
        if result is None:
            return hits
        complete, complete_reached = result
        reached[repeated] &= complete_reached
        complete = complete.take(is_first(complete))
        complete.ray[:] = repeated[complete.ray]
        hits = Hits.join([hits.take(is_crossing), complete])
        return hits.take(np.argsort(hits.ray, kind="stable"))

    def _search(
        self,
        rays: Rays,
        passes: EdgePasses | None,
        budget: PairBudget,
        *,
        only_first: bool,
        can_split: bool,
    ) -> tuple[Hits, Bools] | None:
        """Find the hits of some rays, merged to one for each place, and which rays are reached."""
        borders, trims = self.borders, None
        if borders is not None and passes is not None:
            trims = RayTrims.of(borders.trims, passes)
        levels = RayLevels(
            self.spheres, rays, budget, only_first=only_first, can_split=can_split, trims=trims
        )
        hits = levels.search()
        self.most_open = max(self.most_open, levels.most_open)
        if hits is None:
            return None
        if borders is not None and passes is not None:
            merged = borders.merge(hits, passes, rays, self.min_length_along)
        else:
            sines = hits.sines(rays.direction[:, hits.ray])
            merged = merge_hits(hits, sines, rays, self.min_length_along)
        return begin_at_origins(self.cells, rays, merged), levels.reached


def is_first(hits: Hits) -> Bools:
    """Which hits are the first of their rays."""
    return np.diff(hits.ray, prepend=-1) > 0
