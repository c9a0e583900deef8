"""Where surfaces are intersected: hits of rays."""

from fastapi import APIRouter, Response

from service.api.answers import bytes_response
from service.api.body import BodyRoute
from service.api.models.intersect import RayHits
from service.api.openapi.examples import show_answers
from service.api.openapi.parameters import Json, json_body
from service.api.openapi.responses import POST_ERRORS, answer
from service.api.services import ContextDep
from service.pipeline.intersect import plan_intersect
from service.schemas.intersect import IntersectRequest

intersections = APIRouter(route_class=BodyRoute)

_SHEET = [
    [[0, 0, 0], [0, 1, 0]],
    [[1, 0, 4], [1, 1, 4]],
    [[2, 0, -4], [2, 1, -4]],
    [[3, 0, 0], [3, 1, 0]],
]
_HITS: Json = {
    "first": {
        "summary": "The first hits of two rays from above, one of which passes the patch by",
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
}
show_answers(
    "intersectRays",
    _HITS,
    IntersectRequest,
    lambda wanted: plan_intersect(wanted.to_surface(), wanted.to_query()).run(),
)


@intersections.post(
    "/v1/intersect",
    operation_id="intersectRays",
    tags=["queries"],
    summary="Where rays hit a surface",
    response_model=RayHits,
    response_description="The hits.",
    responses={200: answer(), **POST_ERRORS},
    openapi_extra=json_body(_HITS),
)
async def intersect_rays(wanted: IntersectRequest, context: ContextDep) -> Response:
    """Looks for the hits of rays with the whole surface, and proves that none is missed.

    Every point of the surface on a ray that is `reached` has its t in the `t_bounds` of a hit;
    every hit is nearer to its ray than the thickness. Hits on an edge or a corner that patches
    share count once. Tubes and ribbons have no hits (`not_parametric`).
    """
    services, job, *_ = context
    work = plan_intersect(wanted.to_surface(), wanted.to_query(), services.limits)
    return bytes_response(await job.run(work, "intersect"), job)
