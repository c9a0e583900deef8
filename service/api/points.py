"""Points of a surface at parameters that are posted."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import HEADERS, ChunkedResponse
from service.api.body import read_body
from service.api.parameters import no_parameters
from service.api.work import INLINE_BYTES, run
from service.pipeline.points import PointsWork, plan_points
from service.schemas.document import parse_document
from service.schemas.points import points_request
from service.settings.values import Settings, document_limits, result_limits

INLINE_POINTS, INLINE_DEGREE = 16, 4
"""Up to here a query takes 1 ms, some 5 at poles, which the event loop can spare."""


async def post_points(request: Request) -> Response:
    """POST /v1/points: the surface and the parameters in the body."""
    settings: Settings = request.app.state.settings
    no_parameters(request.query_params)
    body = await read_body(request, settings, settings.max_points)
    parse = partial(_parse, body, settings)
    work = await run(request, parse, in_thread=len(body) > INLINE_BYTES)
    del body, parse
    degree = max(max(batch.side_degrees) for batch in work.model.batches)
    is_long = len(work.places.patch) > INLINE_POINTS or degree > INLINE_DEGREE
    content = await run(request, work.run, in_thread=is_long)
    return ChunkedResponse(content, 200, HEADERS, "application/json")


def _parse(body: bytes, settings: Settings) -> PointsWork:
    """What a body asks for, found possible and affordable."""
    wanted = points_request(parse_document(body), document_limits(settings))
    return plan_points(wanted.to_surface(), wanted.to_query(), result_limits(settings))
