"""GET /metrics: counters and gauges of the service, for Prometheus.

`RequestCounters` counts events when they happen; `StateCollector` reads the state of other parts
when Prometheus asks (at each scrape).
"""

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import get_args

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    GCCollector,
    Histogram,
    Info,
    ProcessCollector,
    disable_created_metrics,
    exposition,
)
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    Metric,
    SummaryMetricFamily,
)
from prometheus_client.openmetrics import exposition as openmetrics
from prometheus_client.registry import Collector
from starlette.datastructures import State
from starlette.requests import Request
from starlette.responses import Response

from service import __version__
from service.api.guard.key_file import KnownKeys
from service.api.guard.keys import MAX_KEYS
from service.api.negotiation import refuse_parameters
from service.api.observing.health import is_ready
from service.api.record import RequestRecord
from service.api.responses import HEADERS, ChunkedResponse
from service.api.services import Services
from service.api.threads import Threads
from service.bases.cache import MESH_PLANS
from service.engine.mesh.mesh import ENGINE, MeshReport
from service.jobs.manager import Jobs
from service.storage.store import SurfaceStore
from service.storage.watch import Writes

TEXT, OPENMETRICS = exposition.CONTENT_TYPE_PLAIN_0_0_4, openmetrics.CONTENT_TYPE_LATEST
"""Media types: Prometheus's text format, and OpenMetrics."""

BUCKETS = (
    *(0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5),
    *(1.0, 2.5, 5.0, 10.0, 30.0, 60.0),
)
"""Upper ends of the histogram's buckets, in seconds."""

OTHER_KEYS = "(others)"
"""The label of keys beyond the most that are counted by their names; no key has this name."""

# Otherwise each counter has a second series, `…_created`, which no panel and no alert reads.
disable_created_metrics()  # type: ignore[no-untyped-call]


class RequestCounters:
    """Counters of one application's requests, in a registry of their own.

    `count_dropped_lines` returns the number of log lines that could not be written: 0, until
    `surface serve`, which writes the log, sets another function.
    `sent_bytes` are bytes by format, `refusals` errors by code, `by_key` requests by the name of
    their key: only the event loop changes these numbers, so they need no lock. `by_key` has at most
    `MAX_KEYS` names; while the service runs, an operator may replace its keys by others.
    """

    def __init__(self) -> None:
        registry = self.registry = CollectorRegistry()
        self.count_dropped_lines: Callable[[], int] = lambda: 0
        durations = Histogram(
            "surface_http_request_duration_seconds",
            "Time from the head of a request until its response was handed to the server; for a "
            "stream of events, until it began.",
            ("route", "method", "status"),
            buckets=BUCKETS,
            registry=registry,
        )
        self._durations = cache(durations.labels)
        waits = Histogram(
            "surface_wait_seconds",
            "Waiting time of work for a thread, for memory and for its caller's turn.",
            ("class",),
            buckets=BUCKETS,
            registry=registry,
        )
        self._waits = cache(waits.labels)
        self.in_flight = 0
        gauge = Gauge("surface_http_requests_in_flight", "Running requests.", registry=registry)
        gauge.set_function(lambda: self.in_flight)
        self.sent_bytes: dict[str, int] = {}
        self.refusals: dict[str, int] = {}
        self.by_key: dict[str, int] = {}
        self.vertices = self.triangles = 0
        about = "Computing time, by formulation (`kronecker`, …) or work (`points`, …)."
        seconds = Counter("surface_engine_seconds", about, ("formulation",), registry=registry)
        self._engine_seconds = cache(seconds.labels)

    def count(self, record: RequestRecord, seconds: float) -> None:
        """Counts a request that has ended."""
        status = f"{record.status // 100}xx" if record.status else "none"
        self._durations(record.label.route, record.method, status).observe(seconds)
        if record.format and status == "2xx":
            self.sent_bytes[record.format] = (
                self.sent_bytes.get(record.format, 0) + record.sent_bytes
            )
        if record.code:
            self.count_refusal(record.code)
        if record.key:
            name = record.key
            if name not in self.by_key and len(self.by_key) >= MAX_KEYS:
                name = OTHER_KEYS
            self.by_key[name] = self.by_key.get(name, 0) + 1

    def count_refusal(self, code: str) -> None:
        """Counts an error response; the server calls it for requests that it refuses itself."""
        self.refusals[code] = self.refusals.get(code, 0) + 1

    def count_mesh(self, report: MeshReport | None) -> None:
        """Counts a computed mesh; a file of exact patches has no report and does not count."""
        if report is not None:
            self.vertices += report.vertices
            self.triangles += report.triangles

    def observe_wait(self, kind: str, seconds: float) -> None:
        """Counts work of a kind (`mesh`, `parse`, …) that has got a thread, or waited in vain."""
        self._waits(kind).observe(seconds)

    def add_engine_seconds(self, formulation: str, seconds: float) -> None:
        """Adds computing time; may be called from any thread."""
        self._engine_seconds(formulation).inc(seconds)


