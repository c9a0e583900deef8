"""Points, partials, normals and curvatures of a surface at given parameters, as JSON."""

from functools import partial

from service.encoders.json_mesh import points_bound
from service.encoders.text import json_document
from service.engine.points.evaluate import estimate_effort, evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.measuring import Measured
from service.pipeline.checks import check_surface, require_patches
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_items
from service.pipeline.query_costs import points_cost
from service.surface.sizes import SurfaceKind


def plan_points(
    surface: SurfaceKind, query: PointsQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the points of a surface: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    where, count = f"/{query.field}", len(query.places)
    check_items("too_many_points", count, limits.max_points, where)
    limits.check_bytes(points_bound(count, query.order), where)
    size = surface.stored_size()
    check_surface(size, limits)
    cost = points_cost(size, count, query.order)
    limits.check_memory(cost.memory, "The response", where, "fewer points at once")
    return Work(cost, partial(_evaluate, surface, query, limits))


def _evaluate(surface: SurfaceKind, query: PointsQuery, limits: Limits) -> bytes:
    """Evaluate the surface, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        A place is outside the domain, or its patch does not exist; `not_parametric`.
    TooLarge
        The patches of these places have too high degrees.
    """
    model = require_patches(surface.lower())
    places = locate(model, query)
    limits.check_effort(
        estimate_effort(model, places, query.order),
        "Patches of so high a degree take long where they are degenerate.",
        f"/{query.field}",
        "fewer points on fewer patches at once",
    )
    with Measured("points"):
        columns = evaluate_points(model, places, query.order)
    return json_document(columns)
