"""POST /v1/estimate: what a mesh would be, before it is made."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import HEADERS, ChunkedResponse
from service.api.posted import Posting, posting
from service.api.timing import Timing
from service.api.work import Task, done, pace_of, parsed
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.encoders.text import json_text
from service.pipeline.encoding import encode_options
from service.pipeline.estimate import EstimateWork, estimate_object, plan_estimate
from service.schemas.options import MeshOptionFields
from service.schemas.request import MeshRequest
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface


async def post_estimate(request: Request) -> Response:
    """The surface and the options as for a mesh; a format in the query, or all."""
    settings: Settings = request.app.state.settings
    posted = posting(request, FORMATS)
    timing = Timing()
    with timing.step("read"):
        body = await posted.read(request, settings)
    formats = FORMATS if posted.format is None else (posted.format,)
    async with attended(request):
        is_long = posted.is_long(body)
        parse = partial(_parse, posted, body, settings)
        surface, wanted = await parsed(parse, timing, is_long=is_long)
        del body, parse
        encode, limits = encode_options(wanted), result_limits(settings)
        plan = partial(plan_estimate, surface, wanted.mesh_options(), encode, limits, formats)
        task = Task("estimate", plan, 0, pace_of, is_long)
        _, content = await done(task, _written, len, timing)
    headers = HEADERS | {"Server-Timing": str(timing)}
    return ChunkedResponse(content, 200, headers, "application/json")


def _written(work: EstimateWork) -> bytes:
    """The estimate as JSON."""
    return json_text(estimate_object(work.run()))


def _parse(
    posted: Posting[Format], body: bytes, settings: Settings
) -> tuple[Surface, MeshOptionFields]:
    """What a body asks for."""
    wanted = posted.request(MeshRequest, body, document_limits(settings))
    return wanted.to_surface(), wanted
