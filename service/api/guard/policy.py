"""Access rules by method and path; responses of the guard; and headers of private responses."""

from collections.abc import Iterable, Mapping
from typing import Literal, TypeAlias

from starlette.responses import Response

from service.api.caching.cached_response import RawHeaders
from service.api.errors import KeyNeeded, KeyUnknown, RateLimited, ScopeNeeded
from service.api.guard.keys import KeyScope
from service.api.problems import problem_of, problem_response
from service.errors import Issue, SurfaceError
from service.settings.values import Settings

Need: TypeAlias = Literal["nothing", "key", "key or signature"]

READING = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods that change nothing. Of the results that the service computes, they return only meshes of
stored surfaces and examples (`/v1/surfaces/{id}/mesh.{suffix}`)."""

METRICS = "/metrics"

EXEMPT = frozenset({"/health", "/health/live", "/health/ready", METRICS})
"""Paths for monitoring: requests for them do not count against a rate limit."""

FORMATS = "/v1/formats"

JOBS = "/v1/jobs"
"""The list of the caller's jobs, and the beginning of the URLs of each job."""

STORED = "/v1/stored"
"""The list of all stored surfaces. An id is a permission to read, so the list is for operators."""

_LISTS = frozenset({FORMATS, "/v1/surfaces"})
"""Lists that every client may read."""


def needs_keys(settings: Settings) -> bool:
    """Whether the settings have API keys."""
    return bool(settings.api_keys or settings.api_keys_file)


class Policy:
    """Decides what each request needs, according to the settings.

    If the settings have keys, each call below `/v1` by another method than those of `READING` needs
    a key. If reads are not public, each call below `/v1` by these methods needs a key or a signed
    URL, except for the lists; jobs need a key, because their URLs cannot be signed. So a new call
    is protected by default.
    """

    def __init__(self, settings: Settings) -> None:
        self.has_keys = needs_keys(settings)
        self._reads_need_access = not settings.public_reads
        self._metrics_need_key = settings.metrics == "key"

    def need(self, method: str, path: str) -> Need:
        """The need of a request with this method and path: a key, a signature or nothing."""
        if method not in READING:
            # No key for requests whose response is 404 or 405 in any case.
            is_guarded = path.startswith("/v1/") and path != FORMATS and method != "TRACE"
            return "key" if self.has_keys and is_guarded else "nothing"
        # `startswith`, because a route also matches its path with a line feed at the end.
        if path.startswith(METRICS) and self._metrics_need_key:
            return "key"
        if path.startswith(STORED) and self.has_keys:
            return "key"
        if path.startswith(JOBS):
            is_list = not path.startswith(JOBS + "/")
            return "key" if self.has_keys and (is_list or self._reads_need_access) else "nothing"
        if self._reads_need_access and path.startswith("/v1/") and path not in _LISTS:
            return "key or signature"
        return "nothing"


def scope_of(method: str, path: str) -> KeyScope:
    """The scope that a key needs for a call, where the call needs a key.

    Calls that are not named here need `compute`, or `read` if their method changes nothing.
    """
    if path.startswith(STORED):
        return "admin"
    if method in READING or path == "/v1/sign":  # signing shares what the key itself may read
        return "read"
    if path.startswith("/v1/surfaces"):
        return "delete" if method == "DELETE" else "store"
    return "compute"


REALM = 'Bearer realm="surface"'

_NEEDED = "Authorization: Bearer, and a key"


def key_needed(*, or_signature: bool = False) -> KeyNeeded:
    """The error of a request without a key; `or_signature`: a signed URL is accepted too."""
    return KeyNeeded(
        Issue(
            "key_needed",
            "This call needs a key.",
            "/Authorization",
            got="no key",
            needed=f"{_NEEDED}; or a signed URL" if or_signature else _NEEDED,
        )
    )


def key_unknown() -> KeyUnknown:
    """The error of a key that the service does not know."""
    message = "The service does not know this key; it may have been replaced."
    return KeyUnknown(Issue("key_unknown", message, "/Authorization", "an unknown key", _NEEDED))


def scope_needed(scope: KeyScope) -> ScopeNeeded:
    """The error of a key that lacks the scope of the call."""
    return ScopeNeeded(
        Issue(
            "scope_needed",
            "This key does not permit this call.",
            "/Authorization",
            got="a key without this scope",
            needed=f"a key with the scope {scope}",
        )
    )


def rate_limited(limit: int, seconds: int) -> RateLimited:
    """The error of too many requests; the next one is allowed in `seconds` seconds."""
    return RateLimited(
        Issue(
            "rate_limited",
            "Too many requests in a short time.",
            got=f"more than {limit} a minute",
            needed=f"a wait of {seconds} s",
        )
    )


def build_refusal(error: SurfaceError, retry_after: int = 0) -> Response:
    """The response to a request that the guard does not pass on.

    A 401 says how to authenticate, a 403 that a scope is missing (RFC 6750, section 3), a 429 after
    how many seconds the client may try again (`retry_after`).
    """
    headers: Mapping[str, str] = {"Retry-After": str(retry_after)} if retry_after else {}
    if isinstance(error, KeyNeeded):
        headers = {"WWW-Authenticate": REALM}
    elif isinstance(error, KeyUnknown):
        headers = {"WWW-Authenticate": f'{REALM}, error="invalid_token"'}
    elif isinstance(error, ScopeNeeded):
        headers = {"WWW-Authenticate": f'{REALM}, error="insufficient_scope"'}
    return problem_response(problem_of(error), error.issues, headers=dict(headers))


HOUR = 3600
"""Seconds for which caches keep a response that may change."""

_REVALIDATED = b"private, no-cache"
"""For requests with a key: a browser caches the response, and revalidates it each time."""


def private_headers(headers: Iterable[tuple[bytes, bytes]], seconds_left: int | None) -> RawHeaders:
    """The headers of a response, changed so that shared caches do not keep it.

    Parameters
    ----------
    seconds_left : int or None
        Seconds until the URL's signature expires; None if the client sent a key.
    """
    private = [
        (name, _make_private(value, seconds_left))
        if name.lower() == b"cache-control"
        else (name, value)
        for name, value in headers
    ]
    if not any(name.lower() == b"cache-control" for name, _ in private):
        private.append((b"cache-control", _REVALIDATED))
    return (*private, (b"vary", b"Authorization"))


def _make_private(cache_control: bytes, seconds_left: int | None) -> bytes:
    if b"no-store" in cache_control:
        return cache_control
    if seconds_left is None:
        return _REVALIDATED
    max_age = seconds_left if b"immutable" in cache_control else min(seconds_left, HOUR)
    return b"private, max-age=%d" % max_age
