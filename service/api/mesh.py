"""Meshes of surfaces that are posted."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.admission.visits import attended
from service.api.answers import (
    BOUND_HEADER,
    POST_HEADERS,
    TRIANGLES_HEADER,
    VERTICES_HEADER,
    file_response,
)
from service.api.negotiation import by_accept
from service.api.observing.metrics import RequestCounters
from service.api.observing.record import record_of
from service.api.posted import Posting, posting
from service.api.timing import Timing
from service.api.work import Task, done, pace_of, parsed
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.mesh import MeshReport
from service.pipeline.encoding import encode_options
from service.pipeline.mesh import Answer, MeshWork, plan_mesh
from service.schemas.options import MeshOptionFields
from service.schemas.request import MeshRequest
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface


async def post_mesh(request: Request) -> Response:
    """POST /v1/mesh: the surface and the options in the body, or a file and a query."""
    settings: Settings = request.app.state.settings
    timing = Timing()
    posted = posting(request, FORMATS)
    fmt = posted.format or by_accept(request.headers.get("accept"), FORMATS)
    record_of(request.scope).format = fmt.name
    with timing.step("read"):
        body = await posted.read(request, settings)
    async with attended(request):
        is_long = posted.is_long(body)
        parse = partial(_parse, posted, body, settings)
        surface, wanted = await parsed(parse, timing, is_long=is_long)
        del body, parse  # half of the memory of a large request
        _, answer = await made(request, surface, (wanted, fmt), timing, is_long=is_long)
    headers = POST_HEADERS | report_headers(answer.report) | {"Server-Timing": str(timing)}
    return file_response(answer.content, fmt, answer.name, headers)


def report_headers(report: MeshReport | None) -> dict[str, str]:
    """What is known of the mesh as headers, for formats that have no place for it."""
    if report is None:
        return {}
    counts = {VERTICES_HEADER: str(report.vertices), TRIANGLES_HEADER: str(report.triangles)}
    if report.deviation_bound is None:
        return counts
    return counts | {BOUND_HEADER: repr(report.deviation_bound)}


def _parse(
    posted: Posting[Format], body: bytes, settings: Settings
) -> tuple[Surface, MeshOptionFields]:
    """What a body asks for."""
    wanted = posted.request(MeshRequest, body, document_limits(settings))
    return wanted.to_surface(), wanted


async def made(
    request: Request,
    surface: Surface,
    wanted: tuple[MeshOptionFields, Format],
    timing: Timing,
    *,
    is_long: bool,
) -> tuple[MeshWork, Answer]:
    """The mesh of a surface as a file; computed here when that is quick, else in a thread."""
    plan = partial(planned, surface, *wanted, request.app.state.settings)
    task = Task("mesh", plan, 0, pace_of, is_long)
    work, answer = await done(task, MeshWork.run, lambda answer: len(answer.content), timing)
    observed: RequestCounters = request.app.state.observed
    observed.made(answer.report)
    return work, answer


def planned(
    surface: Surface, wanted: MeshOptionFields, fmt: Format, settings: Settings
) -> MeshWork:
    """The mesh of a surface, found possible and affordable."""
    encode = encode_options(wanted)
    return plan_mesh(surface, wanted.mesh_options(), fmt, encode, result_limits(settings))
