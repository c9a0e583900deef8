"""The route of closest points on surfaces and curves."""

from fastapi import APIRouter, Response

from service.api.array_route import ArrayRoute
from service.api.models.project import ClosestPoints
from service.api.openapi.examples import show_responses
from service.api.openapi.parameters import Json, array_body
from service.api.openapi.responses import POST_ERRORS, error, success
from service.api.responses import bytes_response
from service.api.services import ContextDep
from service.pipeline.project import plan_project
from service.schemas.project import ProjectRequest

queries = APIRouter(route_class=ArrayRoute)

_CLOSEST: Json = {
    "surface": {
        "summary": "A point above a patch, and one beside it",
        "value": {
            "surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]},
            "points": [[0.5, 0.5, 2], [2, 0.5, 0.5]],
        },
    },
    "sign": {
        "summary": "Points inside and outside a tetrahedron, and one on it",
        "value": {
            "surface": {
                "type": "patches",
                "vertices": [[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]],
                "triangles": [
                    [[0, 2], [1]],
                    [[0, 1], [3]],
                    [[0, 3], [2]],
                    [[1, 2], [3]],
                ],
            },
            "points": [[0.5, 0.5, 0.5], [1, 1, 4], [1, 1, 1]],
            "sign": True,
        },
    },
    "curve": {
        "summary": "The point of a quarter of a circle that is nearest to a point",
        "value": {
            "curve": {
                "control_points": [[1, 0], [1, 1], [0, 1]],
                "weights": [1, 0.7071067811865476, 1],
            },
            "points": [[2, 2]],
        },
    },
}
show_responses(
    "projectPoints",
    _CLOSEST,
    ProjectRequest,
    lambda body: plan_project(body.to_shape(), body.to_query()).run(),
)


@queries.post(
    "/v1/project",
    operation_id="projectPoints",
    tags=["queries"],
    summary="The closest points of a surface or a curve, with proved distances",
    response_model=ClosestPoints,
    response_description="The closest points.",
    responses={200: success(), 404: error("UnknownSurface"), **POST_ERRORS},
    openapi_extra=array_body(_CLOSEST, ProjectRequest, "points", "(m, 3)"),
)
async def project_points(body: ProjectRequest, context: ContextDep) -> Response:
    """Looks for the closest points, and proves an interval that contains each distance.

    Row k of each column belongs to point k. The search subdivides the whole surface: it needs no
    starting point, and misses no minimum. Tubes and ribbons have no closest points
    (`not_parametric`).

    Many points are sent faster as a NumPy file. Then the query of the URL names a stored or
    built-in surface, and has the other fields.
    """
    services, job, *_ = context
    work = plan_project(body.to_shape(), body.to_query(), services.limits)
    return bytes_response(await job.run(work, "project"), job)
