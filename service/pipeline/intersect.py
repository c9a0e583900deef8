"""The hits of rays on a surface, as JSON."""

from functools import partial

from service.encoders.text import json_document
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.measuring import Measured
from service.pipeline.checks import check_surface, number_patches
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_items
from service.pipeline.query_costs import HIT_JSON_BYTES, rays_cost, searched_nets
from service.surface.sizes import SurfaceKind

MAX_RAYS = 100_000
"""The most rays of a query."""

HITS_PER_RAY, MIN_HITS = 8, 10_000
"""If a request asks for all hits of each ray, the response may list at most `HITS_PER_RAY` times
the number of rays, or at most `MIN_HITS` hits if that is more."""


def plan_intersect(
    surface: SurfaceKind, query: RayQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the hits of rays: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    max_hits = count = len(query.origins)
    check_items("too_many_rays", count, min(MAX_RAYS, limits.max_points), "/rays")
    if not query.only_first:
        max_hits = min(max(HITS_PER_RAY * count, MIN_HITS), limits.max_bytes // HIT_JSON_BYTES)
    size = surface.stored_size()
    check_surface(size, limits)
    # The response has the number of hits of each ray.
    file_bytes = 1000 + count * 16 + max_hits * HIT_JSON_BYTES
    cost = rays_cost(searched_nets(size), count, max_hits, file_bytes)
    limits.check_bytes(file_bytes, "/rays")
    instead = "a smaller surface, fewer rays at once"
    limits.check_memory(cost.memory, "The response", "/rays", instead)
    return Work(cost, partial(_intersect, surface, query, max_hits))


def _intersect(surface: SurfaceKind, query: RayQuery, max_hits: int) -> bytes:
    """Find the hits, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon has no patches.
    TooLarge
        `too_many_hits`.
    """
    model = number_patches(surface.lower())
    with Measured("intersect"):
        return json_document(intersect_rays(model, query, max_hits))
