"""Tracing: each request is a span, a child of the caller's span, with a child for each step."""

import asyncio
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler
from itertools import pairwise

import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.sdk.trace import ReadableSpan, SpanProcessor, TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import SpanKind, StatusCode

from service.api.app import create_app
from service.api.observing import tracing as tracing_module
from service.api.observing.middleware import RequestMiddleware, respond_to_failure
from service.api.observing.tracing import Tracing, build_exporting_provider
from service.errors import InvalidSettings
from service.settings.values import Settings
from tests.api.observing.test_middleware import PARENT, SPAN, TRACE, send_request
from tools.client import Client, start_client
from tools.live import serve

MESH = "/v1/surfaces/saddle/mesh.glb"
NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]


@pytest.fixture
def spans() -> InMemorySpanExporter:
    return InMemorySpanExporter()


@pytest.fixture
def client(spans: InMemorySpanExporter) -> Iterator[Client]:
    """A client of an application that exports its spans to `spans`."""
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(spans))
    app = create_app(Settings())
    assert isinstance(app.outermost, RequestMiddleware)
    app.outermost.app = Tracing(app.outermost.app, provider, respond_to_failure)
    with start_client(app) as client:
        yield client


def find_server_span(spans: InMemorySpanExporter) -> ReadableSpan:
    """The span of the only request."""
    (server_span,) = [span for span in spans.get_finished_spans() if span.kind is SpanKind.SERVER]
    return server_span


def test_a_request_has_a_span_with_its_attributes(
    client: Client, spans: InMemorySpanExporter
) -> None:
    response = client.get_raw(f"{MESH}?resolution=2")
    span = find_server_span(spans)
    assert span.name == "GET /v1/surfaces/{id}/mesh.{suffix}"
    assert span.parent is None
    assert dict(span.attributes or {}) == {
        "http.request.method": "GET",
        "http.route": "/v1/surfaces/{id}/mesh.{suffix}",
        "url.path": MESH,
        "url.scheme": "http",
        "network.protocol.version": "1.1",
        "client.address": "127.0.0.1",
        # The library writes host and port, and the test client has no port.
        "server.address": "service:None",
        "http.response.status_code": 200,
        "http.response.body.size": len(response.content),
        "surface.format": "glb",
        "surface.cache": "miss",
    }
    assert span.status.status_code is StatusCode.UNSET


def test_the_request_id_of_the_response_is_the_trace_id(spans: InMemorySpanExporter) -> None:
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(spans))
    (start, *_), _, _ = send_request(
        [], tracing=lambda app: Tracing(app, provider, respond_to_failure)
    )
    context = find_server_span(spans).context
    assert context is not None
    assert dict(start["headers"])[b"x-request-id"].decode() == f"{context.trace_id:032x}"


def test_steps_of_a_request_are_children_of_its_span(
    client: Client, spans: InMemorySpanExporter
) -> None:
    response = client.post("/v1/mesh", {"surface": {"control_net": NET}})
    span = find_server_span(spans)
    steps = [each for each in spans.get_finished_spans() if each is not span]
    names = [part.split(";")[0] for part in response.headers["server-timing"].split(", ")]
    assert {"read", "parse", "mesh"} <= set(names) == {step.name for step in steps}
    for step in steps:
        assert step.parent == span.context
        times = [span.start_time, step.start_time, step.end_time, span.end_time]
        known_times = [time for time in times if time]
        assert len(known_times) == 4
        # The library reads two clocks one after the other, so times (in ns) may differ a little.
        assert all(later >= earlier - 10**6 for earlier, later in pairwise(known_times))


def test_the_parent_of_a_span_is_the_span_of_the_caller(
    client: Client, spans: InMemorySpanExporter
) -> None:
    headers = {"traceparent": PARENT, "tracestate": "a=1,b=2"}
    client.get("/health", headers=headers)
    span = find_server_span(spans)
    assert span.parent is not None
    assert span.context is not None
    assert f"{span.context.trace_id:032x}" == TRACE
    assert f"{span.parent.span_id:016x}" == SPAN
    assert span.parent.is_remote
    assert dict(span.context.trace_state) == {"a": "1", "b": "2"}


