"""Points, partials, normals and curvatures of a surface at given parameters, as JSON."""

from dataclasses import dataclass

from service.encoders import json_points
from service.engine.points.evaluate import estimate_effort, evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.errors import Issue
from service.measuring import Measured
from service.pipeline.checks import check_surface, require_patches
from service.pipeline.cost import Cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count
from service.pipeline.query_costs import points_cost
from service.surface.sizes import SurfaceKind


@dataclass(frozen=True, eq=False, slots=True)
class PointsWork:
    """The work of evaluating a surface at given parameters, and its cost."""

    surface: SurfaceKind
    query: PointsQuery
    limits: Limits
    cost: Cost

    def run(self) -> bytes:
        """Evaluate the surface, and write the response as JSON.

        Raises
        ------
        InvalidRequest
            A place is outside the domain, or its patch does not exist; `not_parametric`.
        TooLarge
            The patches of these places have too high degrees.
        """
        model = require_patches(self.surface.lower())
        places = locate(model, self.query)
        self.limits.check_effort(
            estimate_effort(model, places, self.query.order),
            "Patches of so high a degree take long where they are degenerate.",
            f"/{self.query.field}",
            "fewer points on fewer patches at once",
        )
        with Measured("points"):
            columns = evaluate_points(model, places, self.query.order)
        return json_points.encode(columns)


def plan_points(
    surface: SurfaceKind, query: PointsQuery, limits: Limits = DEFAULT_LIMITS
) -> PointsWork:
    """Plan the points of a surface: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    where, count = f"/{query.field}", len(query.places)
    message = "The query has more points than this service computes at once."
    check_count(count, limits.max_points, "points", Issue("too_many_points", message, where))
    byte_bound = json_points.byte_bound(count, query.order)
    limits.check_bytes(byte_bound, "The response could become too large.", where)
    size = surface.stored_size()
    check_surface(size, limits)
    cost = points_cost(size, count, query.order)
    limits.check_memory(cost.memory, "The response", where, "fewer points at once")
    return PointsWork(surface, query, limits, cost)
