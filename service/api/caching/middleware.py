"""Middleware that sends cached responses, and answers preflight requests."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import attrgetter

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.caching.cache import ResponseCache
from service.api.caching.cached_response import CachedResponse, Variant, find_held, is_any
from service.api.caching.codings import AcceptedCodings, parse_accepted_codings
from service.api.cors import Origins
from service.api.observing.record import record_of
from service.api.responses import CHUNK, UNTRACKED, send_pieces

_END: Message = {"type": "http.response.body", "body": b""}


@dataclass(frozen=True, eq=False, slots=True)
class CacheMiddleware:
    """Sends cached responses and answers preflight requests; passes on all other requests.

    It looks a URL up as the client wrote it, without parsing, and the heads are ready: a hit takes
    a few microseconds, most of them in the server.
    """

    app: ASGIApp
    cache: ResponseCache
    origins: Origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request."""
        method = scope["method"] if scope["type"] == "http" else ""
        if method in _METHODS:
            cached = self.cache.find(scope["path"], scope["query_string"])
            if cached is not None:
                entry, pinned = cached
                coding = condition = None
                for name, value in scope["headers"]:
                    if name == b"accept-encoding":
                        coding = value if coding is None else coding + b"," + value
                    elif name == b"if-none-match":
                        condition = value if condition is None else condition + b"," + value
                chosen = _choose(entry, parse_accepted_codings(coding), condition)
                if chosen is not None:
                    self.cache.counts.hits += 1
                    record_of(scope).cache = "hit"
                    variant, unchanged = chosen
                    await send((variant.unchanged if unchanged else variant.full)[pinned])
                    if unchanged or method == "HEAD":
                        await send(_END)
                    elif len(variant.body) <= UNTRACKED:
                        await send(variant.whole)
                    else:
                        await self._send_tracked(entry, variant, send)
                    return
        elif method == "OPTIONS" and (start := self.origins.preflight(scope)) is not None:
            await send(start)
            await send(_END)
            return
        await self.app(scope, receive, send)

    async def _send_tracked(self, entry: CachedResponse, variant: Variant, send: Send) -> None:
        """Sends a long body; the entry stays in memory while a slow client receives it."""
        self.cache.begin(entry)
        try:
            if len(variant.body) <= CHUNK:
                await send(variant.piece)
                await send(_END)
            else:
                await send_pieces(variant.body, send)
        finally:
            self.cache.end(entry)


_METHODS = frozenset({"GET", "HEAD"})


def _choose(
    entry: CachedResponse, accepted: AcceptedCodings, condition: bytes | None
) -> tuple[Variant, bool] | None:
    """The variant to send, and whether the client has it already; None if it is not in memory."""
    if not accepted.plain:
        return None  # the client refuses plain bodies: compress even if it does not pay
    held = find_held(condition, _ready(entry, accepted), _TAG)
    if held is not None:
        return held, True
    variant = entry.variants.get(accepted.order[0])
    return None if variant is None else (variant, condition is not None and is_any(condition))


def _ready(entry: CachedResponse, accepted: AcceptedCodings) -> Iterator[Variant]:
    """The variants in memory that the client accepts, best first."""
    return (entry.variants[coding] for coding in accepted.order if coding in entry.variants)


_TAG: Callable[[Variant], bytes] = attrgetter("tag")
