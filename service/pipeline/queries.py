"""Queries whose answers are JSON: points at parameters, closest points, and hits of rays."""

from functools import partial

from service.encoders.json_mesh import points_bound
from service.encoders.text import FLOAT64_CHARS, json_document
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.engine.closest.project import ProjectQuery, project_on_curve, project_on_surface
from service.engine.parts.intersect import intersect_part
from service.engine.parts.points import (
    PartPoints,
    evaluate_on_part,
    find_inside_trims,
    locate_on_part,
)
from service.engine.parts.project import project_on_part
from service.engine.points.evaluate import estimate_effort, evaluate_points
from service.engine.points.places import PointsQuery, locate
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.engine.trims.inside import INSIDE, OUTSIDE, UNDECIDED
from service.errors import InvalidRequest
from service.measuring import Measured
from service.pipeline.checks import require_numbered_patches, require_patches
from service.pipeline.cost import Work
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_items
from service.pipeline.parts import (
    check_asked,
    describe_skipped,
    has_breps,
    prepare_part,
    require_exact,
)
from service.pipeline.query_costs import (
    HIT_JSON_BYTES,
    SearchedNets,
    points_cost,
    project_cost,
    rays_cost,
    searched_nets,
    skipped_bytes,
)
from service.surface.brep_model import BrepModel
from service.surface.curve import BezierCurve, BsplineCurve, Curve
from service.surface.lowered import GroupModel
from service.surface.sizes import SurfaceKind

MAX_ITEMS = 100_000
"""The most points or rays for which a query searches."""

POINT_NUMBERS = 16
"""The most numbers that a response has for each closest point."""

HITS_PER_RAY, MIN_HITS = 8, 10_000
"""If a request asks for all hits of each ray, the response may list at most `HITS_PER_RAY` times
the number of rays, or at most `MIN_HITS` hits if that is more."""


def plan_points(
    surface: SurfaceKind, query: PointsQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the points of a surface: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    InvalidRequest
        `not_parametric`: a ribbon, or a tube that is not made of patches.
    """
    surface = require_exact(surface)
    where, count = f"/{query.field}", len(query.places)
    check_items("too_many_points", count, limits.max_points, where)
    limits.check_bytes(points_bound(count, query.order), where)
    size = check_asked(surface.stored_size(), limits)
    cost = points_cost(size, count, query.order)
    limits.check_memory(cost.memory, "The response", where, "fewer points at once")
    return Work(cost, partial(_evaluate, surface, query, limits))


def _evaluate(surface: SurfaceKind, query: PointsQuery, limits: Limits) -> bytes:
    """Evaluate the surface, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        A place is outside the domain, or its patch does not exist; a face of a brep is invalid.
    TooLarge
        The patches of these places have too high degrees.
    """
    lowered = surface.lower()
    message = "Patches of so high a degree take long where they are degenerate."

    def check_effort(effort: int) -> None:
        instead = "fewer points on fewer patches at once"
        limits.check_effort(effort, message, f"/{query.field}", instead)

    if isinstance(lowered, GroupModel | BrepModel):
        points = locate_on_part(lowered, query)
        with Measured("points"):
            columns = evaluate_on_part(points, query.order, check_effort)
            return json_document(columns | _find_inside(lowered, points))
    model = require_patches(lowered)
    places = locate(model, query)
    check_effort(estimate_effort(model, places, query.order))
    with Measured("points"):
        return json_document(evaluate_points(model, places, query.order))


def _find_inside(model: GroupModel | BrepModel, points: PartPoints) -> dict[str, list[bool | None]]:
    """The column `inside`, None where this is not decided; no column if there are no breps."""

    def prepare_model(number: int, brep: BrepModel) -> PreparedBrep:
        try:
            return prepare(brep)
        except InvalidRequest as error:
            where = model.locate(number) if isinstance(model, GroupModel) else ""
            raise error.within(f"/surface{where}") from None

    inside = find_inside_trims(points, prepare_model)
    if inside is None:
        return {}
    answers = {INSIDE: True, OUTSIDE: False, UNDECIDED: None}
    return {"inside": [answers[each] for each in inside.tolist()]}


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
    check_items("too_many_points", count, min(MAX_ITEMS, limits.max_points), where)
    file_bytes = 1000 + count * POINT_NUMBERS * (FLOAT64_CHARS + 2)
    if isinstance(shape, BezierCurve | BsplineCurve):
        pieces = shape.lower()  # takes no time: the curve was lowered when it was created
        nets = SearchedNets(pieces.count, (pieces.degree, 0), pieces.points.nbytes)
    else:
        shape = require_exact(shape)
        size = check_asked(shape.size(), limits)
        nets = searched_nets(size)
        file_bytes += skipped_bytes(size)
    limits.check_bytes(file_bytes, where)
    cost = project_cost(nets, count, file_bytes, sign=query.sign)
    instead = "a smaller surface, fewer points at once"
    limits.check_memory(cost.memory, "The response", where, instead)
    return Work(cost, partial(_project, shape, query))


def _project(shape: SurfaceKind | Curve, query: ProjectQuery) -> bytes:
    """Find the closest points, and write the response as JSON.

    Raises
    ------
    InvalidRequest
        `no_faces`: a brep has no valid face; or a face is invalid.
    """
    if isinstance(shape, BezierCurve | BsplineCurve):
        with Measured("project"):
            return json_document(project_on_curve(shape.lower(), query))
    lowered = shape.lower()
    with Measured("project"):
        if has_breps(lowered):
            part = prepare_part(lowered)
            return json_document(project_on_part(part, query) | describe_skipped(part))
        return json_document(project_on_surface(require_numbered_patches(lowered), query))


def plan_intersect(
    surface: SurfaceKind, query: RayQuery, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the hits of rays: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    surface = require_exact(surface)
    max_hits = count = len(query.origins)
    check_items("too_many_rays", count, min(MAX_ITEMS, limits.max_points), "/rays")
    if not query.only_first:
        max_hits = min(max(HITS_PER_RAY * count, MIN_HITS), limits.max_bytes // HIT_JSON_BYTES)
    size = check_asked(surface.size(), limits)
    # The response has the number of hits of each ray.
    file_bytes = 1000 + count * 16 + max_hits * HIT_JSON_BYTES + skipped_bytes(size)
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
        `no_faces`: a brep has no valid face; or a face is invalid.
    TooLarge
        `too_many_hits`.
    """
    lowered = surface.lower()
    with Measured("intersect"):
        if has_breps(lowered):
            part = prepare_part(lowered)
            return json_document(intersect_part(part, query, max_hits) | describe_skipped(part))
        return json_document(intersect_rays(require_numbered_patches(lowered), query, max_hits))
