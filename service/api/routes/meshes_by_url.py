"""Route for meshes by URL."""

from functools import partial
from urllib.parse import parse_qsl

from fastapi import APIRouter, Request, Response

from service.api.by_url import UrlRequest, answer_by_url
from service.api.caching.cached_response import RawHeaders, Subject
from service.api.computation import Computation
from service.api.models.meshes import Mesh
from service.api.negotiation import check_engine, codings_of, condition_of, format_by_suffix
from service.api.observing.metrics import RequestCounters
from service.api.openapi.parameters import (
    ACCEPT_ENCODING,
    IF_NONE_MATCH,
    Suffix,
    SurfaceId,
    option_parameters,
)
from service.api.openapi.responses import UNCHANGED_MESH, URL_HEADERS, error, success
from service.api.responses import disposition, report_headers
from service.api.services import ContextDep, Services
from service.api.stored import content_id, mesh_url
from service.encoders.format import Format
from service.encoders.libraries import describe_writer
from service.encoders.registry import FORMATS
from service.pipeline.mesh import plan_mesh, select_encode_options
from service.schemas.query import canonical_query, parse_mesh_query
from service.surface.kinds import Surface

by_url = APIRouter()


@by_url.get(
    "/v1/surfaces/{id}/mesh.{suffix}",
    operation_id="getSurfaceMesh",
    tags=["meshes"],
    summary="The mesh of a surface, by URL",
    response_model=Mesh,
    response_description="The mesh.",
    responses={
        200: success(URL_HEADERS, FORMATS),
        304: UNCHANGED_MESH,
        404: error("UnknownSurface"),
        406: error("CodingNotAcceptable"),
        410: error("EngineGone"),
        422: error("InvalidQuery"),
        429: error("Busy"),
        500: error("DamagedObject"),
        503: error("Unavailable"),
    },
    openapi_extra={"parameters": [*option_parameters(), IF_NONE_MATCH, ACCEPT_ENCODING]},
)
async def get_surface_mesh(
    id: SurfaceId, suffix: Suffix, request: Request, context: ContextDep
) -> Response:
    """Returns a mesh by URL, for browsers and for caches between them and this service.

    The mesh depends only on the parts of the URL: every service with the same version of the
    numbers returns the same mesh. Other processors and libraries may round the last digit of a
    number differently; then the entity tag differs too. `Link` names the canonical form of the URL:
    options in a fixed order, without defaults, `engine` at the end. Under that URL, caches may keep
    the mesh of a surface whose id is a hash for ever. They may keep other meshes for an hour; after
    that, `ETag` shows whether the mesh has changed.

    The service computes equal requests at the same time once, and keeps responses in memory,
    compressed ones too.
    """
    fmt = format_by_suffix(suffix)
    fields = parse_mesh_query(request.query_params.multi_items())
    check_engine(fields.engine)
    query = canonical_query(fields, fmt.ignored)
    content_hash = content_id(id)
    subject = Subject(
        url=mesh_url(request.scope.get("root_path", ""), id, fmt.suffix, query),
        surface=id,
        # The bytes depend only on the surface, the format, the canonical query (options and
        # `engine`), and the libraries and the processor.
        content_name=f"{content_hash} {fmt.suffix} {query} {describe_writer(fields.compression)}",
        # The id of a stored surface is the hash of its content; the id of a built-in one is a name.
        is_permanent=id == content_hash,
    )
    asked = UrlRequest(
        subject, codings_of(request), condition_of(request), has_engine=fields.engine is not None
    )
    counters: RequestCounters = request.app.state.counters
    make = partial(_make, context.services, counters, subject, fmt=fmt, query=query)
    return await answer_by_url(request, context, asked, make)


async def _make(
    services: Services,
    counters: RequestCounters,
    subject: Subject,
    surface: Surface,
    computation: Computation,
    *,
    fmt: Format,
    query: str,
) -> tuple[bytes, RawHeaders]:
    """The mesh of the canonical query, and its headers."""
    options = parse_mesh_query(parse_qsl(query))
    encode = select_encode_options(options)
    work = plan_mesh(surface, options.mesh_options(), fmt, encode, services.limits)
    mesh_file = await computation.run(work, "mesh")
    computation.finish_work(len(mesh_file.content))
    counters.count_mesh(mesh_file.report)
    # A hash is no good file name, so the surface's own name is taken; the id of an example is one.
    name = mesh_file.name if subject.is_permanent else subject.surface
    file_name = disposition("inline", name, fmt.suffix)
    return bytes(mesh_file.content), (
        (b"content-type", fmt.media_type.encode()),
        (b"content-disposition", file_name.encode()),
        *report_headers(mesh_file.report),
    )
