"""What becomes known of a request and its answer on the way through the service."""

from contextvars import ContextVar
from typing import Any

from starlette.types import Scope

from service.api.observing.places import Place

KEY = "exchange"
"""Where it stands in an ASGI scope."""


class Exchange:
    """One request and its answer; whoever learns something of them writes it here.

    Attributes
    ----------
    id : str
        The request's id: the client's, if that was harmless; else that of the trace.
    trace_id, span_id : str
        In hexadecimal digits; the span is the service's own part of the trace.
    method : str
        As HTTP names it; "other" for what HTTP does not know.
    place : Place
        What the path stands for.
    client : str
        The address that asks.
    key : str
        Name of the API key that it asks with.
    status : int
        That of the answer; 0 until it has begun.
    sent : int
        Bytes of its body that were handed to the server.
    code : str
        Of the problem that the answer is.
    cache : str
        "hit" or "miss", where it is a matter of the cache.
    format : str
        Name of the format of the answer.
    steps : list
        Of the work that was done for it: name, start on the clock `perf_counter`, seconds.
    """

    __slots__ = (
        "cache",
        "client",
        "code",
        "format",
        "id",
        "key",
        "method",
        "place",
        "sent",
        "span_id",
        "status",
        "steps",
        "trace_id",
    )

    def __init__(self, id: str, trace_id: str, span_id: str, method: str, place: Place) -> None:
        self.id = id
        self.trace_id = trace_id
        self.span_id = span_id
        self.method = method
        self.place = place
        self.client = "-"
        self.status = self.sent = 0
        self.key = self.code = self.cache = ""
        self.format = place.format
        self.steps: list[tuple[str, float, float]] = []


current: ContextVar[Exchange | None] = ContextVar("exchange", default=None)
"""The one under way: log records take ids from it."""


def exchange_of(scope: Scope | dict[str, Any]) -> Exchange:
    """The exchange that a scope belongs to."""
    found: Exchange = scope[KEY]
    return found