def register_state(registry: CollectorRegistry, state: State) -> None:
    """Registers the metrics that are read at each scrape: the application's state, the process."""
    Info("surface_build", "Version of the service and of its numbers.", registry=registry).info(
        {"version": __version__, "engine": str(ENGINE)}
    )
    registry.register(StateCollector(state))
    ProcessCollector(registry=registry)
    GCCollector(registry=registry)


async def metrics(request: Request) -> Response:
    """GET /metrics: all metrics, as of now."""
    refuse_parameters(request.query_params)
    registry: CollectorRegistry = request.app.state.counters.registry
    if accepts_open_metrics(request.headers.get("accept", "")):
        generate_latest: Callable[..., bytes] = openmetrics.generate_latest
        body, media_type = generate_latest(registry, version="1.0.0"), OPENMETRICS
    else:
        body, media_type = exposition.generate_latest(registry), TEXT
    headers = {"Cache-Control": "no-store", "Vary": "Accept", "Content-Type": media_type}
    return ChunkedResponse(body, 200, HEADERS | headers)


def accepts_open_metrics(accept: str) -> bool:
    """Whether a client accepts OpenMetrics; clients that accept it prefer it."""
    types = (part.split(";")[0].strip().lower() for part in accept.split(","))
    return "application/openmetrics-text" in types


class StateCollector(Collector):
    """Reads the state of the application's parts at each scrape."""

    def __init__(self, state: State) -> None:
        self._state = state

    def collect(self) -> list[Metric]:
        """All metric families."""
        services: Services = self._state.services
        responses, requests = services.cache, self._state.counters
        return [
            _gauge(
                "ready", "Whether the service was ready at the last check.", is_ready(self._state)
            ),
            _gauge("connections", "Open connections.", len(self._state.connections)),
            _gauge(
                "connections_limit",
                "Most connections at the same time.",
                services.settings.max_connections,
            ),
            _counter(
                "log_lines_dropped",
                "Log lines that could not be written.",
                requests.count_dropped_lines(),
            ),
            _counter(
                "http_response_bytes", "Bytes of response bodies.", requests.sent_bytes, "format"
            ),
            _counter("refused", "Error responses.", requests.refusals, "code"),
            _counter("vertices", "Vertices of computed meshes.", requests.vertices),
            _counter("triangles", "Triangles of computed meshes.", requests.triangles),
            _counter("cache_hits", "Responses sent from the cache.", responses.hits),
            _counter("cache_misses", "Responses computed for the cache.", responses.misses),
            _counter("cache_evictions", "Responses removed to free memory.", responses.evictions),
            _gauge("cache_bytes", "Memory of cached responses.", responses.bytes),
            _gauge("cache_limit_bytes", "Most memory of cached responses.", responses.max_bytes),
            _gauge("cache_entries", "Number of cached responses.", len(responses)),
            _counter("plan_hits", "Plans and prepared parts found in the cache.", MESH_PLANS.hits),
            _counter(
                "plan_misses",
                "Plans and prepared parts that were not in the cache.",
                MESH_PLANS.misses,
            ),
            _gauge("plan_bytes", "Memory of mesh plans and prepared parts.", MESH_PLANS.nbytes),
            _counter(
                "key_requests", "Requests with a valid key, by its name.", requests.by_key, "key"
            ),
            _gauge(
                "keys_file_valid",
                "Whether the file of keys is valid; otherwise the keys known before stay.",
                _is_keys_file_valid(services.keys),
            ),
            *_collect_threads(services.threads),
            *_collect_store(services.store),
            *(_collect_jobs(services.jobs) if services.jobs is not None else ()),
        ]


