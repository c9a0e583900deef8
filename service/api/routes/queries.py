"""Routes of queries: closest points, hits of rays, sections by planes, and measures."""

from contextlib import suppress
from typing import Any

from fastapi import APIRouter, Response

from service.api.array_route import ArrayRoute
from service.api.body import BodyRoute
from service.api.errors import InvalidQuery
from service.api.models.queries import ClosestPoints, Intersections, SurfaceMeasures
from service.api.negotiation import format_by_accept
from service.api.openapi.parameters import (
    REQUESTS,
    array_body,
    format_parameter,
    scalar_options,
    surface_body,
)
from service.api.openapi.responses import (
    CODED,
    FILE_HEADERS,
    POST_ERRORS,
    READING,
    TIMED,
    error,
    show_responses,
    success,
)
from service.api.responses import HEADERS, bytes_response, file_response, reading_headers
from service.api.services import ContextDep
from service.decoders.npy import read_array
from service.decoders.registry import DECODERS
from service.encoders.polylines.registry import SECTION_FORMATS, SECTIONS_BY_NAME
from service.engine.measures.values import BudgetEnded
from service.errors import InvalidRequest, Issue
from service.pipeline.measure import plan_measure, plan_trials
from service.pipeline.polylines import plan_sections
from service.pipeline.queries import plan_intersect, plan_project
from service.schemas.intersect import IntersectRequest
from service.schemas.queries import MeasureRequest, ProjectRequest


class IntersectRoute(ArrayRoute):
    """A route whose response is in a format for sections; hits of rays are JSON.

    A file has a ray in each row: its origin x, y, z and its direction dx, dy, dz.
    """

    formats, array = SECTION_FORMATS, "rays"

    def read(self, body: bytes) -> dict[str, Any]:
        """The fields of `rays`, origins and directions, from the bytes of a file.

        Raises
        ------
        InvalidRequest
            A row does not have 6 numbers, or the file is invalid (`read_array`).
        """
        rays = read_array(body)
        if rays.ndim != 2 or rays.shape[1] != 6:
            message, got = "A row of a file of rays is a point and a direction.", str(rays.shape)
            raise InvalidRequest(Issue("wrong_dimension", message, "/rays", got, "shape (m, 6)"))
        return {"origins": rays[:, :3], "directions": rays[:, 3:]}


class MeasureRoute(BodyRoute):
    """A route that reads a surface as JSON or as a file."""

    decoders, has_surface_files = DECODERS, True


projections = APIRouter(route_class=ArrayRoute)
intersections = APIRouter(route_class=IntersectRoute)
measures = APIRouter(route_class=MeasureRoute)

_POINTS, _HITS, _MEASURES = (
    REQUESTS[operation] for operation in ("projectPoints", "intersectSurface", "measureSurface")
)


def _run_intersect(body: IntersectRequest) -> bytes:
    if body.planes is None:
        return plan_intersect(body.to_surface(), body.to_query()).run()
    return plan_sections(body.to_surface(), body.to_sections(), SECTIONS_BY_NAME["json"]).run()


show_responses(
    "projectPoints",
    _POINTS,
    ProjectRequest,
    lambda body: plan_project(body.to_shape(), body.to_query()).run(),
)
show_responses("intersectSurface", _HITS, IntersectRequest, _run_intersect)
show_responses(
    "measureSurface",
    _MEASURES,
    MeasureRequest,
    lambda body: plan_measure(body.to_surface(), body.to_query()).run(),
)


@projections.post(
    "/v1/project",
    operation_id="projectPoints",
    tags=["queries"],
    summary="The closest points of a surface or a curve, with proved distances",
    response_model=ClosestPoints,
    response_description="The closest points.",
    responses={200: success(), 404: error("UnknownSurface"), **POST_ERRORS},
    openapi_extra=array_body(_POINTS, ProjectRequest, "points", "(m, 3)"),
)
async def project_points(body: ProjectRequest, context: ContextDep) -> Response:
    """Looks for the closest points, and proves an interval that contains each distance.

    Row k of each column belongs to point k. The search subdivides the whole surface: it needs no
    starting point, and misses no minimum. Of a brep, the closest point is on a trimmed face or on
    an edge, and `near_edge` says where an edge decides. Ribbons, and tubes that are not exact, have
    no closest points (`not_parametric`).

    Many points are sent faster as a NumPy file. Then the query of the URL names a stored or
    built-in surface, and has the other fields.
    """
    services, computation, *_ = context
    work = plan_project(body.to_shape(), body.to_query(), services.limits)
    return bytes_response(await computation.run(work, "project"), computation)


