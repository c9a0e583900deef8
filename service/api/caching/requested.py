"""What a request says of the codings that it takes, and of the answers that it has."""

from starlette.requests import Request

from service.api.caching.codings import CODINGS, Accepted, accepted
from service.api.problems import NotAcceptable
from service.errors import Issue


def codings_of(request: Request) -> Accepted:
    """The codings that the client takes; raises what `check_codings` raises."""
    return check_codings(_header(request, "accept-encoding"))


def condition_of(request: Request) -> bytes | None:
    """If-None-Match, its lines joined; None where the answer is wanted in any case."""
    return _header(request, "if-none-match")


def check_codings(header: bytes | None) -> Accepted:
    """What an Accept-Encoding header allows.

    Raises
    ------
    NotAcceptable
        If that is nothing.
    """
    wanted = accepted(header)
    if not wanted.order:
        raise NotAcceptable(
            Issue(
                "not_acceptable",
                "Every coding that is made here is excluded.",
                "/Accept-Encoding",
                "none of the codings made here",
                "one of " + ", ".join(CODINGS),
            )
        )
    return wanted


def _header(request: Request, name: str) -> bytes | None:
    lines = request.headers.getlist(name)
    return ", ".join(lines).encode("latin-1") if lines else None
