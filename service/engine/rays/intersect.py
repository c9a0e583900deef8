"""Hits of rays as arrays with a row for each hit, ordered by ray and by position on the ray."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.cells.tree import WorkLimits
from service.engine.closest.project import regular_normals, surface_columns
from service.engine.nets.query_nets import surface_nets
from service.engine.rays.hits import NO_HITS, Hits, Kind
from service.engine.rays.search import RaySearch
from service.errors import Issue, TooLarge
from service.surface.lowered import PatchModel

RELATIVE_THICKNESS = 1e-9
"""The default thickness of rays, in diagonals of the box of control points."""

LIMITS = WorkLimits(pairs=8_000_000, of_item=4096)
"""Most rays need 10 to 40 pairs; a pair takes 0.5 to 5 µs, including its new cells, so all pairs of
a request take at most 40 s. The search of a ray with too many pairs on a level ends."""

NAMES = np.array([kind.name.lower() for kind in Kind])
"""The name of each `Kind`, in lower case."""


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
    search = RaySearch(nets, query.relative_thickness * nets.diagonal / nets.scale, query.limits)
    count = 0
    parts: list[Hits] = []
    # For each hit, the sine of the angle between the ray and the tangent plane of the surface. A
    # sine is negative if the ray runs against the normal.
    sines: list[FloatArray] = []
    reached = []
    for chunk in search.find(query.origins, query.directions, only_first=query.only_first):
        parts.append(chunk.hits)
        sines.append(chunk.sines)
        reached.append(chunk.reached)
        count += len(chunk.sines)
        if count > max_hits:
            message = "The rays have more hits than one response may list."
            needed = f"at most {max_hits}; fewer rays, or their first hits alone"
            got = f"more than {max_hits} hits"
            raise TooLarge(Issue("too_many_hits", message, "/rays", got, needed))
    hits = Hits.join(parts or [NO_HITS])
    kind = hits.label  # after merging, `label` has the `Kind` of each hit
    with np.errstate(all="ignore"):
        lengths = np.sqrt(np.square(query.directions).sum(axis=1))[hits.ray]
        units = nets.scale / lengths
    # If a ray begins too far away for the search, its intervals are infinite. Replace their upper
    # ends: no point of the surface is farther than this from the origin of the ray.
    x, y, z = (nets.origin - query.origins[hits.ray]).T
    farthest = (np.hypot(np.hypot(x, y), z) + nets.diagonal) * (1 + 1e-14) / lengths
    high = np.where(np.isinf(hits.high), farthest, hits.high * units)
    is_crossing = kind == Kind.CROSSING
    entering = (np.concatenate([np.zeros(0), *sines]) < 0).tolist()
    columns: dict[str, Any] = {
        "reached": np.concatenate(reached),
        "counts": np.bincount(hits.ray, minlength=len(query.origins)),
        "ray": hits.ray,
        "t": hits.t * units,
        "t_bounds": np.stack([hits.low * units, high], axis=1),
        "positions": nets.origin + hits.position.T * nets.scale,
    }
    patch, local = nets.patch[hits.net], nets.parameters(hits.net, hits.parameters.T)
    columns |= surface_columns(model, patch, local, regular_normals(hits.du.T, hits.dv.T))
    return columns | {
        "kind": NAMES[kind].tolist(),
        "entering": [
            enters if crosses else None
            for enters, crosses in zip(entering, is_crossing.tolist(), strict=True)
        ],
    }
