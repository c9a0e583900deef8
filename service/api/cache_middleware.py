"""Middleware that sends cached responses, and answers preflight requests."""

import time
from dataclasses import dataclass
from operator import attrgetter

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.caching.cache import ResponseCache
from service.api.caching.cached_response import CachedResponse, Variant, find_match, matches_all
from service.api.caching.codings import Codings, parse_accepted_codings
from service.api.callers import caller_of
from service.api.computation import MAX_BUFFERED
from service.api.cors import Origins
from service.api.record import record_of
from service.api.removals import is_removed
from service.api.responses import CHUNK, send_buffers
from service.api.unread import UnreadBytes
from service.storage.store import SurfaceStore


@dataclass(frozen=True, eq=False, slots=True)
class CacheMiddleware:
    """Sends cached responses and answers preflight requests; passes on all other requests.

    The middleware looks a URL up as the client wrote it, without parsing, and the heads of cached
    responses are ready. So a cached response takes a few microseconds, most of them in the server.
    """

    app: ASGIApp
    cache: ResponseCache
    store: SurfaceStore
    unread: UnreadBytes
    origins: Origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request."""
        method = scope["method"]
        if method in _METHODS:
            cached = self.cache.find(scope["path"], scope["query_string"])
            if cached is not None and not (
                cached[0].check_time <= time.monotonic()
                and await is_removed(self.store, self.cache, cached[0])
            ):
                entry, has_engine = cached
                codings = condition = None
                for name, value in scope["headers"]:
                    if name == b"accept-encoding":
                        codings = value if codings is None else codings + b"," + value
                    elif name == b"if-none-match":
                        condition = value if condition is None else condition + b"," + value
                choice = _choose_variant(entry, parse_accepted_codings(codings), condition)
                if choice is not None:
                    variant, is_unchanged = choice
                    head = (variant.heads_304 if is_unchanged else variant.heads_200)[has_engine]
                    body = b"" if is_unchanged or method == "HEAD" else variant.body
                    is_long = len(body) > MAX_BUFFERED
                    caller = caller_of(scope) if is_long else ""
                    if not is_long or self.unread.may_begin(caller, (body,), len(body)):
                        self.cache.hits += 1
                        record_of(scope).cache = "hit"
                        if is_long:
                            await self._send_long(entry, caller, head, body, send)
                        else:
                            await send(head)
                            await send({"type": "http.response.body", "body": body})
                        return
                    # The route waits until the caller has read other responses.
        elif method == "OPTIONS" and (answer := self.origins.preflight(scope)) is not None:
            await send(answer)
            await send({"type": "http.response.body", "body": b""})
            return
        await self.app(scope, receive, send)

    async def _send_long(
        self, entry: CachedResponse, caller: str, head: Message, body: bytes, send: Send
    ) -> None:
        """Sends a long body; the entry stays in memory while a slow client receives it."""
        self.cache.begin(entry)
        self.unread.begin(caller, body)
        try:
            await send(head)
            if len(body) <= CHUNK:
                await send({"type": "http.response.body", "body": body, "more_body": True})
                await send({"type": "http.response.body", "body": b""})
            else:
                await send_buffers([body], send)
        finally:
            self.unread.end(caller, body)
            self.cache.end(entry)


_METHODS = frozenset({"GET", "HEAD"})


def _choose_variant(
    entry: CachedResponse, accepted: Codings, condition: bytes | None
) -> tuple[Variant, bool] | None:
    """The variant to send, and whether the client has it already; None if it must be made."""
    if "identity" not in accepted:
        return None  # the client accepts only compressed bodies, even if they are not smaller
    variants = (entry.variants[coding] for coding in accepted if coding in entry.variants)
    unchanged = find_match(condition, variants, attrgetter("tag"))
    if unchanged is not None:
        return unchanged, True
    variant = entry.variants.get(accepted[0])
    return None if variant is None else (variant, condition is not None and matches_all(condition))
