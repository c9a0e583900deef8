"""The outermost middleware: it makes the request record, times, counts and logs each request."""

import logging
import time
from importlib import import_module
from typing import TYPE_CHECKING

from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.observing.access_log import AccessLog, Write
from service.api.observing.health import SelfTest
from service.api.observing.metrics import RequestCounters, register_state
from service.api.observing.record import RouteLabels, record_of, start_record
from service.api.problems import INTERNAL_ERROR, problem_response
from service.errors import InvalidSettings
from service.measuring import count_in

if TYPE_CHECKING:
    from service.api.observing.tracing import Tracing

ID_HEADER = "X-Request-Id"

_ID = ID_HEADER.lower().encode()
_log = logging.getLogger(__name__)


def add_telemetry(app: FastAPI, inner: ASGIApp, write: Write | None) -> "RequestMiddleware":
    """Puts the middleware around `inner`, and what it and the metrics need into `app.state`.

    `write` takes the lines of the access log; there are none without it. Spans are made where the
    setting `tracing` is set; where it is not, nothing of OpenTelemetry's SDK is imported.

    Raises
    ------
    InvalidSettings
        The extra `telemetry` is needed and not installed.
    """
    state = app.state
    state.observed = RequestCounters()
    state.self_test = SelfTest()
    state.connections = ()  # the server puts its own here
    register_state(state.observed.registry, state)
    state.tracing = None
    if state.settings.tracing:
        try:
            module = import_module("service.api.observing.tracing")
        except ModuleNotFoundError as error:
            raise InvalidSettings(
                "SURFACE_TRACING: got 'true', needed the extra `telemetry` to be installed: "
                f"there is no {error.name}."
            ) from None
        tracing: Tracing = module.Tracing(inner, module.exporting_provider())
        state.tracing = inner = tracing
    labels = RouteLabels(route.path or "" for route in iter_route_contexts(app.routes))
    return RequestMiddleware(inner, labels, state.observed, AccessLog(state.settings, write))


class RequestMiddleware:
    """Sees every request first and every answer last, hits of the cache too."""

    def __init__(
        self, app: ASGIApp, labels: RouteLabels, counters: RequestCounters, log: AccessLog
    ) -> None:
        self.app = app
        self._labels = labels
        self._counters = counters
        self._log = log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        start = time.perf_counter()
        record = start_record(scope, self._labels)
        counters = self._counters

        async def recorded(message: Message) -> None:
            if message["type"] == "http.response.start":
                record.status = message["status"]
                # Messages of the cache are sent again: they must not change.
                headers = [*message.get("headers", ()), (_ID, record.id.encode())]
                message = {**message, "headers": headers}
            elif record.method != "HEAD":  # of which the server sends the head only
                record.sent += len(message.get("body", b""))
            await send(message)

        counters.in_flight += 1
        count_in(counters.add_engine_seconds)
        try:
            await self.app(scope, receive, recorded)
        except Exception as error:
            await answer_failure(error, scope, receive, recorded)
        finally:
            counters.in_flight -= 1
            client = scope.get("client")  # the guard knows for whom a proxy asks
            record.client = client[0] if client else "-"
            seconds = time.perf_counter() - start
            counters.count(record, seconds)
            self._log.add(record, time.time(), seconds)


async def answer_failure(error: Exception, scope: Scope, receive: Receive, send: Send) -> None:
    """Logs a failure of the service, and answers 500 unless an answer has begun.

    An answer that has begun stays incomplete: the server closes the connection.
    """
    _log.error("a request failed", exc_info=error)
    record = record_of(scope)
    if not record.status:
        record.code = INTERNAL_ERROR.code
        await problem_response(INTERNAL_ERROR)(scope, receive, send)
