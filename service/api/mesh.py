"""Meshes of surfaces that are posted."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import (
    BOUND_HEADER,
    POST_HEADERS,
    TRIANGLES_HEADER,
    VERTICES_HEADER,
    file_response,
)
from service.api.negotiation import by_accept
from service.api.observing.exchange import exchange_of
from service.api.observing.observed import Observed
from service.api.posted import Posting, posting
from service.api.timing import Timing
from service.api.work import one_of_few, run
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.mesh import MeshReport
from service.engine.models import highest_degree
from service.pipeline.encoding import encode_options
from service.pipeline.mesh import Answer, Work, plan
from service.schemas.options import MeshOptionFields
from service.schemas.request import mesh_request
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface
from service.surface.lowered import GroupModel
from service.surface.sweep_model import SweepModel

INLINE_VERTICES, INLINE_DEGREE = 1000, 8
"""Up to here a mesh takes 1 to 2 ms, which the event loop can spare: a thread would add as much,
since Python's threads take turns of 5 ms. Larger ones wait for a thread while the loop goes on
answering, health checks above all. Patches of high degree may need their normals computed one by
one, which takes longer."""


async def post_mesh(request: Request) -> Response:
    """POST /v1/mesh: the surface and the options in the body, or a file and a query."""
    settings: Settings = request.app.state.settings
    timing = Timing()
    posted = posting(request, FORMATS)
    fmt = posted.format or by_accept(request.headers.get("accept"), FORMATS)
    exchange_of(request.scope).format = fmt.name
    with timing.step("read"):
        body = await posted.read(request, settings)
    is_long = posted.is_long(body)
    async with one_of_few(request, is_long=is_long):
        with timing.step("parse"):
            parse = partial(_parse, posted, body, fmt, settings)
            work = await run(request, parse, in_thread=is_long)
        del body, parse  # half of the memory of a large request
        with timing.step("mesh"):
            answer = await answered(request, work)
    headers = POST_HEADERS | report_headers(answer.report) | {"Server-Timing": str(timing)}
    return file_response(answer.content, fmt, work.model.name, headers)


def report_headers(report: MeshReport | None) -> dict[str, str]:
    """What is known of the mesh as headers, for formats that have no place for it."""
    if report is None:
        return {}
    counts = {VERTICES_HEADER: str(report.vertices), TRIANGLES_HEADER: str(report.triangles)}
    if report.deviation_bound is None:
        return counts
    return counts | {BOUND_HEADER: repr(report.deviation_bound)}


def _parse(posted: Posting[Format], body: bytes, fmt: Format, settings: Settings) -> Work:
    """What a body asks for, found possible and affordable."""
    limits = document_limits(settings)
    wanted = mesh_request(posted.document(body, limits), limits)
    return planned(wanted.to_surface(), wanted, fmt, settings)


def planned(surface: Surface, wanted: MeshOptionFields, fmt: Format, settings: Settings) -> Work:
    """The mesh of a surface, found possible and affordable."""
    encode = encode_options(wanted)
    return plan(surface, wanted.mesh_options(), fmt, encode, result_limits(settings))


async def answered(request: Request, work: Work) -> Answer:
    """The file, computed here when that is quick and in a thread when it is not."""
    # Every different member of a group takes a time of its own, a sweep some milliseconds, and how
    # long a tolerance takes is not known.
    is_long = (
        work.options.accuracy is not None
        or isinstance(work.model, GroupModel | SweepModel)
        or work.size.vertices > INLINE_VERTICES
        or highest_degree(work.model) > INLINE_DEGREE
    )
    answer = await run(request, work.answer, in_thread=is_long)
    observed: Observed = request.app.state.observed
    observed.made(answer.report)
    return answer
