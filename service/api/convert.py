"""POST /v1/convert: a surface in another form, in the language of requests."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import HEADERS, ChunkedResponse
from service.api.body import read_body
from service.api.parameters import no_parameters
from service.api.work import run
from service.pipeline.conversion import converted
from service.schemas.convert import convert_request
from service.schemas.document import parse_document
from service.settings.values import Settings, document_limits, result_limits
from service.surface.convert.nets import Allowed


async def post_convert(request: Request) -> Response:
    """The surface and the operations in the body; the new surface, as a body for other calls."""
    settings: Settings = request.app.state.settings
    no_parameters(request.query_params)
    body = await read_body(request, settings)
    # A short body may ask for much: small patches, raised to a high degree.
    content = await run(request, partial(_converted, body, settings), in_thread=True)
    return ChunkedResponse(content, 200, HEADERS, "application/json")


def _converted(body: bytes, settings: Settings) -> bytes:
    limits = document_limits(settings)
    wanted = convert_request(parse_document(body), limits)
    surface, operations = wanted.to_surface(), wanted.to_operations()
    allowed = Allowed(limits.max_control_points, limits.max_degree)
    return converted(surface, operations, allowed, result_limits(settings))
