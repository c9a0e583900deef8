"""Spans of requests for OpenTelemetry, where the operator wants them: the extra `telemetry`.

This is the one module that knows OpenTelemetry, and it is imported only where `tracing` is set. Who
gets the spans, and how, its own variables `OTEL_…` say: that is the one request that the service
makes to somebody else, and no client has a say in it.

References
----------
OpenTelemetry, Semantic conventions for HTTP spans, stable since 1.23.
"""

import asyncio
import time
from threading import Thread
from typing import Any

from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import SERVICE_NAME, SERVICE_VERSION, Resource
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor
from opentelemetry.trace import (
    NonRecordingSpan,
    Span,
    SpanContext,
    SpanKind,
    Status,
    StatusCode,
    TraceFlags,
    TraceState,
    set_span_in_context,
)
from starlette.types import Scope

from service import __version__
from service.api.observing.exchange import Exchange
from service.api.observing.lines import FAILED
from service.api.observing.places import UNMATCHED
from service.api.observing.traces import Parent

FAREWELL = 3.0
"""Seconds that the last spans have when the service ends."""


def exporting() -> "Tracing":
    """Spans to where the variables `OTEL_…` say, with OTLP over HTTP; by default this machine."""
    named = Resource.create({SERVICE_VERSION: __version__})
    if str(named.attributes.get(SERVICE_NAME, "")).startswith("unknown_service"):
        named = named.merge(Resource({SERVICE_NAME: "surface-service"}))
    provider = TracerProvider(resource=named, shutdown_on_exit=False)
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    return Tracing(provider)


class Tracing:
    """One span for each request, and one for each step of its work.

    Parameters
    ----------
    provider : TracerProvider
        What makes them, and hands them on; it is nobody else's.
    """

    def __init__(self, provider: TracerProvider) -> None:
        self._provider = provider
        self._tracer = provider.get_tracer("service", __version__)

    def begin(self, scope: Scope, exchange: Exchange, parent: Parent | None) -> Span:
        """The span of a request, below its caller's; the exchange gets its ids."""
        context = None
        if parent is not None:
            flags, state = TraceFlags(parent.flags), _state(scope)
            trace_id, span_id = int(parent.trace_id, 16), int(parent.span_id, 16)
            caller = SpanContext(
                trace_id, span_id, is_remote=True, trace_flags=flags, trace_state=state
            )
            context = set_span_in_context(NonRecordingSpan(caller))
        # What a sampler may want to know has to be there from the beginning.
        method, place = exchange.method, exchange.place
        about: dict[str, Any] = {
            "http.request.method": "_OTHER" if method == "other" else method,
            "url.path": place.shown,
            "url.scheme": scope.get("scheme", "http"),
            "network.protocol.version": scope.get("http_version", "1.1"),
        }
        name = "HTTP" if method == "other" else method
        if place.route != UNMATCHED:
            about["http.route"] = place.route
            name = f"{name} {place.route}"
        span = self._tracer.start_span(name, context, SpanKind.SERVER, about)
        made = span.get_span_context()
        named = f"{made.trace_id:032x}"
        if exchange.id == exchange.trace_id:  # the client has none of its own
            exchange.id = named
        exchange.trace_id, exchange.span_id = named, f"{made.span_id:016x}"
        return span

    def end(self, span: Span, exchange: Exchange) -> None:
        """The request is over."""
        if span.is_recording():
            self._add_steps(span, exchange)
            span.set_attribute("client.address", exchange.client)
            if exchange.status:
                span.set_attribute("http.response.status_code", exchange.status)
            span.set_attribute("http.response.body.size", exchange.sent)
            more = {"format": exchange.format, "cache": exchange.cache, "code": exchange.code}
            for name, value in more.items():
                if value:
                    span.set_attribute(f"surface.{name}", value)
            # What a client did wrong is no error of the server's span.
            if exchange.status >= FAILED or not exchange.status:
                span.set_attribute("error.type", str(exchange.status or "no answer"))
                span.set_status(Status(StatusCode.ERROR))
        span.end()

    def _add_steps(self, span: Span, exchange: Exchange) -> None:
        """The steps of its work, each a span: they were timed by another clock."""
        context = set_span_in_context(span)
        zero = time.time_ns() - time.perf_counter_ns()
        for name, start, seconds in exchange.steps:
            at = zero + int(start * 1e9)
            step = self._tracer.start_span(name, context, start_time=at)
            step.end(at + int(seconds * 1e9))

    async def close(self) -> None:
        """Hands on what is left; gives up where nobody takes it."""
        # Not one of the pool's threads: the process would wait for it.
        thread = Thread(target=self._provider.shutdown, name="last spans", daemon=True)
        thread.start()
        end = time.monotonic() + FAREWELL
        while thread.is_alive() and time.monotonic() < end:
            await asyncio.sleep(0.01)


def _state(scope: Scope) -> TraceState:
    """What `tracestate` says; nothing where that makes no sense."""
    lines = [value.decode("latin-1") for name, value in scope["headers"] if name == b"tracestate"]
    return TraceState.from_header(lines)
