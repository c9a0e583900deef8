"""Measures of surfaces: areas, lengths of borders, volumes, centroids."""

from fastapi import APIRouter, Response

from service.api.body import BodyRoute
from service.api.models.measure import SurfaceMeasures
from service.api.openapi.examples import show_responses
from service.api.openapi.parameters import Json, json_body
from service.api.openapi.responses import POST_ERRORS, success
from service.api.responses import bytes_response
from service.api.services import ContextDep
from service.pipeline.measure import plan_measure
from service.schemas.measure import MeasureRequest

measures = APIRouter(route_class=BodyRoute)

_EXAMPLES: Json = {
    "brick": {
        "summary": "A brick: its volume, its centroid and its faces",
        "value": {
            "surface": {
                "type": "patches",
                "vertices": [
                    [0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 2, 0],
                    [0, 0, 3], [1, 0, 3], [0, 2, 3], [1, 2, 3],
                ],
                "patches": [
                    [[0, 1], [2, 3]], [[4, 6], [5, 7]], [[0, 4], [1, 5]],
                    [[2, 3], [6, 7]], [[0, 2], [4, 6]], [[1, 5], [3, 7]],
                ],
            }
        },
    },
    "saddle": {
        "summary": "The area and the border of an open patch",
        "value": {
            "surface": {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]},
            "tolerance": 1e-9,
        },
    },
}  # fmt: skip
show_responses(
    "measureSurface",
    _EXAMPLES,
    MeasureRequest,
    lambda body: plan_measure(body.to_surface(), body.to_query()).run(),
)


@measures.post(
    "/v1/measure",
    operation_id="measureSurface",
    tags=["queries"],
    summary="Area, volume, centroid and lengths of borders, each with a proved interval",
    response_model=SurfaceMeasures,
    response_description="The measures.",
    responses={200: success(), **POST_ERRORS},
    openapi_extra=json_body(_EXAMPLES),
)
async def measure_surface(body: MeasureRequest, context: ContextDep) -> Response:
    """Measures a surface: every number has an interval that provably contains the exact value.

    A surface has a volume if it has no open edge and its patches are oriented consistently;
    otherwise `faulty_edges` lists the reasons. A `tolerance` that takes more work than one request
    may take is refused (`too_costly`); the error names the tolerance that can be reached for each
    quantity. Tubes and ribbons are not measured (`not_parametric`).
    """
    services, job, *_ = context
    work = plan_measure(body.to_surface(), body.to_query(), services.limits)
    return bytes_response(await job.run(work, "measure"), job)
