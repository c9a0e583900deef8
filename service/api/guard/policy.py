"""What a request needs, told by its method and its path; the refusals; and private answers."""

from collections.abc import Iterable, Mapping
from typing import Literal, TypeAlias

from starlette.responses import Response

from service.api.caching.entries import RawHeaders
from service.api.problems import KeyNeeded, KeyUnknown, RateLimited, problem_of, problem_response
from service.errors import Issue, SurfaceError
from service.settings.values import Settings

Need: TypeAlias = Literal["nothing", "key", "key or signature"]

READING = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods that change nothing, and compute only what has an address."""

METRICS = "/metrics"

EXEMPT = frozenset({"/health", "/health/live", "/health/ready", METRICS})
"""Asked by machines that watch the service, and not counted."""

FORMATS = "/v1/formats"

_LISTS = frozenset({FORMATS, "/v1/surfaces"})


def needs_keys(settings: Settings) -> bool:
    """Whether there are keys, so that not everybody may do everything."""
    return bool(settings.api_keys or settings.api_keys_file)


class Policy:
    """The rules, by settings.

    Whatever is not a page, a list or the service's own state is closed where it can be: a new call
    below `/v1` needs a key until somebody decides otherwise.
    """

    def __init__(self, settings: Settings) -> None:
        self.has_keys = needs_keys(settings)
        self._private = not settings.public_reads
        self._metrics = settings.metrics == "key"

    def need(self, method: str, path: str) -> Need:
        """What a request needs to be answered."""
        if method not in READING:
            # Where one can only read, and to whom nobody listens, that is said to everybody.
            heard = path.startswith("/v1/") and path != FORMATS and method != "TRACE"
            return "key" if self.has_keys and heard else "nothing"
        # Whatever begins so: routes match, say, a path with an end of line behind it, too.
        if path.startswith(METRICS) and self._metrics:
            return "key"
        if self._private and path.startswith("/v1/") and path not in _LISTS:
            return "key or signature"
        return "nothing"


REALM = 'Bearer realm="surface"'

_BRING = "Authorization: Bearer, and a key"


def key_needed(*, signature: bool = False) -> KeyNeeded:
    """No key was sent; where a signed address would do as well, that is said."""
    needed = f"{_BRING}; or a signed address" if signature else _BRING
    message = "This call needs a key."
    return KeyNeeded(Issue("key_needed", message, "/Authorization", "no key", needed))


def key_unknown() -> KeyUnknown:
    """A key was sent that the service does not know."""
    message = "No such key is known here; it may have been replaced."
    return KeyUnknown(Issue("key_unknown", message, "/Authorization", "an unknown key", _BRING))


def rate_limited(limit: int, seconds: int) -> RateLimited:
    """Too many requests; the next one would be answered in `seconds` seconds."""
    message = "These were too many requests in a short time."
    got, needed = f"more than {limit} a minute", f"a wait of {seconds} s"
    return RateLimited(Issue("rate_limited", message, "", got, needed))


def refusal(error: SurfaceError, wait: int = 0) -> Response:
    """The answer to a request that is not handed on.

    401 says how to authenticate (RFC 6750), 429 after how many seconds to ask again.
    """
    headers: Mapping[str, str] = {"Retry-After": str(wait)} if wait else {}
    if isinstance(error, KeyNeeded):
        headers = {"WWW-Authenticate": REALM}
    elif isinstance(error, KeyUnknown):
        headers = {"WWW-Authenticate": f'{REALM}, error="invalid_token"'}
    return problem_response(problem_of(error), error.issues, headers=dict(headers))


HOUR = 3600

_REVALIDATED = b"private, no-cache"
"""For clients with a key: a browser keeps the answer, and asks each time whether it still may."""


def private_headers(headers: Iterable[tuple[bytes, bytes]], left: int | None) -> RawHeaders:
    """The headers of an answer, as those of an answer that caches of many people must not keep.

    Parameters
    ----------
    left : int or None
        Seconds for which the signature of the address is still good; None where a key was sent.
    """
    changed = [
        (name, _control(value, left)) if name.lower() == b"cache-control" else (name, value)
        for name, value in headers
    ]
    if not any(name.lower() == b"cache-control" for name, _ in changed):
        changed.append((b"cache-control", _REVALIDATED))
    return (*changed, (b"vary", b"Authorization"))


def _control(public: bytes, left: int | None) -> bytes:
    if b"no-store" in public:
        return public
    if left is None:
        return _REVALIDATED
    age = left if b"immutable" in public else min(left, HOUR)
    return b"private, max-age=%d" % age
