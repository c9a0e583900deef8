"""Which pages of other origins may read answers (the CORS protocol of the Fetch standard).

Where every origin may, every answer says so, also to requests without an Origin: a file that a
browser has kept from an ordinary visit is then good for a script's request as well. Where only some
may, `Vary` keeps caches from mixing them up.
"""

from collections.abc import Sequence

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.answers import BOUND_HEADER, TRIANGLES_HEADER, VERTICES_HEADER
from service.api.caching.entries import RawHeaders
from service.api.observing.middleware import ID_HEADER

EXPOSED = (
    "Content-Disposition",
    "ETag",
    "Link",
    "Location",
    "RateLimit",
    "RateLimit-Policy",
    "Retry-After",
    "Server-Timing",
    ID_HEADER,
    BOUND_HEADER,
    TRIANGLES_HEADER,
    VERTICES_HEADER,
)
"""Headers that scripts may read, beside those that they always may."""

_PREFLIGHT: RawHeaders = (
    (b"access-control-allow-methods", b"GET, HEAD, POST"),
    (b"access-control-allow-headers", b"Authorization, Content-Type, If-None-Match"),
    # A day; browsers shorten it to what they like.
    (b"access-control-max-age", b"86400"),
)


class Origins:
    """The origins whose pages may read answers."""

    def __init__(self, origins: Sequence[str]) -> None:
        self._any = "*" in origins
        self._allowed = frozenset(origin.encode() for origin in origins)
        timing = "*" if self._any else ", ".join(origins)
        self._readable: RawHeaders = (
            (b"access-control-expose-headers", ", ".join(EXPOSED).encode()),
            (b"timing-allow-origin", timing.encode()),
        )
        self.asked = bool(origins)
        """Whether browsers get an answer to what they ask beforehand."""
        # Pages that isolate themselves (COEP) take nothing of another origin that does not say so.
        embedded = b"cross-origin" if self._any else b"same-origin"
        self.always: RawHeaders = ((b"cross-origin-resource-policy", embedded),)
        """The headers of every answer, whatever its origin."""
        if self._any:
            self.always += ((b"access-control-allow-origin", b"*"), *self._readable)
        elif origins:
            self.always += ((b"vary", b"Origin"),)

    def granted(self, origin: bytes | None) -> RawHeaders:
        """What an answer carries in addition, for a request from this origin."""
        if self._any or origin not in self._allowed or origin is None:
            return ()
        return ((b"access-control-allow-origin", origin), *self._readable)


class CrossOrigin:
    """Says on every answer who may read it, and answers what browsers ask beforehand."""

    def __init__(self, app: ASGIApp, origins: Origins) -> None:
        self._app = app
        self._origins = origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        added = (*self._origins.always, *self._origins.granted(headers.get(b"origin")))
        asks = scope["method"] == "OPTIONS" and b"access-control-request-method" in headers
        if asks and self._origins.asked:
            start = {"type": "http.response.start", "status": 204}
            await send({**start, "headers": [*added, *_PREFLIGHT]})
            await send({"type": "http.response.body", "body": b""})
            return

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", ()), *added]}
            await send(message)

        await self._app(scope, receive, sent)