@intersections.post(
    "/v1/intersect",
    operation_id="intersectSurface",
    tags=["queries"],
    summary="Where rays hit a surface, or planes cut it",
    response_model=Intersections,
    response_description="The hits, or the sections.",
    responses={
        200: success(FILE_HEADERS, SECTION_FORMATS),
        404: error("UnknownSurface"),
        406: error("NotAcceptable"),
        **POST_ERRORS,
    },
    openapi_extra=array_body(
        _HITS, IntersectRequest, "rays", "(m, 6)", format_parameter(SECTION_FORMATS)
    ),
)
async def intersect_surface(body: IntersectRequest, context: ContextDep) -> Response:
    """Looks for the hits of rays, or for the sections by planes, of the whole surface.

    **Rays.** If a ray is `reached`, each point of the surface on the ray has its t in the
    `t_bounds` of a hit. Each hit is nearer to its ray than the thickness
    (`relative_thickness`). Hits on an edge or a corner that patches share count once. Faces of a
    brep have hits inside their trims only, and near their edges (`near_edge`).

    **Planes.** A section is returned as polylines, which are within a tolerance of the exact
    section and contain all of its parts, however small. Polylines are closed where the surface, or
    the solid, is closed. The response is in the format that `format` names or `Accept` prefers;
    JSON without either.

    Many rays are sent faster as a NumPy file with a point and a direction in each row. The query
    then names a stored or built-in surface, and has the other fields.

    Ribbons, and tubes that are not exact, have no hits and no sections (`not_parametric`).
    """
    services, computation, request, fmt = context
    if body.planes is not None:
        work = plan_sections(body.to_surface(), body.to_sections(), fmt, services.limits)
        content = await computation.run(work, "intersect")
        return file_response(content, fmt, body.to_surface().name, computation)
    if fmt.name != "json" and "format" not in request.query_params:
        # `Accept` prefers a format of sections, but hits are only JSON: raises if it excludes JSON.
        format_by_accept(request.headers.get("accept"), (SECTIONS_BY_NAME["json"],))
    elif fmt.name != "json":
        message, got = "Hits of rays are written as JSON.", "a format of sections"
        raise InvalidQuery(Issue("unsupported_by_format", message, "/format", got, "json"))
    hits = plan_intersect(body.to_surface(), body.to_query(), services.limits)
    return bytes_response(await computation.run(hits, "intersect"), computation)


@measures.post(
    "/v1/measure",
    operation_id="measureSurface",
    tags=["queries"],
    summary="Area, volume, centroid and lengths of borders, each with a proved interval",
    response_model=SurfaceMeasures,
    response_description="The measures.",
    responses={200: success(TIMED | CODED | READING), **POST_ERRORS},
    openapi_extra=surface_body(_MEASURES, options=scalar_options(MeasureRequest)),
)
async def measure_surface(body: MeasureRequest, context: ContextDep) -> Response:
    """Measures a surface: every number has an interval that provably contains the exact value.

    A surface has a volume if it has no open edge and its patches are oriented consistently;
    otherwise `faulty_edges` lists the reasons. Where a `tolerance` takes more work than one request
    may take, the interval is wider, and `reached` is false. Faces of a brep are measured inside
    their trims; `edge_lengths` has the lengths of its edges. Ribbons, and tubes that are not exact,
    are not measured (`not_parametric`).
    """
    services, computation, *_ = context
    for work in plan_trials(body.to_surface(), body.to_query(), services.limits):
        with suppress(BudgetEnded):
            content = await computation.run(work, "measure")
            headers = HEADERS | reading_headers(body.reading)
            return bytes_response(content, computation, headers)
        computation.drop_work()
    raise AssertionError("the last trial has a result or another error")
