"""The outermost middleware: records, counts and logs each request, and measures its time.

It also adds headers to every response: the request's id, and CORS.

This module formats the lines of the access log itself, because `logging` would take ten times as
long; `service.server.logs` writes all other lines in the same form.
"""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeAlias

import orjson
from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.cors import Origins
from service.api.observing.health import SelfTest
from service.api.observing.metrics import RequestCounters, register_state
from service.api.problems import INTERNAL_ERROR, problem_response
from service.api.record import (
    ID_HEADER,
    RequestRecord,
    RouteLabels,
    record_of,
    start_record,
)
from service.api.services import Services
from service.errors import InvalidSettings
from service.measuring import report_times
from service.settings.values import Settings

if TYPE_CHECKING:
    from service.api.observing.tracing import Tracing

_ID = ID_HEADER.lower().encode()
_log = logging.getLogger(__name__)

Write: TypeAlias = Callable[[str], None]
"""Writes a line, which ends with a line feed."""

SERVER_ERROR = 500
"""Statuses of at least this are errors of the service, and are logged as errors."""

STREAMS = frozenset({"/v1/jobs/{id}/events"})
"""Routes whose responses last as long as a client reads them. Their duration in metrics is the time
until the response began, so that objectives of latency do not count them."""

PROBES = frozenset({"/health/live", "/health/ready", "/metrics"})
"""Routes that monitoring requests every few seconds: logged only at the level `debug`."""


def timestamp(seconds: float) -> str:
    """A time, given in seconds since 1970, as RFC 3339 writes it: UTC, with milliseconds."""
    return f"{_format_second(int(seconds))}.{int(seconds % 1 * 1000):03}Z"


@lru_cache(2)
def _format_second(seconds: int) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds))


class AccessLog:
    """Writes the access log in the form, and from the level on, that the settings name."""

    def __init__(self, settings: Settings, write: Write | None) -> None:
        self._write = write if settings.access_log else None
        self._line = json_line if settings.log_format == "json" else text_line
        self._level = settings.log_level

    def add(self, record: RequestRecord, end: float, seconds: float) -> None:
        """Writes the line of a request that ended at `end`, in seconds since 1970."""
        is_logged = (
            record.status >= SERVER_ERROR
            or self._level == "debug"
            or (self._level == "info" and record.label.route not in PROBES)
        )
        if is_logged and self._write is not None:
            self._write(self._line(record, end, seconds))


def text_line(record: RequestRecord, end: float, seconds: float) -> str:
    """The line: when the request ended, then uvicorn's form with bytes and time.

    In brackets follows what else is known: the cache (hit or miss), the name of the key, and for an
    error its code and the request id.
    """
    level = "ERROR:   " if record.status >= SERVER_ERROR else "INFO:    "
    request = f'{record.client} - "{record.method} {record.label.path}" {record.status}'
    key_text, id_text = record.key and f"key {record.key}", record.code and f"id {record.id}"
    details = ", ".join(filter(None, (record.cache, record.code, key_text, id_text)))
    suffix = f" ({details})" if details else ""
    times = f"{record.sent_bytes} bytes, {seconds * 1e3:.1f} ms"
    return f"{timestamp(end)} {level} {request}, {times}{suffix}\n"


def json_line(record: RequestRecord, end: float, seconds: float) -> str:
    """The line as one JSON object; leaves out fields without a value."""
    line: dict[str, Any] = {
        "time": timestamp(end),
        "level": "error" if record.status >= SERVER_ERROR else "info",
        "event": "request",
        "request_id": record.id,
        "trace_id": record.trace_id,
        "span_id": record.span_id,
        "method": record.method,
        "route": record.label.route,
        "status": record.status,
        "bytes": record.sent_bytes,
        "ms": round(seconds * 1e3, 3),
        "client": record.client,
    }
    optional = {
        "surface": record.label.surface,
        "format": record.format,
        "cache": record.cache,
        "code": record.code,
        "key": record.key,
    }
    line |= {name: value for name, value in optional.items() if value}
    return orjson.dumps(line, option=orjson.OPT_APPEND_NEWLINE).decode()


def add_telemetry(app: FastAPI, inner: ASGIApp, write: Write | None) -> "RequestMiddleware":
    """Puts the middleware around `inner`, and sets the state that it and the metrics need.

    `write` writes the access log; if it is None, the service writes none. Only with the setting
    `tracing` does the service make spans and import OpenTelemetry's SDK.

    Raises
    ------
    InvalidSettings
        The setting `tracing` needs the extra `telemetry`, which is not installed.
    """
    state = app.state
    services: Services = state.services
    state.counters = RequestCounters()
    services.threads.on_wait = state.counters.observe_wait
    state.self_test = SelfTest()
    state.connections = ()  # `service.server.run` replaces this by the server's set
    register_state(state.counters.registry, state)
    state.tracing = None
    if services.settings.tracing:
        try:
            module = import_module("service.api.observing.tracing")
        except ModuleNotFoundError as error:
            raise InvalidSettings(
                "SURFACE_TRACING: got 'true', needed the extra `telemetry` to be installed: "
                f"the module {error.name} is missing."
            ) from None
        provider = module.build_exporting_provider()
        tracing: Tracing = module.Tracing(inner, provider, respond_to_failure)
        state.tracing = inner = tracing
    labels = RouteLabels(route.path or "" for route in iter_route_contexts(app.routes))
    return RequestMiddleware(
        inner, labels, state.counters, AccessLog(services.settings, write), services.origins
    )


@dataclass(eq=False, slots=True)
class RequestMiddleware:
    """Sees every request first and every response last, cache hits included."""

    app: ASGIApp
    labels: RouteLabels
    counters: RequestCounters
    log: AccessLog
    origins: Origins

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request."""
        start = begin = time.perf_counter()
        record = start_record(scope, self.labels)
        counters, cors_headers = self.counters, self.origins.headers(scope)

        async def send_recorded(message: Message) -> None:
            nonlocal begin
            if message["type"] == "http.response.start":
                begin = time.perf_counter()
                record.status = message["status"]
                # The cache sends its messages several times: they must not change.
                headers = [*message.get("headers", ()), *cors_headers, (_ID, record.id.encode())]
                message = {**message, "headers": headers}
            elif record.method != "HEAD":  # the server sends only the head
                record.sent_bytes += len(message.get("body", b""))
            await send(message)

        counters.in_flight += 1
        report_times(counters.add_engine_seconds)
        try:
            await self.app(scope, receive, send_recorded)
        except Exception as error:
            await respond_to_failure(error, scope, receive, send_recorded)
        finally:
            counters.in_flight -= 1
            client = scope.get("client")  # the guard may have set it to a proxy's client
            record.client = client[0] if client else "-"
            seconds = time.perf_counter() - start
            counters.count(record, begin - start if record.label.route in STREAMS else seconds)
            self.log.add(record, time.time(), seconds)


async def respond_to_failure(error: Exception, scope: Scope, receive: Receive, send: Send) -> None:
    """Logs an error of the service, and responds with 500 unless a response has begun.

    A response that has begun stays incomplete: the server closes the connection.
    """
    _log.error("a request failed", exc_info=error)
    record = record_of(scope)
    if not record.status:
        record.code = INTERNAL_ERROR.code
        await problem_response(INTERNAL_ERROR)(scope, receive, send)
