"""What the guard answers instead of the application."""

from collections.abc import Mapping

from starlette.responses import Response

from service.api.problems import KeyNeeded, KeyUnknown, RateLimited, problem_of, problem_response
from service.errors import Issue, SurfaceError

REALM = 'Bearer realm="surface"'

_BRING = "Authorization: Bearer, and a key"


def key_needed(*, signature: bool = False) -> KeyNeeded:
    """No key was sent; where a signed address would do as well, that is said."""
    needed = f"{_BRING}; or a signed address" if signature else _BRING
    return KeyNeeded(
        Issue("key_needed", "This call needs a key.", "/Authorization", "no key", needed)
    )


def key_unknown() -> KeyUnknown:
    """A key was sent that is none of ours."""
    return KeyUnknown(
        Issue(
            "key_unknown",
            "No such key is known here; it may have been replaced.",
            "/Authorization",
            "an unknown key",
            _BRING,
        )
    )


def rate_limited(limit: int, seconds: int) -> RateLimited:
    """Too many requests; the next one would be answered in so many seconds."""
    return RateLimited(
        Issue(
            "rate_limited",
            "These were too many requests in a short time.",
            got=f"more than {limit} a minute",
            needed=f"a wait of {seconds} s",
        )
    )


def refusal(error: SurfaceError, wait: int = 0) -> Response:
    """The answer to a request that is not handed on.

    401 says how to come back (RFC 6750), 429 when: in so many seconds.
    """
    headers: Mapping[str, str] = {"Retry-After": str(wait)} if wait else {}
    if isinstance(error, KeyNeeded):
        headers = {"WWW-Authenticate": REALM}
    elif isinstance(error, KeyUnknown):
        headers = {"WWW-Authenticate": f'{REALM}, error="invalid_token"'}
    return problem_response(problem_of(error), error.issues, headers=dict(headers))
