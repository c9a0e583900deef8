"""Curves that are posted, as samples and lines."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import POST_HEADERS, file_response
from service.api.body import read_body
from service.api.negotiation import by_accept
from service.api.observing.record import record_of
from service.api.parameters import only_format
from service.api.timing import Timing
from service.api.work import Task, done, long_to_read, pace_of, parsed
from service.encoders.curves.registry import CURVE_FORMATS
from service.engine.curves.options import CurveOptions
from service.pipeline.curve import CurveWork, plan_curve
from service.schemas.curves import CurveRequest
from service.schemas.validation import parse_request
from service.settings.values import Settings, document_limits, result_limits
from service.surface.curve import Curve


async def post_curve(request: Request) -> Response:
    """POST /v1/curve: the curve and the options in the body."""
    settings: Settings = request.app.state.settings
    named = only_format(request.query_params.multi_items(), CURVE_FORMATS)
    fmt = named or by_accept(request.headers.get("accept"), CURVE_FORMATS)
    record_of(request.scope).format = fmt.name
    timing = Timing()
    with timing.step("read"):
        body = await read_body(request, settings)
    async with attended(request):
        is_long = long_to_read(body)
        parse = partial(_parse, body, settings)
        curve, options = await parsed(parse, timing, is_long=is_long)
        del body, parse
        plan = partial(plan_curve, curve, options, fmt, result_limits(settings))
        task = Task("curve", plan, 0, pace_of, is_long)
        work, content = await done(task, CurveWork.run, len, timing)
    headers = POST_HEADERS | {"Server-Timing": str(timing)}
    return file_response(content, fmt, work.curve.name, headers)


def _parse(body: bytes, settings: Settings) -> tuple[Curve, CurveOptions]:
    """What a body asks for."""
    wanted = parse_request(CurveRequest, body, document_limits(settings))
    return wanted.to_curve(), wanted.curve_options()
