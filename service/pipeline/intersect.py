"""The hits of rays on a surface, as JSON."""

from dataclasses import dataclass

from service.encoders.text import json_document
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.errors import Issue
from service.measuring import Measured
from service.pipeline.checks import check_surface
from service.pipeline.cost import Cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count
from service.pipeline.project import query_patches
from service.pipeline.query_costs import HIT_JSON_BYTES, rays_cost
from service.surface.sizes import SurfaceKind

MAX_RAYS = 100_000
"""The most rays of a query."""

HITS_PER_RAY, MIN_HITS = 8, 10_000
"""If a request asks for all hits of each ray, the response may list at most `HITS_PER_RAY` times
the number of rays, or at most `MIN_HITS` hits if that is more."""


@dataclass(frozen=True, eq=False, slots=True)
class IntersectWork:
    """The work of finding the hits of rays, and its cost."""

    surface: SurfaceKind
    query: RayQuery
    max_hits: int
    cost: Cost

    def run(self) -> bytes:
        """Find the hits, and write the response as JSON.

        Raises
        ------
        InvalidRequest
            `not_parametric`: a tube or a ribbon has no patches.
        TooLarge
            `too_many_hits`.
        """
        model = query_patches(self.surface)
        with Measured("intersect"):
            return json_document(intersect_rays(model, self.query, self.max_hits))


def plan_intersect(
    surface: SurfaceKind, query: RayQuery, limits: Limits = DEFAULT_LIMITS
) -> IntersectWork:
    """Plan the hits of rays: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    count, where = len(query.origins), "/rays"
    message = "The query has more rays than this service computes at once."
    max_rays = min(MAX_RAYS, limits.max_points)
    check_count(count, max_rays, "rays", Issue("too_many_rays", message, where))
    max_hits = count
    if not query.only_first:
        max_hits = min(max(HITS_PER_RAY * count, MIN_HITS), limits.max_bytes // HIT_JSON_BYTES)
    size = surface.stored_size()
    check_surface(size, limits)
    # A triangular patch may become three nets. The cost is computed as if all patches were
    # triangular.
    cost = rays_cost(3 * size.patches, size.degree, size.peak_bytes, count, max_hits)
    limits.check_bytes(cost.bytes, "The response could become too large.", where)
    limits.check_memory(cost.memory, "The response", where, "a smaller surface, fewer rays at once")
    return IntersectWork(surface, query, max_hits, cost)
