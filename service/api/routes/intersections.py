"""The route of intersections: hits of rays, sections by planes."""

from typing import Any

from fastapi import APIRouter, Response

from service.api.array_route import ArrayRoute
from service.api.errors import InvalidQuery
from service.api.models.sections import Intersections
from service.api.negotiation import format_by_accept
from service.api.openapi.examples import show_responses
from service.api.openapi.parameters import Json, array_body, format_parameter
from service.api.openapi.responses import FILE_HEADERS, POST_ERRORS, error, success
from service.api.responses import bytes_response, file_response
from service.api.services import ContextDep
from service.decoders.npy import read_array
from service.encoders.sections.registry import SECTION_FORMATS, SECTIONS_BY_NAME
from service.errors import InvalidRequest, Issue
from service.pipeline.intersect import plan_intersect
from service.pipeline.section import plan_sections
from service.schemas.intersect import IntersectRequest


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


intersections = APIRouter(route_class=IntersectRoute)

_SHEET = [
    [[0, 0, 0], [0, 1, 0]],
    [[1, 0, 4], [1, 1, 4]],
    [[2, 0, -4], [2, 1, -4]],
    [[3, 0, 0], [3, 1, 0]],
]
_HITS: Json = {
    "first": {
        "summary": "The first hits of two rays from above; the second ray misses the patch",
        "value": {
            "surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]},
            "rays": {"origins": [[0.5, 0.5, 2], [2, 0.5, 2]], "directions": [[0, 0, -1]]},
        },
    },
    "all": {
        "summary": "All hits of a ray with a sheet that is bent twice",
        "value": {
            "surface": {"control_net": _SHEET},
            "rays": {"origins": [[-1, 0.5, 0.1]], "directions": [[2, 0, 0]]},
            "hits": "all",
        },
    },
    "sections": {
        "summary": "Sections of a sheet by two planes; only the second cuts it, in two lines",
        "value": {
            "surface": {"control_net": _SHEET},
            "planes": {"normals": [[0, 0, 1]], "offsets": [2, 0.5]},
            "relative_tolerance": 0.01,
        },
    },
}


def _run_intersect(body: IntersectRequest) -> bytes:
    if body.planes is None:
        return plan_intersect(body.to_surface(), body.to_query()).run()
    fmt = SECTIONS_BY_NAME["json"]
    return plan_sections(body.to_surface(), body.to_sections(), fmt).run()


show_responses("intersectSurface", _HITS, IntersectRequest, _run_intersect)


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
    (`relative_thickness`). Hits on an edge or a corner that patches share count once.

    **Planes.** A section is returned as polylines, which are within a tolerance of the exact
    section and contain all of its parts, however small. Polylines are closed where the surface is
    closed. The response is in the format that `format` names or `Accept` prefers; JSON without
    either.

    Many rays are sent faster as a NumPy file with a point and a direction in each row. The query
    then names a stored or built-in surface, and has the other fields.

    Tubes and ribbons have no hits and no sections (`not_parametric`).
    """
    services, job, request, fmt = context
    if body.planes is not None:
        work = plan_sections(body.to_surface(), body.to_sections(), fmt, services.limits)
        content = await job.run(work, "intersect")
        return file_response(content, fmt, body.to_surface().name, job)
    if fmt.name != "json" and "format" not in request.query_params:
        # `Accept` prefers a format of sections, but hits are only JSON: raises if it excludes JSON.
        format_by_accept(request.headers.get("accept"), (SECTIONS_BY_NAME["json"],))
    elif fmt.name != "json":
        message, got = "Hits of rays are written as JSON.", "a format of sections"
        raise InvalidQuery(Issue("unsupported_by_format", message, "/format", got, "json"))
    hits = plan_intersect(body.to_surface(), body.to_query(), services.limits)
    return bytes_response(await job.run(hits, "intersect"), job)