def test_the_span_of_a_refusal_is_no_error_and_repeats_no_text(
    client: Client, spans: InMemorySpanExporter
) -> None:
    client.get("/v1/surfaces/hush/mesh.glb", headers={"Authorization": "hush"})
    span = find_server_span(spans)
    assert span.status.status_code is StatusCode.UNSET
    assert span.attributes is not None
    assert span.attributes["surface.code"] == "unknown_surface"
    assert "hush" not in span.to_json()


def test_the_span_of_an_internal_error_is_an_error(
    client: Client, spans: InMemorySpanExporter, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raise_error(*_: object) -> None:
        raise ZeroDivisionError("hush")

    monkeypatch.setattr("service.api.routes.operations.formats", raise_error)
    assert client.get("/v1/formats").status_code == 500
    span = find_server_span(spans)
    assert span.status.status_code is StatusCode.ERROR
    assert span.attributes is not None
    assert span.attributes["error.type"] == "500"
    assert "hush" not in span.to_json()


@pytest.mark.parametrize("starts_response", [False, True])
def test_spans_do_not_contain_the_text_of_an_exception(
    spans: InMemorySpanExporter, starts_response: bool
) -> None:
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(spans))
    error = ZeroDivisionError("hush")
    send_request(
        [],
        error=error,
        starts_response=starts_response,
        tracing=lambda app: Tracing(app, provider, respond_to_failure),
    )
    span = find_server_span(spans)
    assert span.attributes is not None
    assert span.attributes["http.response.status_code"] == (204 if starts_response else 500)
    # The address that the application of `send_request` records.
    assert span.attributes["client.address"] == "2001:db8::1"
    assert "hush" not in span.to_json()


@contextmanager
def run_collector() -> Iterator[tuple[str, list[bytes]]]:
    """The URL of a server that receives spans, and the bodies that it received."""
    bodies: list[bytes] = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            bodies.append(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(200)
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Writes no log to the terminal."""

    with serve(Handler) as url:
        yield url, bodies


def test_spans_are_sent_to_the_configured_address(monkeypatch: pytest.MonkeyPatch) -> None:
    with run_collector() as (url, bodies):
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", url)
        app = create_app(Settings(tracing=True))
        with start_client(app) as client:
            client.get("/health")
        asyncio.run(app.state.tracing.close())
    request = ExportTraceServiceRequest.FromString(bodies[0])
    (resource_spans,) = request.resource_spans
    attributes = {pair.key: pair.value.string_value for pair in resource_spans.resource.attributes}
    assert attributes["service.name"] == "surface-service"
    assert [span.name for span in resource_spans.scope_spans[0].spans] == ["GET /health"]


class BlockingProcessor(SpanProcessor):
    """A processor whose shutdown blocks until `may_end` is set, as if the collector were silent."""

    def __init__(self) -> None:
        self.may_end = threading.Event()

    def shutdown(self) -> None:
        self.may_end.wait()


def test_a_collector_that_does_not_respond_does_not_delay_the_shutdown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tracing_module, "SHUTDOWN_TIMEOUT", 0.05)
    # A real exporter would try again during later tests, in a thread that draws numbers from
    # `random`, which Hypothesis seeds for each example.
    processor, provider = BlockingProcessor(), TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(processor)
    try:
        asyncio.run(
            asyncio.wait_for(
                Tracing(create_app(Settings()), provider, respond_to_failure).close(), 5
            )
        )
        (thread,) = [each for each in threading.enumerate() if each.name == "last spans"]
        assert thread.daemon
    finally:
        processor.may_end.set()
    thread.join(5)
    assert not thread.is_alive()


def test_the_name_of_the_service_can_be_configured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OTEL_SERVICE_NAME", "another name")
    provider = build_exporting_provider()
    assert provider.resource.attributes["service.name"] == "another name"
    provider.shutdown()


def test_tracing_without_its_packages_is_refused_at_the_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "service.api.observing.tracing")
    # The import of a module that is None here fails, as if it were not installed.
    monkeypatch.setitem(sys.modules, "opentelemetry.sdk.trace", None)
    with pytest.raises(InvalidSettings, match="extra `telemetry`"):
        create_app(Settings(tracing=True))


def test_without_tracing_its_module_is_not_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    """So OpenTelemetry's SDK is not imported: import-linter checks that no other module does it."""
    name = "service.api.observing.tracing"
    monkeypatch.delitem(sys.modules, name)
    assert create_app(Settings()).state.tracing is None
    assert name not in sys.modules
