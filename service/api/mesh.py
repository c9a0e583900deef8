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
from service.api.work import Pace, Task, done, parsed
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.engine.mesh import MeshReport
from service.engine.models import highest_degree
from service.pipeline.encoding import encode_options
from service.pipeline.memory import lowering
from service.pipeline.mesh import Answer, Work, plan
from service.schemas.options import MeshOptionFields
from service.schemas.request import MeshRequest
from service.settings.values import Settings, document_limits, result_limits
from service.surface import Surface
from service.surface.lowered import GroupModel
from service.surface.sweep_model import SweepModel

INLINE_VERTICES, INLINE_DEGREE = 1000, 8
"""Up to here a mesh takes 1 to 2 ms. Patches of high degree may need their normals computed one by
one, which takes longer."""

QUICK_VERTICES, QUICK_MODELS = 30_000, 30
"""Up to here, at the same degree, a mesh takes some 20 ms, as text 100 ms."""


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
        work, answer = await made(request, surface, (wanted, fmt), timing, is_long=is_long)
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
) -> tuple[Work, Answer]:
    """The mesh of a surface as a file; computed here when that is quick, else in a thread."""
    plan = partial(planned, surface, *wanted, request.app.state.settings)
    task = Task("mesh", plan, lowering(surface), _pace, is_long)
    work, answer = await done(task, Work.answer, lambda answer: len(answer.content), timing)
    observed: RequestCounters = request.app.state.observed
    observed.made(answer.report)
    return work, answer


def planned(surface: Surface, wanted: MeshOptionFields, fmt: Format, settings: Settings) -> Work:
    """The mesh of a surface, found possible and affordable."""
    encode = encode_options(wanted)
    return plan(surface, wanted.mesh_options(), fmt, encode, result_limits(settings))


def _pace(work: Work) -> Pace:
    """How long a mesh takes."""
    models = work.model.models if isinstance(work.model, GroupModel) else ()
    if (
        # How long a tolerance takes is not known.
        work.options.accuracy is not None
        or work.options.method != "matrix"
        or work.size.vertices > QUICK_VERTICES
        or highest_degree(work.model) > INLINE_DEGREE
        or len(models) > QUICK_MODELS
    ):
        return Pace.LONG
    # Every different member of a group takes a time of its own, a sweep some milliseconds.
    if models or isinstance(work.model, SweepModel) or work.size.vertices > INLINE_VERTICES:
        return Pace.SOON
    return Pace.AT_ONCE
