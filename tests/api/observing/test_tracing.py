"""Spans: one for each request, children for its steps; its parent is the caller's span."""

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
from service.api.observing.middleware import RequestMiddleware
from service.api.observing.tracing import Tracing, build_exporting_provider
from service.errors import InvalidSettings
from service.settings.values import Settings
from tests.api.client import Client, start_client
from tests.api.observing.test_middleware import PARENT, SPAN, TRACE, send_request
from tests.live import serve

MESH = "/v1/surfaces/saddle/mesh.glb"
NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]


@pytest.fixture
def spans() -> InMemorySpanExporter:
    return InMemorySpanExporter()


@pytest.fixture
def traced(spans: InMemorySpanExporter) -> Iterator[Client]:
    """A client of an application whose spans are kept."""
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(spans))
    app = create_app(Settings())
    assert isinstance(app.front, RequestMiddleware)
    app.front.app = Tracing(app.front.app, provider)
    with start_client(app) as client:
        yield client


def find_server_span(spans: InMemorySpanExporter) -> ReadableSpan:
    (result,) = [span for span in spans.get_finished_spans() if span.kind is SpanKind.SERVER]
    return result


def test_a_request_is_a_span(traced: Client, spans: InMemorySpanExporter) -> None:
    response = traced.raw(f"{MESH}?resolution=2")
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
        "server.address": "service:None",  # the library writes the port with it
        "http.response.status_code": 200,
        "http.response.body.size": len(response.content),
        "surface.format": "glb",
        "surface.cache": "miss",
    }
    assert span.status.status_code is StatusCode.UNSET


def test_the_logged_id_is_that_of_the_response(spans: InMemorySpanExporter) -> None:
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(spans))
    (start, *_), _, _ = send_request([], tracing=lambda app: Tracing(app, provider))
    context = find_server_span(spans).context
    assert context is not None
    assert dict(start["headers"])[b"x-request-id"].decode() == f"{context.trace_id:032x}"


def test_its_steps_are_children(traced: Client, spans: InMemorySpanExporter) -> None:
    response = traced.post("/v1/mesh", {"surface": {"control_net": NET}})
    span = find_server_span(spans)
    steps = [each for each in spans.get_finished_spans() if each is not span]
    shown = [part.split(";")[0] for part in response.headers["server-timing"].split(", ")]
    assert {"read", "parse", "mesh"} <= set(shown) == {step.name for step in steps}
    for step in steps:
        assert step.parent == span.context
        times = [span.start_time, step.start_time, step.end_time, span.end_time]
        times_known = [at for at in times if at]
        # The two clocks are read one after the other, so they may differ a little.
        assert len(times_known) == 4
        assert all(b >= a - 10**6 for a, b in pairwise(times_known))


def test_its_parent_is_the_caller(traced: Client, spans: InMemorySpanExporter) -> None:
    headers = {"traceparent": PARENT, "tracestate": "a=1,b=2"}
    traced.get("/health", headers=headers)
    span = find_server_span(spans)
    assert span.parent is not None
    assert span.context is not None
    assert f"{span.context.trace_id:032x}" == TRACE
    assert f"{span.parent.span_id:016x}" == SPAN
    assert span.parent.is_remote
    assert dict(span.context.trace_state) == {"a": "1", "b": "2"}


def test_a_refusal_is_not_logged_as_an_error_and_repeats_nothing(
    traced: Client, spans: InMemorySpanExporter
) -> None:
    traced.get("/v1/surfaces/hush/mesh.glb", headers={"Authorization": "hush"})
    span = find_server_span(spans)
    assert span.status.status_code is StatusCode.UNSET
    assert span.attributes is not None
    assert span.attributes["surface.code"] == "unknown_surface"
    assert "hush" not in span.to_json()


def test_our_fault_is_an_error(
    traced: Client, spans: InMemorySpanExporter, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError("hush")

    monkeypatch.setattr("service.api.routes.operations.formats", fails)
    assert traced.get("/v1/formats").status_code == 500
    span = find_server_span(spans)
    assert span.status.status_code is StatusCode.ERROR
    assert span.attributes is not None
    assert span.attributes["error.type"] == "500"
    assert "hush" not in span.to_json()


@pytest.mark.parametrize("begins", [False, True])
def test_the_text_of_an_exception_stays_in_the_log(
    spans: InMemorySpanExporter, begins: bool
) -> None:
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(spans))
    error = ZeroDivisionError("hush")
    send_request([], fails=error, begins=begins, tracing=lambda app: Tracing(app, provider))
    span = find_server_span(spans)
    assert span.attributes is not None
    assert span.attributes["http.response.status_code"] == (204 if begins else 500)
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
            """Writes no log line."""

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
    (sent,) = request.resource_spans
    about = {pair.key: pair.value.string_value for pair in sent.resource.attributes}
    assert about["service.name"] == "surface-service"
    assert [span.name for span in sent.scope_spans[0].spans] == ["GET /health"]


class Stuck(SpanProcessor):
    """A processor that blocks, as with a collector that does not respond, until the test ends
    it."""

    def __init__(self) -> None:
        self.released = threading.Event()

    def shutdown(self) -> None:
        self.released.wait()


def test_without_a_collector_the_end_is_not_delayed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tracing_module, "SHUTDOWN_TIMEOUT", 0.05)
    # The exporter itself is not used: its thread would keep retrying, and drawing random numbers,
    # during other tests.
    stuck, provider = Stuck(), TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(stuck)
    try:
        asyncio.run(asyncio.wait_for(Tracing(create_app(Settings()), provider).close(), 5))
        (waiting,) = [t for t in threading.enumerate() if t.name == "last spans"]
        assert waiting.daemon
    finally:
        stuck.released.set()
    waiting.join(5)
    assert not waiting.is_alive()


def test_the_operator_names_the_service(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OTEL_SERVICE_NAME", "ours")
    provider = build_exporting_provider()
    assert provider.resource.attributes["service.name"] == "ours"
    provider.shutdown()


def test_without_the_extra_the_start_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "service.api.observing.tracing")
    monkeypatch.setitem(sys.modules, "opentelemetry.sdk.trace", None)
    with pytest.raises(InvalidSettings, match="extra `telemetry`"):
        create_app(Settings(tracing=True))


def test_without_tracing_its_modules_are_not_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only that module imports OpenTelemetry, as import-linter checks."""
    name = "service.api.observing.tracing"
    monkeypatch.delitem(sys.modules, name)
    assert create_app(Settings()).state.tracing is None
    assert name not in sys.modules
