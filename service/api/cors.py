"""CORS: whether pages of other origins may read responses (Fetch standard).

`RequestMiddleware` adds the headers to every response; `CacheMiddleware` answers preflight
requests.

If every origin may read responses, every response allows it, even to a request without `Origin`: a
script may then read a file that the browser has cached from an ordinary visit. If only some origins
may read responses, `Vary: Origin` tells caches to keep the responses to each origin apart.

The list of an address's jobs is an exception: to every page that its user visits, this address
would be a permission to find and read the jobs. So only pages of listed origins, and pages that
have a key, may read it.
"""

import re
from collections.abc import Sequence

from starlette.types import Message, Scope

from service.api.caching.cached_response import RawHeaders
from service.api.record import ID_HEADER
from service.api.responses import (
    BOUND_HEADER,
    GAP_HEADER,
    READING_HEADER,
    TRIANGLES_HEADER,
    VERTICES_HEADER,
    WRITING_HEADER,
)
from service.errors import InvalidSettings

EXPOSED = (
    "Content-Disposition",
    "ETag",
    "Link",
    "Location",
    "Preference-Applied",
    "RateLimit",
    "RateLimit-Policy",
    "Retry-After",
    "Server-Timing",
    ID_HEADER,
    BOUND_HEADER,
    GAP_HEADER,
    READING_HEADER,
    TRIANGLES_HEADER,
    VERTICES_HEADER,
    WRITING_HEADER,
)
"""Response headers that scripts may read, besides those that the standard always allows."""

ALLOWED = (
    "Authorization",
    "Cache-Control",
    "Content-Type",
    "If-None-Match",
    "Prefer",
    "traceparent",
    "tracestate",
    ID_HEADER,
)
"""Request headers that scripts of other origins may send, besides those that the standard always
allows. Libraries for traces and for requests add some of them to every request."""

_JOBS = "/v1/jobs"


def _build_preflight(methods: bytes) -> Message:
    """The head of the response to a preflight request for a URL that has these methods."""
    headers: RawHeaders = (
        (b"access-control-allow-methods", methods),
        (b"access-control-allow-headers", ", ".join(ALLOWED).encode()),
        # One day; browsers may use less.
        (b"access-control-max-age", b"86400"),
    )
    return {"type": "http.response.start", "status": 204, "headers": headers}


# Pages of other origins cannot delete surfaces, but they can withdraw their jobs.
_PREFLIGHT = _build_preflight(b"GET, HEAD, POST")
_JOB_PREFLIGHT = _build_preflight(b"GET, HEAD, POST, DELETE")


_CROSS_ORIGIN, _SAME_ORIGIN = (
    (b"cross-origin-resource-policy", policy) for policy in (b"cross-origin", b"same-origin")
)


_ORIGIN = re.compile(
    r"(?P<scheme>[a-z][a-z0-9+.-]*)://(?:[a-z0-9_-]+(?:\.[a-z0-9_-]+)*|\[[0-9a-f:.]+\])"
    r"(?P<port>:[1-9][0-9]{0,4})?"
)
"""An origin as browsers send it (Fetch standard, "Origin header"): lower case, without a path."""

_DEFAULT_PORTS = {("http", ":80"), ("https", ":443")}


class Origins:
    """The origins whose pages may read responses.

    Raises
    ------
    InvalidSettings
        A text is neither `*` nor an origin in the form in which browsers send it, so that no
        request could ever have it.
    """

    def __init__(self, origins: Sequence[str]) -> None:
        for origin in origins:
            _check_origin(origin)
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
        self._common_headers: RawHeaders = (_CROSS_ORIGIN if allows_all else _SAME_ORIGIN,)
        if allows_all:
            self._common_headers += ((b"access-control-allow-origin", b"*"), *self._reader_headers)
        elif origins:
            self._common_headers += ((b"vary", b"Origin"),)
        self._has_origins = bool(origins)

    def headers(self, scope: Scope) -> RawHeaders:
        """The CORS headers of the response to a request."""
        if not self._listed_origins:
            # A preflight request has no key, also if the request after it has one.
            lists_jobs = scope["path"].endswith(_JOBS) and scope["method"] in ("GET", "HEAD")
            if lists_jobs and not _has_key(scope):
                return (_SAME_ORIGIN,)
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
        if not (self._has_origins and is_preflight(scope)):
            return None
        return _JOB_PREFLIGHT if f"{_JOBS}/" in scope["path"] else _PREFLIGHT


def _has_key(scope: Scope) -> bool:
    return any(name == b"authorization" for name, _ in scope["headers"])


def is_origin(text: str) -> bool:
    """Whether a text is an origin in the form in which browsers send it."""
    match = _ORIGIN.fullmatch(text)
    return match is not None and (match["scheme"], match["port"]) not in _DEFAULT_PORTS


def _check_origin(text: str) -> None:
    # `null` is the origin of every page in a sandbox and of every file: `*` allows them too.
    if text != "*" and not is_origin(text):
        raise InvalidSettings(
            f"SURFACE_CORS_ORIGINS: got {text!r}, needed * or an origin such as "
            "https://example.com or http://localhost:8080: in lower case, without a path, and "
            "without a port that is the default."
        )


def is_preflight(scope: Scope) -> bool:
    """Whether a request is a CORS preflight request.

    With it a browser asks for permission before it sends the actual request. It never has a key.
    """
    return scope["method"] == "OPTIONS" and any(
        name == b"access-control-request-method" for name, _ in scope["headers"]
    )
