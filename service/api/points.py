"""Points of a surface at parameters that are posted."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import HEADERS, ChunkedResponse
from service.api.body import read_body
from service.api.parameters import no_parameters
from service.api.timing import Timing
from service.api.work import INLINE_BYTES, Pace, Task, done, parsed
from service.engine.points.places import Query
from service.pipeline.memory import lowering
from service.pipeline.points import PointsWork, plan_points
from service.schemas.points import PointsRequest
from service.schemas.validation import parse_request
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface

INLINE_POINTS, INLINE_DEGREE = 16, 4
"""Up to here a query takes 1 ms, some 5 at poles, which the event loop can spare."""

QUICK_POINTS, QUICK_DEGREE = 2000, 8
"""Up to here it takes some 20 ms."""


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
        task = Task("points", plan, lowering(surface), _pace, is_long)
        _, content = await done(task, PointsWork.run, len, timing)
    headers = HEADERS | {"Server-Timing": str(timing)}
    return ChunkedResponse(content, 200, headers, "application/json")


def _parse(body: bytes, settings: Settings) -> tuple[Surface, Query]:
    """What a body asks for."""
    wanted = parse_request(PointsRequest, body, document_limits(settings))
    return wanted.to_surface(), wanted.to_query()


def _pace(work: PointsWork) -> Pace:
    """How long a query takes."""
    count = len(work.places.patch)
    degree = max(max(batch.side_degrees) for batch in work.model.batches)
    if count <= INLINE_POINTS and degree <= INLINE_DEGREE:
        return Pace.AT_ONCE
    return Pace.SOON if count <= QUICK_POINTS and degree <= QUICK_DEGREE else Pace.LONG