def _is_keys_file_valid(keys: KnownKeys | None) -> bool | None:
    """Whether the file of keys is valid now; None without a file."""
    if keys is None:
        return None
    keys()  # reads a changed file again, also if no request has a key
    return keys.is_file_valid


def _collect_threads(threads: Threads) -> list[Metric]:
    counts = {"work": threads.count, "parsing": 1}
    busy_counts = {"work": threads.busy_count, "parsing": threads.parsing.locked()}
    used_bytes = {"work": threads.used_bytes - threads.body_bytes, "bodies": threads.body_bytes}
    limits = {"work": threads.capacity - threads.max_body, "bodies": threads.max_body}
    waiting, waited = {"work": threads.queue_length}, {"work": threads.seconds_waited}
    return [
        _gauge("queue_length", "Requests that wait for a thread or for memory.", waiting, "lane"),
        _gauge("threads_busy", "Threads that compute.", busy_counts, "lane"),
        _gauge("threads", "Threads that may compute at the same time.", counts, "lane"),
        _counter("queue_wait_seconds", "Waiting time of all requests together.", waited, "lane"),
        _gauge("memory_bytes", "Predicted memory of running requests.", used_bytes, "pool"),
        _gauge("memory_limit_bytes", "Most memory that requests may hold.", limits, "pool"),
    ]


def _collect_store(store: SurfaceStore) -> list[Metric]:
    operations = SummaryMetricFamily(
        "surface_store_operation_seconds",
        "Time of store operations, by their outcome.",
        labels=("operation", "outcome"),
    )
    for labels, total in store.operations.totals.items():
        operations.add_metric(labels, total.count, total.seconds)
    usage = store.usage
    return [
        _gauge(
            "store_answering",
            "Whether the store answered the last check.",
            store.is_answering,
        ),
        _gauge(
            "store_writes",
            "1 for the state of writes to the store, 0 for the others.",
            {state: state == store.writes for state in get_args(Writes)},
            "state",
        ),
        operations,
        _gauge("store_bytes", "Bytes of stored surfaces at the last count.", usage.used),
        _gauge("store_quota_bytes", "Most bytes of stored surfaces; 0: no limit.", usage.quota),
    ]


def _collect_jobs(jobs: Jobs) -> list[Metric]:
    states = {"queued": 0, "running": 0}
    parts = {"queued": 0, "running": 0}
    for job in jobs.open_jobs:
        state = job.state()
        states["running" if job.running else "queued"] += 1
        parts["queued"] += state.queued
        parts["running"] += state.running
    dispatcher, usage = jobs.dispatcher, jobs.usage
    return [
        _gauge("jobs", "Jobs of this process that have not ended.", states, "state"),
        _gauge("job_parts_open", "Parts of these jobs that have not ended.", parts, "state"),
        _counter("job_parts", "Parts of jobs that have ended.", dispatcher.parts, "outcome"),
        _counter("job_seconds", "Time of batches in job processes.", dispatcher.seconds),
        _gauge("job_batches_running", "Batches that run.", dispatcher.busy_count),
        _gauge(
            "job_waiting",
            "1 if no batch can run, with the reason.",
            {dispatcher.waiting_for: 1} if dispatcher.waiting_for else {},
            "reason",
        ),
        _gauge("job_bytes", "Bytes of jobs and their results at the last count.", usage.used),
        _gauge("job_quota_bytes", "Most bytes of jobs and results; 0: no limit.", usage.quota),
    ]


def _family(
    kind: type[GaugeMetricFamily | CounterMetricFamily],
    name: str,
    about: str,
    values: Mapping[str, float] | float | None,
    label: str = "",
) -> Metric:
    """A metric family: one number, a number for each value of a label, or no number (None)."""
    if not isinstance(values, Mapping):
        return kind(f"surface_{name}", about, values)
    family = kind(f"surface_{name}", about, labels=(label,))
    for value, number in values.items():
        family.add_metric((value,), number)
    return family


_gauge, _counter = partial(_family, GaugeMetricFamily), partial(_family, CounterMetricFamily)
