"""POST /v1/convert: a surface in another form, in the language of requests."""

from collections.abc import Sequence
from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import HEADERS, ChunkedResponse
from service.api.body import read_body
from service.api.parameters import no_parameters
from service.api.timing import Timing
from service.api.work import Task, done, long_to_read, pace_of, parsed
from service.pipeline.conversion import ConversionWork, plan_conversion
from service.schemas.convert import ConvertRequest
from service.schemas.validation import parse_request
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface
from service.surface.convert.nets import Allowed
from service.surface.convert.operations import Operation


async def post_convert(request: Request) -> Response:
    """The surface and the operations in the body; the new surface, as a body for other calls."""
    settings: Settings = request.app.state.settings
    no_parameters(request.query_params)
    timing = Timing()
    with timing.step("read"):
        body = await read_body(request, settings)
    async with attended(request):
        is_long = long_to_read(body)
        parse = partial(_parse, body, settings)
        surface, operations = await parsed(parse, timing, is_long=is_long)
        del body, parse
        allowed = Allowed(settings.max_control_points, settings.max_degree)
        plan = partial(plan_conversion, surface, operations, allowed, result_limits(settings))
        task = Task("convert", plan, 0, pace_of, is_long)
        _, content = await done(task, ConversionWork.run, len, timing)
    headers = HEADERS | {"Server-Timing": str(timing)}
    return ChunkedResponse(content, 200, headers, "application/json")


def _parse(body: bytes, settings: Settings) -> tuple[Surface, Sequence[Operation]]:
    """What a body asks for."""
    wanted = parse_request(ConvertRequest, body, document_limits(settings))
    return wanted.to_surface(), wanted.to_operations()
