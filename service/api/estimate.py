"""POST /v1/estimate: what a mesh would be, before it is made."""

from collections.abc import Sequence
from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import HEADERS, ChunkedResponse
from service.api.posted import Posting, posting
from service.api.work import run
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.encoders.text import json_text
from service.pipeline.encoding import encode_options
from service.pipeline.estimate import estimate, estimate_object
from service.schemas.request import mesh_request
from service.settings.values import Settings, document_limits, result_limits


async def post_estimate(request: Request) -> Response:
    """The surface and the options as for a mesh; a format in the query, or all."""
    settings: Settings = request.app.state.settings
    posted = posting(request, FORMATS)
    body = await posted.read(request, settings)
    formats = FORMATS if posted.format is None else (posted.format,)
    # A short body may have patches of a high degree, or ask for a tolerance.
    content = await run(
        request, partial(_estimated, posted, body, formats, settings), in_thread=True
    )
    return ChunkedResponse(content, 200, HEADERS, "application/json")


def _estimated(
    posted: Posting[Format], body: bytes, formats: Sequence[Format], settings: Settings
) -> bytes:
    allowed = document_limits(settings)
    wanted = mesh_request(posted.document(body, allowed), allowed)
    surface, options = wanted.to_surface(), wanted.mesh_options()
    limits = result_limits(settings)
    found = estimate(surface, options, encode_options(wanted), limits, formats)
    return json_text(estimate_object(found))
