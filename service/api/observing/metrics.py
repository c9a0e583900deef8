"""GET /metrics: what is counted, as Prometheus reads it.

References
----------
Prometheus, Exposition formats; OpenMetrics 1.0.
"""

from collections.abc import Callable, Iterator
from typing import TypeAlias

from prometheus_client import CollectorRegistry, GCCollector, ProcessCollector, exposition
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
    Metric,
    SummaryMetricFamily,
)
from prometheus_client.openmetrics import exposition as openmetrics
from prometheus_client.registry import Collector
from starlette.datastructures import State
from starlette.requests import Request
from starlette.responses import Response

from service import __version__
from service.api.admission.admission import Admission
from service.api.answers import HEADERS, ChunkedResponse
from service.api.caching.answers import AnswerCache
from service.api.observing.health import is_ready
from service.api.observing.observed import Histogram, Observed
from service.api.parameters import no_parameters
from service.engine.mesh import ENGINE
from service.storage.store import SurfaceStore

TEXT, OPEN = exposition.CONTENT_TYPE_PLAIN_0_0_4, openmetrics.CONTENT_TYPE_LATEST
"""What is written for everybody, and what for those who ask for OpenMetrics."""

Values: TypeAlias = dict[str, float]


def registry_of(state: State) -> CollectorRegistry:
    """What is known of one application and its process; another application has another."""
    registry = CollectorRegistry()
    registry.register(Counts(state))
    ProcessCollector(registry=registry)
    GCCollector(registry=registry)
    return registry


async def metrics(request: Request) -> Response:
    """The numbers of this moment."""
    no_parameters(request.query_params)
    registry: CollectorRegistry = request.app.state.registry
    if wants_open(request.headers.get("accept", "")):
        generate_latest: Callable[..., bytes] = openmetrics.generate_latest
        return _answer(generate_latest(registry, version="1.0.0"), OPEN)
    return _answer(exposition.generate_latest(registry), TEXT)


def wants_open(accept: str) -> bool:
    """Whether a client takes OpenMetrics; those who do all prefer it."""
    return any(
        part.split(";")[0].strip().lower() == "application/openmetrics-text"
        for part in accept.split(",")
    )


def _answer(body: bytes, media_type: str) -> Response:
    headers = {**HEADERS, "Cache-Control": "no-store", "Vary": "Accept"}
    headers["Content-Type"] = media_type
    return ChunkedResponse(body, 200, headers)


class Counts(Collector):
    """The numbers of an application, read when they are asked for."""

    def __init__(self, state: State) -> None:
        self._state = state

    def describe(self) -> list[Metric]:
        """Nothing beforehand: names are unique, and a test sees to it."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Every family of them."""
        yield InfoMetricFamily(
            "surface_build",
            "Version of the service, and of its numbers.",
            {"version": __version__, "engine": str(ENGINE)},
        )
        yield GaugeMetricFamily(
            "surface_ready",
            "Whether new requests are welcome, as was last found.",
            float(is_ready(self._state)),
        )
        yield from self._requests(self._state.observed)
        yield from self._cache(self._state.answers)
        yield from _admission(self._state.admission)
        yield from _store(self._state.store)

    def _requests(self, observed: Observed) -> Iterator[Metric]:
        took = HistogramMetricFamily(
            "surface_http_request_duration_seconds",
            "From the head of a request until its answer was handed to the server.",
            labels=("route", "method", "status"),
        )
        for (route, method, status), histogram in observed.requests.items():
            shown = f"{status}xx" if status else "none"
            _add(took, (route, method, shown), histogram)
        yield took
        yield GaugeMetricFamily(
            "surface_http_requests_in_flight", "Requests under way.", observed.in_flight
        )
        yield counter(
            "surface_http_response_bytes",
            "Bytes of bodies of answers.",
            "format",
            dict(observed.bytes),
        )
        yield counter(
            "surface_refused", "Problems that were answered.", "code", dict(observed.refusals)
        )
        yield CounterMetricFamily(
            "surface_vertices", "Vertices of meshes that were made.", observed.vertices
        )
        yield CounterMetricFamily(
            "surface_triangles", "Triangles of meshes that were made.", observed.triangles
        )
        yield counter(
            "surface_engine_seconds",
            "Computing, by the way it is done; encoding is no part of it.",
            "formulation",
            observed.engine.so_far(),
        )
        yield GaugeMetricFamily(
            "surface_connections", "Connections that are open.", len(self._state.connections)
        )
        yield GaugeMetricFamily(
            "surface_connections_limit",
            "Connections that may be open.",
            self._state.settings.max_connections,
        )
        yield CounterMetricFamily(
            "surface_log_lines_dropped",
            "Lines of the log that could not be written.",
            observed.dropped(),
        )

    def _cache(self, answers: AnswerCache) -> Iterator[Metric]:
        counts = answers.counts
        yield CounterMetricFamily("surface_cache_hits", "Answers sent again.", counts.hits)
        yield CounterMetricFamily("surface_cache_misses", "Answers made anew.", counts.misses)
        yield CounterMetricFamily(
            "surface_cache_evictions", "Answers forgotten to make room.", counts.evictions
        )
        yield GaugeMetricFamily("surface_cache_bytes", "Memory of kept answers.", answers.bytes)
        yield GaugeMetricFamily(
            "surface_cache_limit_bytes", "Memory that kept answers may take.", answers.max_bytes
        )
        yield GaugeMetricFamily("surface_cache_entries", "Kept answers.", len(answers))


