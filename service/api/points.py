"""Points of a surface at parameters that are posted."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import HEADERS, ChunkedResponse
from service.api.body import read_body
from service.api.parameters import no_parameters
from service.api.timing import Timing
from service.api.work import INLINE_BYTES, Task, done, pace_of, parsed
from service.engine.points.places import Query
from service.pipeline.points import PointsWork, plan_points
from service.schemas.points import PointsRequest
from service.schemas.validation import parse_request
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface


async def post_points(request: Request) -> Response:
    """POST /v1/points: the surface and the parameters in the body."""
    settings: Settings = request.app.state.settings
    no_parameters(request.query_params)
    timing = Timing()
    with timing.step("read"):
        body = await read_body(request, settings)
    async with attended(request):
        is_long = len(body) > INLINE_BYTES
        parse = partial(_parse, body, settings)
        surface, query = await parsed(parse, timing, is_long=is_long)
        del body, parse
        plan = partial(plan_points, surface, query, result_limits(settings))
        task = Task("points", plan, 0, pace_of, is_long)
        _, content = await done(task, PointsWork.run, len, timing)
    headers = HEADERS | {"Server-Timing": str(timing)}
    return ChunkedResponse(content, 200, headers, "application/json")


def _parse(body: bytes, settings: Settings) -> tuple[Surface, Query]:
    """What a body asks for."""
    wanted = parse_request(PointsRequest, body, document_limits(settings))
    return wanted.to_surface(), wanted.to_query()
