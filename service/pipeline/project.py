"""Closest points on a surface or a curve, with intervals that contain the distances, as JSON."""

from functools import partial

from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.closest.project import ProjectQuery, project_on_curve, project_on_surface
from service.measuring import Measured
from service.pipeline.checks import check_surface, number_patches
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_items
from service.pipeline.query_costs import SearchedNets, project_cost, searched_nets
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.sizes import SurfaceKind

MAX_POINTS = 100_000
"""The most points of a query."""

POINT_NUMBERS = 16
"""The most numbers that a response has for each point."""


def plan_project(
    shape: SurfaceKind | Curve, query: ProjectQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan a query for closest points: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The shape or the query exceeds a limit.
    """
    count, where = len(query.points), "/points"
    check_items("too_many_points", count, min(MAX_POINTS, limits.max_points), where)
    file_bytes = 1000 + count * POINT_NUMBERS * (FLOAT64_CHARS + 2)
    limits.check_bytes(file_bytes, where)
    if isinstance(shape, BezierCurve | BsplineCurve):
        pieces = shape.lower()  # takes no time: the curve was lowered when it was created
        nets = SearchedNets(pieces.count, (pieces.degree, 0), pieces.points.nbytes)
    else:
        size = shape.stored_size()
        check_surface(size, limits)
        nets = searched_nets(size)
    cost = project_cost(nets, count, file_bytes, sign=query.sign)
    instead = "a smaller surface, fewer points at once"
    limits.check_memory(cost.memory, "The response", where, instead)
    return Work(cost, partial(_project, shape, query))


def _project(shape: SurfaceKind | Curve, query: ProjectQuery) -> bytes:
    """Find the closest points, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon has no patches.
    """
    if isinstance(shape, BezierCurve | BsplineCurve):
        with Measured("project"):
            return json_document(project_on_curve(shape.lower(), query))
    model = number_patches(shape.lower())
    with Measured("project"):
        return json_document(project_on_surface(model, query))
