"""Curves that are posted, as samples and lines."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import POST_HEADERS, file_response
from service.api.body import read_body
from service.api.negotiation import by_accept
from service.api.parameters import only_format
from service.api.work import long_to_read, run
from service.encoders.curves.format import CurveFormat
from service.encoders.curves.registry import CURVE_FORMATS
from service.pipeline.curve import CurveWork, plan_curve
from service.schemas.curve_request import curve_request
from service.schemas.document import parse_document
from service.settings.values import Settings, document_limits, result_limits

INLINE_WORK = 600
"""Points times the degree up to which a curve takes 1 to 2 ms, which the event loop can spare."""


async def post_curve(request: Request) -> Response:
    """POST /v1/curve: the curve and the options in the body."""
    settings: Settings = request.app.state.settings
    named = only_format(request.query_params.multi_items(), CURVE_FORMATS)
    fmt = named or by_accept(request.headers.get("accept"), CURVE_FORMATS)
    body = await read_body(request, settings)
    parse = partial(_parse, body, fmt, settings)
    work = await run(request, parse, in_thread=long_to_read(body))
    del body, parse
    is_long = work.points * work.pieces.degree > INLINE_WORK
    content = await run(request, work.run, in_thread=is_long)
    return file_response(content, fmt, work.pieces.name, POST_HEADERS)


def _parse(body: bytes, fmt: CurveFormat, settings: Settings) -> CurveWork:
    """What a body asks for, found affordable."""
    wanted = curve_request(parse_document(body), document_limits(settings))
    return plan_curve(wanted.to_curve(), wanted.curve_options(), fmt, result_limits(settings))
