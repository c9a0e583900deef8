"""GET /metrics: its numbers, both text formats, and the limited number of time series."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from prometheus_client import Metric
from prometheus_client.openmetrics import parser as openmetrics_parser
from prometheus_client.parser import text_string_to_metric_families as families

from service.api.app import create_app
from service.api.guard.keys import format_entry, make_key
from service.api.observing import metrics as service_metrics
from service.settings.values import Settings
from tests.clock import Clock
from tools.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 2]]]
MESH = "/v1/surfaces/saddle/mesh.glb?resolution=2"


@pytest.fixture
def fresh_client() -> Iterator[Client]:
    """A client of a new application, whose counters are 0."""
    with start_client(create_app(Settings())) as client:
        yield client


def read_sample(client: Client, name: str, **labels: str) -> float:
    """The current value of the sample with this name and these labels; 0 if there is none yet."""
    for family in families(client.get("/metrics").text):
        for sample in family.samples:
            if sample.name == name and labels.items() <= sample.labels.items():
                return float(sample.value)
    return 0.0


def test_requests_are_counted_by_route_method_and_status(fresh_client: Client) -> None:
    for url in (MESH, MESH, "/v1/surfaces/none/mesh.glb", "/a", "/b"):
        fresh_client.get(url)
    count = "surface_http_request_duration_seconds_count"
    route = "/v1/surfaces/{id}/mesh.{suffix}"
    assert read_sample(fresh_client, count, route=route, method="GET", status="2xx") == 2
    assert read_sample(fresh_client, count, route=route, method="GET", status="4xx") == 1
    assert read_sample(fresh_client, count, route="unmatched") == 2
    assert (
        read_sample(fresh_client, "surface_http_requests_in_flight") == 1
    )  # the request for /metrics itself


def test_cache_hits_misses_bytes_and_meshes_are_counted(fresh_client: Client) -> None:
    responses = [fresh_client.get_raw(MESH) for _ in range(3)]
    assert read_sample(fresh_client, "surface_cache_hits_total") == 2
    assert read_sample(fresh_client, "surface_cache_misses_total") == 1
    assert read_sample(fresh_client, "surface_cache_entries") == 1
    assert read_sample(fresh_client, "surface_cache_bytes") > len(responses[0].content)
    sent_bytes = sum(len(response.content) for response in responses)
    assert (
        read_sample(fresh_client, "surface_http_response_bytes_total", format="glb") == sent_bytes
    )
    assert read_sample(fresh_client, "surface_vertices_total") == 9
    assert read_sample(fresh_client, "surface_triangles_total") == 8
    fresh_client.post("/v1/mesh", {"surface": {"control_net": NET}, "resolution": 1})
    assert read_sample(fresh_client, "surface_vertices_total") == 9 + 4


def test_refusals_are_counted_by_code(fresh_client: Client) -> None:
    for document in ({}, {"surface": 1}, {"surface": {"control_net": NET}, "colour": 1}):
        assert fresh_client.post("/v1/mesh", document).status_code == 422
    fresh_client.get("/nowhere")
    fresh_client.request("DELETE", "/v1/mesh")
    assert read_sample(fresh_client, "surface_refused_total", code="invalid_request") == 3
    assert read_sample(fresh_client, "surface_refused_total", code="not_found") == 1
    assert read_sample(fresh_client, "surface_refused_total", code="method_not_allowed") == 1


def test_two_applications_have_separate_counters() -> None:
    with (
        start_client(create_app(Settings())) as first,
        start_client(create_app(Settings())) as second,
    ):
        first.get(MESH)
        assert read_sample(first, "surface_cache_misses_total") == 1
        assert read_sample(second, "surface_cache_misses_total") == 0


def test_requests_are_counted_by_the_name_of_their_key(monkeypatch: pytest.MonkeyPatch) -> None:
    """At most `MAX_KEYS` names, although an operator may replace keys while the service runs."""
    monkeypatch.setattr(service_metrics, "MAX_KEYS", 2)
    keys = {name: make_key() for name in ("alice", "bob", "carol", "dave")}
    settings = Settings(api_keys=tuple(format_entry(name, key) for name, key in keys.items()))
    with start_client(create_app(settings)) as client:
        for name in ("alice", "bob", "alice", "carol", "dave"):
            client.get(MESH, {"Authorization": f"Bearer {keys[name]}"})
        client.get(MESH)
        counts = {
            name: read_sample(client, "surface_key_requests_total", key=name)
            for name in ("alice", "bob", "carol", "dave", "(others)", "")
        }
    assert counts == {"alice": 2, "bob": 1, "carol": 0, "dave": 0, "(others)": 2, "": 0}


def test_a_broken_file_of_keys_is_a_metric(tmp_path: Path, clock: Clock) -> None:
    """Also if no request has a key: a scrape reads a changed file again."""
    file, name = tmp_path / "keys", "surface_keys_file_valid"
    line = format_entry("alice", make_key())
    file.write_text(line, encoding="utf-8")
    with start_client(create_app(Settings(api_keys_file=str(file)))) as client:
        assert f"{name} 1.0\n" in client.get("/metrics").text
        for content, value in ((line[:-1], "0.0"), (line + "\n", "1.0")):
            file.write_text(content, encoding="utf-8")
            clock.now += 2
            assert f"{name} {value}\n" in client.get("/metrics").text
    with start_client(create_app(Settings(api_keys=(line,)))) as client:
        assert f"{name} " not in client.get("/metrics").text.replace(f"# HELP {name} ", "").replace(
            f"# TYPE {name} ", ""
        )


def test_requests_with_many_paths_have_few_series(fresh_client: Client) -> None:
    for number in range(60):
        fresh_client.get(f"/{number}")
        fresh_client.get(f"/v1/surfaces/{number}")
    text = fresh_client.get("/metrics").text
    # One series of all paths without a route, and one of all unknown surfaces.
    assert text.count("surface_http_request_duration_seconds_count{") == 2


@pytest.mark.parametrize(
    ("accept", "is_openmetrics"),
    [
        ("", False),
        ("*/*", False),
        ("text/plain;version=0.0.4", False),
        (
            "application/openmetrics-text;version=1.0.0,text/plain;version=0.0.4;q=0.5,*/*;q=0.1",
            True,
        ),
        # Parameters, here hostile ones, are ignored.
        ("application/openmetrics-text; version=99\t\x7f.0; escaping=\\", True),
        ("text/plain; version=abc", False),
    ],
)
def test_the_text_format_is_chosen_by_the_accept_header(
    fresh_client: Client, accept: str, is_openmetrics: bool
) -> None:
    response = fresh_client.get("/metrics", headers={"Accept": accept})
    assert response.status_code == 200
    assert response.headers["cache-control"] == "no-store"
    assert response.headers["content-type"].startswith(
        "application/openmetrics-text" if is_openmetrics else "text/plain; version=0.0.4"
    )
    openmetrics_families: Callable[[str], Iterator[Metric]] = (
        openmetrics_parser.text_string_to_metric_families
    )
    metrics = list(
        openmetrics_families(response.text) if is_openmetrics else families(response.text)
    )
    assert len({metric.name for metric in metrics}) == len(metrics) > 15


def test_names_of_metrics_begin_with_a_known_word(fresh_client: Client) -> None:
    for family in families(fresh_client.get("/metrics").text):
        assert family.name.startswith(("surface_", "process_", "python_"))


def test_metrics_can_be_switched_off() -> None:
    with start_client(create_app(Settings(metrics="off"))) as client:
        assert client.get("/metrics").status_code == 404


def test_seconds_of_the_engine_are_counted_by_formulation(fresh_client: Client) -> None:
    net = {"surface": {"control_net": NET}}
    for options in (
        {"method": "de_casteljau"},
        {"method": "forward_difference"},
        {},
        {"tolerance": 0.01},
    ):
        assert fresh_client.post("/v1/mesh", {**net, **options}).status_code == 200
    assert fresh_client.post("/v1/points", {**net, "uv": [[0, 0]]}).status_code == 200
    curve = {"curve": {"control_points": [[0, 0], [1, 1]]}}
    assert fresh_client.post("/v1/curve", curve).status_code == 200
    assert fresh_client.get("/v1/surfaces/trefoil-tube/mesh.glb?resolution=2").status_code == 200
    for formulation in (
        *("de_casteljau", "forward_difference", "kronecker", "adaptive"),
        *("points", "curve", "sweep"),
    ):
        assert (
            read_sample(fresh_client, "surface_engine_seconds_total", formulation=formulation) > 0
        )


def test_metrics_report_the_store_and_queues_and_threads_and_memory(fresh_client: Client) -> None:
    stored = fresh_client.post("/v1/surfaces", {"surface": {"control_net": NET}})
    fresh_client.get(stored.json()["links"]["self"])
    outcome = {"outcome": "done"}
    count = "surface_store_operation_seconds_count"
    assert read_sample(fresh_client, count, operation="put", **outcome) == 1
    assert read_sample(fresh_client, count, operation="get", **outcome) == 1
    assert read_sample(fresh_client, "surface_store_quota_bytes") == Settings().store_quota
    assert 0 < read_sample(fresh_client, "surface_store_bytes") < 10_000
    assert read_sample(fresh_client, "surface_queue_length", lane="work") == 0
    assert read_sample(fresh_client, "surface_threads", lane="work") == Settings().thread_count
    assert read_sample(fresh_client, "surface_threads", lane="parsing") == 1
    assert read_sample(fresh_client, "surface_threads_busy", lane="parsing") == 0
    pools = ("work", "bodies")
    limits = [read_sample(fresh_client, "surface_memory_limit_bytes", pool=pool) for pool in pools]
    assert sum(limits) == Settings().memory_bytes
    assert all(read_sample(fresh_client, "surface_memory_bytes", pool=pool) == 0 for pool in pools)
    assert read_sample(fresh_client, "surface_connections_limit") == Settings().max_connections
    assert read_sample(fresh_client, "surface_ready") == 0, "the store has not answered yet"
    assert fresh_client.get("/health/ready").status_code == 200
    assert read_sample(fresh_client, "surface_ready") == 1
    assert read_sample(fresh_client, "surface_store_writes", state="ready") == 1
    assert read_sample(fresh_client, "surface_store_writes", state="full") == 0


def test_the_waits_of_work_for_threads_are_a_histogram_by_class(fresh_client: Client) -> None:
    net = {"surface": {"control_net": NET}}
    fresh_client.post("/v1/mesh", net)  # on the event loop: it does not wait for a thread
    fresh_client.post("/v1/mesh", {**net, "tolerance": 0.01})
    count = "surface_wait_seconds_count"
    assert read_sample(fresh_client, count) == read_sample(fresh_client, count, **{"class": "mesh"})
    assert read_sample(fresh_client, count, **{"class": "mesh"}) == 1
    assert read_sample(fresh_client, "surface_wait_seconds_bucket", le="0.0005") == 1
