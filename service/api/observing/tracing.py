"""Spans of requests, made by OpenTelemetry's ASGI middleware: the extra `telemetry`.

OpenTelemetry's own variables `OTEL_…` say where the service sends spans, and how many of them. Only
for this, and for a store in a bucket, does the service make requests to other hosts; clients have
no influence on them.
"""

import asyncio
import os
import time
from collections.abc import Awaitable, Callable
from threading import Thread

from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.instrumentation.asgi import OpenTelemetryMiddleware
from opentelemetry.sdk.resources import (
    SERVICE_NAME,
    SERVICE_VERSION,
    OTELResourceDetector,
    Resource,
)
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor
from opentelemetry.trace import (
    Span,
    format_span_id,
    format_trace_id,
    get_current_span,
    set_span_in_context,
)
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import __version__
from service.api.record import UNMATCHED, RequestRecord, record_of

SHUTDOWN_TIMEOUT = 3.0
"""Seconds in which the last spans are sent when the service stops."""

_HEADERS = frozenset({b"traceparent", b"tracestate"})


def build_exporting_provider() -> TracerProvider:
    """A provider that sends spans with OTLP over HTTP, as the variables `OTEL_…` say."""
    service = Resource({SERVICE_NAME: "surface-service", SERVICE_VERSION: __version__})
    # The variables again: a name or version in them replaces that of `service`.
    resource = Resource.create().merge(service).merge(OTELResourceDetector().detect())
    provider = TracerProvider(resource=resource, shutdown_on_exit=False)
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    return provider


class Tracing:
    """Middleware behind `RequestMiddleware`: a span for each request, child spans for its steps.

    The library gets a scope in which the path is the record's label, the query is missing, and only
    the headers of Trace Context are left: no other text of a client gets into a span.

    Parameters
    ----------
    respond_to_failure : callable
        Responds to an exception of `app`, inside the span.
    """

    def __init__(
        self,
        app: ASGIApp,
        provider: TracerProvider,
        respond_to_failure: Callable[[Exception, Scope, Receive, Send], Awaitable[None]],
    ) -> None:
        # Otherwise attributes have the names of OpenTelemetry's semantic conventions before 1.23.
        os.environ.setdefault("OTEL_SEMCONV_STABILITY_OPT_IN", "http")
        self.app = app
        self._provider = provider
        self._respond_to_failure = respond_to_failure
        self._tracer = provider.get_tracer("service", __version__)
        self._middleware = OpenTelemetryMiddleware(
            self._call_app,
            default_span_details=_name_span,
            tracer_provider=provider,
            exclude_spans=["receive", "send"],
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one request."""
        record = record_of(scope)

        async def send_described(message: Message) -> None:
            await send(message)
            if message["type"] == "http.response.body" and not message.get("more_body"):
                _describe(get_current_span(), scope)  # before the library ends the span

        visible_scope = {name: scope[name] for name in ("type", "scheme", "http_version", "server")}
        visible_scope["method"] = "_OTHER" if record.method == "other" else record.method
        visible_scope["path"] = record.label.path
        visible_scope["headers"] = [pair for pair in scope["headers"] if pair[0] in _HEADERS]
        await self._middleware({**visible_scope, "scope": scope}, receive, send_described)

    async def _call_app(self, visible_scope: Scope, receive: Receive, send: Send) -> None:
        """Calls the application inside the span, and keeps texts of exceptions out of the span."""
        span, scope = get_current_span(), visible_scope["scope"]
        record, context = record_of(scope), span.get_span_context()
        trace_id = format_trace_id(context.trace_id)
        if record.id == record.trace_id:  # the client sent no id
            record.id = trace_id
        record.trace_id, record.span_id = trace_id, format_span_id(context.span_id)
        try:
            await self.app(scope, receive, send)
        except Exception as error:
            await self._respond_to_failure(error, scope, receive, send)
        if span.is_recording():  # the response is not complete
            _describe(span, scope)
        self._add_steps(span, record)

    def _add_steps(self, request_span: Span, record: RequestRecord) -> None:
        """Adds the steps as child spans; converts their times to the clock of spans."""
        parent = set_span_in_context(request_span)
        clock_offset = time.time_ns() - time.perf_counter_ns()
        for name, start, seconds in record.steps:
            start_ns = clock_offset + int(start * 1e9)
            span = self._tracer.start_span(name, parent, start_time=start_ns)
            span.end(start_ns + int(seconds * 1e9))

    async def close(self) -> None:
        """Sends the last spans, and waits at most 3 s for the collector."""
        # Not a thread of the pool: at its end the process would wait for that thread.
        thread = Thread(target=self._provider.shutdown, name="last spans", daemon=True)
        thread.start()
        end = time.monotonic() + SHUTDOWN_TIMEOUT
        while thread.is_alive() and time.monotonic() < end:
            await asyncio.sleep(0.01)


def _name_span(visible_scope: Scope) -> tuple[str, dict[str, str]]:
    """The name of a span, and the attribute of its route."""
    record = record_of(visible_scope["scope"])
    method = "HTTP" if record.method == "other" else record.method
    if record.label.route == UNMATCHED:
        return method, {}
    return f"{method} {record.label.route}", {"http.route": record.label.route}


def _describe(span: Span, scope: Scope) -> None:
    """Sets the attributes that are known when the response ends."""
    record, client = record_of(scope), scope.get("client")
    attributes = {
        "client.address": client[0] if client else "",
        "surface.format": record.format,
        "surface.cache": record.cache,
        "surface.code": record.code,
    }
    span.set_attributes({name: value for name, value in attributes.items() if value})
    span.set_attribute("http.response.body.size", record.sent_bytes)
