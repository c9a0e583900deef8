"""CORS: whether pages of other origins may read responses (Fetch standard).

`RequestMiddleware` adds the headers to every response; `CacheMiddleware` answers preflight
requests.

If every origin may read responses, every response allows it, even to a request without `Origin`: a
script may then read a file that the browser has cached from an ordinary visit. If only some origins
may read responses, `Vary: Origin` tells caches to keep the responses to each origin apart.
"""

from collections.abc import Sequence

from starlette.types import Message, Scope

from service.api.caching.cached_response import RawHeaders
from service.api.record import ID_HEADER
from service.api.responses import BOUND_HEADER, TRIANGLES_HEADER, VERTICES_HEADER

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
"""Response headers that scripts may read, besides those that the standard always allows."""

_PREFLIGHT: RawHeaders = (
    # Not DELETE: pages of other origins cannot delete surfaces.
    (b"access-control-allow-methods", b"GET, HEAD, POST"),
    (b"access-control-allow-headers", b"Authorization, Content-Type, If-None-Match"),
    # One day; browsers may use less.
    (b"access-control-max-age", b"86400"),
)


class Origins:
    """The origins whose pages may read responses."""

    def __init__(self, origins: Sequence[str]) -> None:
        allows_all = "*" in origins
        self._listed_origins = frozenset(() if allows_all else (o.encode() for o in origins))
        timing = "*" if allows_all else ", ".join(origins)
        # For pages that may read the response.
        self._reader_headers: RawHeaders = (
            (b"access-control-expose-headers", ", ".join(EXPOSED).encode()),
            (b"timing-allow-origin", timing.encode()),
        )
        # For loads without CORS, such as those of <img>. Pages of other origins that isolate
        # themselves (COEP) load only files with `cross-origin`.
        resource_policy = b"cross-origin" if allows_all else b"same-origin"
        self._common_headers: RawHeaders = ((b"cross-origin-resource-policy", resource_policy),)
        if allows_all:
            self._common_headers += ((b"access-control-allow-origin", b"*"), *self._reader_headers)
        elif origins:
            self._common_headers += ((b"vary", b"Origin"),)
        head = {"type": "http.response.start", "status": 204, "headers": _PREFLIGHT}
        self._preflight: Message | None = head if origins else None

    def headers(self, scope: Scope) -> RawHeaders:
        """The CORS headers of the response to a request."""
        if not self._listed_origins:
            return self._common_headers
        origin = dict(scope["headers"]).get(b"origin")
        if origin not in self._listed_origins:
            return self._common_headers
        return (
            *self._common_headers,
            (b"access-control-allow-origin", origin),
            *self._reader_headers,
        )

    def preflight(self, scope: Scope) -> Message | None:
        """The head of the response to a preflight request; None for all other requests."""
        return self._preflight if is_preflight(scope) else None


def is_preflight(scope: Scope) -> bool:
    """Whether a request is a CORS preflight request.

    With it a browser asks for permission before it sends the actual request. It never has a key.
    """
    return scope["method"] == "OPTIONS" and any(
        name == b"access-control-request-method" for name, _ in scope["headers"]
    )