def _admission(admission: Admission) -> Iterator[Metric]:
    lanes = {"large": admission.large, "small": admission.small}
    waiting = GaugeMetricFamily(
        "surface_queue_length", "Requests that wait for a thread or for memory.", labels=("lane",)
    )
    computing = GaugeMetricFamily(
        "surface_threads_busy", "Threads that compute, or are about to.", labels=("lane",)
    )
    threads = GaugeMetricFamily("surface_threads", "Threads that may compute.", labels=("lane",))
    waited = CounterMetricFamily(
        "surface_queue_wait_seconds", "What all requests together have waited.", labels=("lane",)
    )
    for name, lane in lanes.items():
        waiting.add_metric((name,), lane.waiting)
        computing.add_metric((name,), lane.threads.used)
        threads.add_metric((name,), lane.threads.capacity)
        waited.add_metric((name,), lane.threads.seconds + lane.memory.seconds)
    parsing = admission.parsing
    waiting.add_metric(("parsing",), parsing.waiting)
    computing.add_metric(("parsing",), parsing.used)
    threads.add_metric(("parsing",), parsing.capacity)
    waited.add_metric(("parsing",), parsing.seconds)
    yield from (waiting, computing, threads, waited)
    used = GaugeMetricFamily(
        "surface_memory_bytes", "Memory that is lent, by prediction.", labels=("pool",)
    )
    limit = GaugeMetricFamily(
        "surface_memory_limit_bytes", "Memory that may be lent.", labels=("pool",)
    )
    pools = {name: lane.memory for name, lane in lanes.items()} | {"arriving": admission.arriving}
    for name, pool in pools.items():
        used.add_metric((name,), pool.used)
        limit.add_metric((name,), pool.capacity)
    yield from (used, limit)


def _store(store: SurfaceStore) -> Iterator[Metric]:
    yield GaugeMetricFamily(
        "surface_store_answering",
        "Whether the store answered when it was last asked.",
        float(not store.failing),
    )
    took = SummaryMetricFamily(
        "surface_store_operation_seconds",
        "What the store was asked to do, by the end it came to.",
        labels=("operation", "outcome"),
    )
    for labels, done in store.operations.so_far.items():
        took.add_metric(labels, done.count, done.seconds)
    yield took
    used = GaugeMetricFamily("surface_store_bytes", "Bytes of stored surfaces, as last counted.")
    if store.used is not None:
        used.add_metric((), store.used)
    yield used
    yield GaugeMetricFamily(
        "surface_store_quota_bytes", "Bytes that they may take; 0 is no limit.", store.quota
    )


def counter(name: str, about: str, label: str, values: Values) -> Metric:
    """A counter with one label."""
    family = CounterMetricFamily(name, about, labels=(label,))
    for value, number in values.items():
        family.add_metric((value,), number)
    return family


def _add(family: HistogramMetricFamily, labels: tuple[str, ...], histogram: Histogram) -> None:
    family.add_metric(labels, histogram.buckets(), histogram.total)
