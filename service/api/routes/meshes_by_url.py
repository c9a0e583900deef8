"""Route for meshes by URL, which browsers, and caches between them and the service, may keep."""

import time
from functools import partial
from urllib.parse import parse_qsl

from fastapi import APIRouter, Request, Response

from service.api.caching.cached_response import (
    CachedResponse,
    Subject,
    Variant,
    find_match,
    matches_all,
)
from service.api.caching.codings import COMPRESS_FUNCTIONS, Codings, compress
from service.api.computation import MAX_BUFFERED, Computation
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
from service.api.record import Timing, record_of
from service.api.removals import is_removed
from service.api.responses import FileResponse, disposition, report_headers
from service.api.services import ContextDep, Services
from service.api.stored import content_id, exists, mesh_url, surface_of
from service.encoders.format import Format
from service.encoders.libraries import describe_writer
from service.encoders.registry import FORMATS
from service.pipeline.cost import Work, compression_cost
from service.pipeline.mesh import plan_mesh, select_encode_options
from service.schemas.query import canonical_query, parse_mesh_query

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
    services, computation, *_ = context
    fmt = format_by_suffix(suffix)
    fields = parse_mesh_query(request.query_params.multi_items())
    check_engine(fields.engine)
    has_engine = fields.engine is not None
    accepted, condition = codings_of(request), condition_of(request)
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
    cache, record = services.cache, record_of(request.scope)
    entry = cache.get(subject.url)
    unchanged_coding = find_match(condition, accepted, subject.tag)
    async with computation.until_deadline():
        if entry is not None and await is_removed(services.store, cache, entry):
            entry = None
        if unchanged_coding is not None and (entry is not None or await exists(services.store, id)):
            return FileResponse(
                b"", subject.build_304_headers(unchanged_coding, has_engine=has_engine), 304
            )
        # Before the response takes memory: wait until the caller has read others.
        entry, computed = await _wait_for_room(services, computation, subject.url, entry), None
        if entry is not None:
            cache.hits += 1
            record.cache = "hit"
            timing = Timing("cache;desc=hit")
            # Until the response is sent, the cache keeps the memory of the entry.
            cache.begin(entry)
            computation.on_end.append(partial(cache.end, entry))
        else:
            cache.misses += 1
            record.cache = "miss"
            computation.check_compute_limit()
            counters: RequestCounters = request.app.state.counters
            compute = partial(_compute, services, counters, subject, fmt=fmt, query=query)
            # With the generation in the key, requests after a deletion share no older computation.
            key = (subject.url, cache.generation)
            computed = await services.flights.join(key, compute, computation, computation.on_end)
            entry, timing = computed[0], Timing("cache;desc=miss", computed[1])
        variant = await _choose_variant(services, computation, entry, accepted, timing)
    body = variant.body
    if len(body) > MAX_BUFFERED:
        services.threads.unread.begin(computation.caller, body)
        computation.on_end.append(partial(services.threads.unread.end, computation.caller, body))
    if computed is not None:
        computed[2].share_response()
    # The next request with the same spelling of the URL is answered from the cache at once.
    cache.alias(entry, request.scope["path"], request.scope["query_string"], has_engine=has_engine)
    # `If-None-Match: *` matches if the mesh exists, which only computing it shows.
    if condition is not None and matches_all(condition):
        return FileResponse(
            b"", subject.build_304_headers(variant.coding, has_engine=has_engine), 304
        )
    headers = entry.build_200_headers(
        variant.coding, len(variant.body), has_engine=has_engine, timing=str(timing).encode()
    )
    return FileResponse(variant.body, headers)


async def _wait_for_room(
    services: Services, computation: Computation, url: str, entry: CachedResponse | None
) -> CachedResponse | None:
    """Waits until the caller may begin another response; returns the entry that the cache has then.

    A response that the caller is already reading on another connection takes no further memory. The
    size of a response that the cache does not have is not known yet.
    """
    unread = services.threads.unread
    if not unread.totals:
        return entry
    bodies = () if entry is None else (entry.plain, *(v.body for v in entry.variants.values()))
    await unread.wait(computation.caller, bodies, len(entry.plain) if entry is not None else 1)
    return services.cache.get(url)


async def _compute(
    services: Services,
    counters: RequestCounters,
    subject: Subject,
    computation: Computation,
    *,
    fmt: Format,
    query: str,
) -> tuple[CachedResponse, Timing, Computation]:
    """Computes the mesh of the canonical query, and puts the response into the cache if it fits.

    Returns the response, the times of its steps, and the computation, which counts the response for
    the caller that asked first until a request begins to send it.
    """
    cache = services.cache
    generation, start = cache.generation, time.monotonic()
    with computation.timing.step("surface"):
        surface = await surface_of(services, computation, subject.surface)
    options = parse_mesh_query(parse_qsl(query))
    encode = select_encode_options(options)
    work = plan_mesh(surface, options.mesh_options(), fmt, encode, services.limits)
    mesh_file = await computation.run(work, "mesh")
    computation.finish_work(len(mesh_file.content))
    counters.count_mesh(mesh_file.report)
    # A hash is no good file name, so the surface's own name is taken; the id of an example is one.
    name = mesh_file.name if subject.is_permanent else subject.surface
    file_name = disposition("inline", name, fmt.suffix)
    headers = (
        (b"content-type", fmt.media_type.encode()),
        (b"content-disposition", file_name.encode()),
        *report_headers(mesh_file.report),
    )
    entry = CachedResponse(subject, bytes(mesh_file.content), headers, start)
    cache.put(entry, generation)
    return entry, computation.timing, computation


async def _choose_variant(
    services: Services,
    computation: Computation,
    entry: CachedResponse,
    accepted: Codings,
    timing: Timing,
) -> Variant:
    """The response in the coding that the client prefers, compressed now if necessary.

    If the client accepts plain bodies, the response stays uncompressed in two cases: the cache does
    not keep it, or compression would have to wait for memory. While this request waited, it would
    hold memory that other requests wait for.
    """
    cache, threads = services.cache, services.threads
    coding, accepts_plain = accepted[0], "identity" in accepted
    # The variant for a coding may be the uncompressed body, if compression saves too little.
    variant = entry.variants.get(coding)
    if variant is not None and (accepts_plain or variant.coding == coding):
        return variant
    # If the client accepts no plain body, it needs the compressed one even if it is hardly smaller.
    function = partial(compress, coding) if accepts_plain else COMPRESS_FUNCTIONS[coding]
    work: Work[bytes | None] = Work(
        compression_cost(len(entry.plain)), partial(function, entry.plain)
    )
    has_room = (
        cache.holds(entry) and not threads.queue_length and threads.has_room(work.cost.memory)
    )
    if accepts_plain and not has_room:
        return entry.variants["identity"]

    async def compress_entry(computation: Computation) -> Variant:
        body = await computation.run(work, "compress")
        computation.finish_work(0 if body is None else len(body), is_response=False)
        return cache.add(entry, coding, body)

    key = (entry.subject.url, cache.generation, coding, accepts_plain)
    with timing.step("compress"):
        return await services.flights.join(key, compress_entry, computation, computation.on_end)
