"""The outermost layer: every request gets an id, is counted and, if that is wanted, logged."""

import time
from typing import TYPE_CHECKING, Literal

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.observing.exchange import KEY, Exchange, current
from service.api.observing.lines import FAILED, Write, line_of
from service.api.observing.observed import Observed
from service.api.observing.places import Places
from service.api.observing.traces import Ids, Parent, harmless_id, parent_of
from service.api.problems import INTERNAL_ERROR, problem_response
from service.measuring import count_in
from service.settings.values import Settings

if TYPE_CHECKING:
    from service.api.observing.tracing import Tracing

ID_HEADER = "X-Request-Id"

_ID = ID_HEADER.lower().encode()
_PARENT = b"traceparent"


class Observer:
    """Sees every request first and every answer last.

    A hit of the cache passes here too, so this has to be quick: what can be done once is done
    beforehand, and what is counted are plain numbers.

    Parameters
    ----------
    app : ASGI application
    places : Places
        What its paths stand for.
    observed : Observed
        Where it counts.
    settings : Settings
        What is logged, and how.
    write : callable, optional
        Takes lines of the log; without it there are none.
    tracing : Tracing, optional
        Makes spans.
    """

    def __init__(
        self,
        app: ASGIApp,
        places: Places,
        observed: Observed,
        settings: Settings,
        *,
        write: Write | None = None,
        tracing: "Tracing | None" = None,
    ) -> None:
        self.app = app
        self._places = places
        self._observed = observed
        self._new_id = Ids()
        self._tracing = tracing
        self._write = write if settings.access_log else None
        self._line = line_of(settings.log_format)
        self._level: Literal["debug", "info", "warning", "error"] = settings.log_level

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        start = time.perf_counter()
        exchange, parent = self._begun(scope)
        span = None if self._tracing is None else self._tracing.begin(scope, exchange, parent)
        header = (_ID, exchange.id.encode())
        observed = self._observed

        async def counted(message: Message) -> None:
            if message["type"] == "http.response.start":
                exchange.status = message["status"]
                # What is kept in the cache is sent again: it must not change.
                message = {**message, "headers": [*message.get("headers", ()), header]}
            else:
                exchange.sent += len(message.get("body", b""))
            await send(message)

        observed.in_flight += 1
        current.set(exchange)
        count_in(observed.engine)
        try:
            await self.app(scope, receive, counted)
        except Exception:
            if not exchange.status:
                exchange.code = INTERNAL_ERROR.code
                await problem_response(INTERNAL_ERROR)(scope, receive, counted)
            raise  # for the log
        finally:
            observed.in_flight -= 1
            seconds = time.perf_counter() - start
            if exchange.method == "HEAD":
                exchange.sent = 0  # the server leaves out what follows the head
            _take_over(scope, exchange)
            observed.ended(exchange, seconds)
            if self._tracing is not None and span is not None:
                self._tracing.end(span, exchange)
            if self._write is not None and self._is_told(exchange):
                self._write(self._line(exchange, seconds))

    def _begun(self, scope: Scope) -> tuple[Exchange, Parent | None]:
        """What is known of a request from its head, and the span that it comes from."""
        path, root = scope["path"], scope.get("root_path", "")
        # Of a header that comes twice, a dictionary would keep one; so it only says what is there.
        named = dict(scope["headers"])
        id = parent = None
        if _ID in named:
            id = harmless_id(_only(scope, _ID))
        if _PARENT in named:
            parent = parent_of(_only(scope, _PARENT))
        trace_id = self._new_id() + self._new_id() if parent is None else parent.trace_id
        method: str = scope["method"]
        exchange = Exchange(
            id or trace_id,
            trace_id,
            self._new_id(),
            method if method in _METHODS else "other",
            self._places.at(path.removeprefix(root) if root else path),
        )
        scope[KEY] = exchange
        return exchange, parent

    def _is_told(self, exchange: Exchange) -> bool:
        """Whether a request is logged at this level."""
        if self._level == "debug" or exchange.status >= FAILED:
            return True
        return self._level == "info" and not exchange.place.quiet


_METHODS = frozenset({"GET", "HEAD", "POST", "DELETE", "OPTIONS", "PUT", "PATCH"})


def _take_over(scope: Scope, exchange: Exchange) -> None:
    """What the guard, on its way in, found out of who asks."""
    client, state = scope.get("client"), scope.get("state")
    if client:
        exchange.client = client[0]
    if state:
        exchange.key = state.get("key", "")
        exchange.code = exchange.code or state.get("problem", "")


def _only(scope: Scope, name: bytes) -> bytes:
    """The value of a header that must stand there once; of several, none is believed."""
    values = [value for each, value in scope["headers"] if each == name]
    return values[0] if len(values) == 1 else b""
