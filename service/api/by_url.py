"""Files by URL, which browsers, and caches between them and the service, may keep.

A file is a pure function of its canonical URL. The service computes equal requests at the same time
once, and keeps responses in memory, compressed ones too.
"""

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from fastapi import Request, Response

from service.api.caching.cached_response import (
    CachedResponse,
    RawHeaders,
    Subject,
    Variant,
    find_match,
    matches_all,
)
from service.api.caching.codings import COMPRESS_FUNCTIONS, Codings, compress
from service.api.computation import MAX_BUFFERED, Computation
from service.api.record import Timing, record_of
from service.api.removals import is_removed
from service.api.responses import FileResponse
from service.api.services import Context, Services
from service.api.stored import exists, surface_of
from service.pipeline.cost import Work, compression_cost
from service.surface.kinds import Surface

Make: TypeAlias = Callable[[Surface, Computation], Awaitable[tuple[bytes, RawHeaders]]]
"""Computes the file of a surface: its bytes, and the headers that all codings share."""


@dataclass(frozen=True, eq=False, slots=True)
class UrlRequest:
    """The parts of a request by URL.

    Attributes
    ----------
    subject : Subject
    accepted : Codings
        The codings that the client accepts, the best first.
    condition : bytes or None
        The If-None-Match header.
    has_engine : bool
        Whether the URL has `engine`.
    """

    subject: Subject
    accepted: Codings
    condition: bytes | None
    has_engine: bool


async def answer_by_url(
    request: Request, context: Context, asked: UrlRequest, make: Make
) -> Response:
    """The file, or 304 if the client has it already."""
    services, computation, *_ = context
    subject, accepted, has_engine = asked.subject, asked.accepted, asked.has_engine
    cache, record = services.cache, record_of(request.scope)
    entry = cache.get(subject.url)
    unchanged_coding = find_match(asked.condition, accepted, subject.tag)
    async with computation.until_deadline():
        if entry is not None and await is_removed(services.store, cache, entry):
            entry = None
        if unchanged_coding is not None and (
            entry is not None or await exists(services.store, subject.surface)
        ):
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
            compute = partial(_compute, services, subject, make=make)
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
    # `If-None-Match: *` matches if the file exists, which only computing it shows.
    if asked.condition is not None and matches_all(asked.condition):
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
    services: Services, subject: Subject, computation: Computation, *, make: Make
) -> tuple[CachedResponse, Timing, Computation]:
    """Computes the file, and puts the response into the cache if it fits.

    Returns the response, the times of its steps, and the computation, which counts the response for
    the caller that asked first until a request begins to send it.
    """
    cache = services.cache
    generation, start = cache.generation, time.monotonic()
    with computation.timing.step("surface"):
        surface = await surface_of(services, computation, subject.surface)
    content, headers = await make(surface, computation)
    entry = CachedResponse(subject, content, headers, start)
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
