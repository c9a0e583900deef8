"""Meshes: of a surface that is posted, and of an example by its URL."""

from functools import partial

from starlette.requests import Request
from starlette.responses import Response

from service.api.answers import BOUND_HEADER, HEADERS, POST_HEADERS, file_response
from service.api.body import read_body
from service.api.negotiation import by_accept, by_suffix
from service.api.parameters import named_example, only_format
from service.api.work import long_to_read, run
from service.encoders.format import EncodeOptions, Format
from service.encoders.registry import FORMATS
from service.engine.mesh import MeshReport
from service.engine.models import highest_degree
from service.pipeline.mesh import Answer, Work, plan
from service.schemas.document import parse_document
from service.schemas.options import MeshOptionFields
from service.schemas.query import options_from_text
from service.schemas.request import mesh_request
from service.settings import Settings, document_limits, result_limits
from service.surface import Surface
from service.surface.lowered import GroupModel
from service.surface.sweep_model import SweepModel

INLINE_VERTICES, INLINE_DEGREE = 1000, 8
"""Up to here a mesh takes 1 to 2 ms, which the event loop can spare: a thread would add as much,
since Python's threads take turns of 5 ms. Larger ones wait for a thread while the loop goes on
answering, health checks above all. Patches of high degree may need their normals computed one by
one, which takes longer."""

GET_HEADERS = HEADERS | {"Cache-Control": "public, max-age=3600"}


async def post_mesh(request: Request) -> Response:
    """POST /v1/mesh: the surface and the options in the body."""
    settings: Settings = request.app.state.settings
    named = only_format(request.query_params.multi_items(), FORMATS)
    fmt = named or by_accept(request.headers.get("accept"), FORMATS)
    body = await read_body(request, settings)
    parse = partial(_parse, body, fmt, settings)
    work = await run(request, parse, in_thread=long_to_read(body))
    del body, parse  # half of the memory of a large request
    answer = await _answer(request, work)
    headers = POST_HEADERS | bound_header(answer.report)
    return file_response(answer.content, fmt, work.model.name, headers)


async def get_example_mesh(request: Request) -> Response:
    """GET /v1/surfaces/{example}/mesh.{suffix}: the options in the query."""
    example = named_example(request.path_params["example"])
    fmt = by_suffix(request.path_params["suffix"])
    wanted = options_from_text(request.query_params.multi_items())
    work = _planned(example.surface(), wanted, fmt, request.app.state.settings)
    answer = await _answer(request, work)
    headers = GET_HEADERS | bound_header(answer.report)
    return file_response(answer.content, fmt, example.id, headers)


def bound_header(report: MeshReport | None) -> dict[str, str]:
    """The certified deviation as a header, for formats that have no place for it."""
    if report is None or report.deviation_bound is None:
        return {}
    return {BOUND_HEADER: repr(report.deviation_bound)}


def _parse(body: bytes, fmt: Format, settings: Settings) -> Work:
    """What a body asks for, found possible and affordable."""
    wanted = mesh_request(parse_document(body), document_limits(settings))
    return _planned(wanted.to_surface(), wanted, fmt, settings)


def _planned(surface: Surface, wanted: MeshOptionFields, fmt: Format, settings: Settings) -> Work:
    encode = EncodeOptions(wanted.oogl)
    return plan(surface, wanted.mesh_options(), fmt, encode, result_limits(settings))


async def _answer(request: Request, work: Work) -> Answer:
    """The file, computed here when that is quick and in a thread when it is not."""
    # Every different member of a group takes a time of its own, a sweep some milliseconds, and how
    # long a tolerance takes is not known.
    is_long = (
        work.options.accuracy is not None
        or isinstance(work.model, GroupModel | SweepModel)
        or work.size.vertices > INLINE_VERTICES
        or highest_degree(work.model) > INLINE_DEGREE
    )
    return await run(request, work.answer, in_thread=is_long)
