"""Tests that requests do not fail while processes restart: `make test-rolling`.

Instances restart behind HAProxy with the configuration of `deploy/`; they share a folder, as
containers share a bucket. Workers of one instance are killed and replaced without a proxy.
"""

import hashlib
import json
import os
import signal
import socket
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import httpx
import pytest

from service.engine.mesh.mesh import ENGINE
from service.storage.keys import SURFACES
from tools.deploy.load import Clients, Tally, run_under_load
from tools.deploy.traffic import Traffic
from tools.processes import PATIENCE, Proxy, Server, peak_memory, service_server

REQUESTS, ROUNDS = 20_000, 4
"""Least number of requests, and of rounds in which each instance is restarted once."""

KILLS = 10
"""How often an instance is killed, the two in turn."""

NOTICE_SECONDS = 2.5
"""Seconds within which HAProxy notices that an instance is ready: three checks."""

HANGUPS = 3
"""How often all workers of an instance are replaced."""

MAX_REPLACEMENT = 10.0
"""Seconds after which another worker must serve in the place of one that was killed."""

MAX_SECONDS = float(os.environ.get("LONGEST", "180"))
"""Seconds after which no further round of restarts begins; a busy machine needs more."""

SETTINGS = {"SURFACE_DRAIN_DELAY": "5", "SURFACE_DRAIN_TIMEOUT": "60", "SURFACE_THREADS": "2"}
"""Settings with their values in `deploy/compose.yaml`."""

SHORT_REQUESTS = {
    "small_hit": 24,
    "unchanged": 14,
    "small_post": 8,
    "stored": 6,
    "points": 3,
    "store": 3,
    "cold": 2,
    "large_hit": 1,
}
"""Kinds of requests (`Traffic.requests`) with their weights."""

CLIENTS = (
    Clients(6, SHORT_REQUESTS),
    Clients(4, SHORT_REQUESTS, keeps_connection=False),
    # These clients send rarely, so that their connections are idle in between.
    Clients(2, {"small_post": 1, "large_hit": 1}, pause=3.0),
    Clients(1, {"long_post": 1}, pause=1.0),
)


@contextmanager
def start_two_behind_haproxy(
    folder: Path, *stores: Mapping[str, str]
) -> Iterator[tuple[Proxy, tuple[Server, Server]]]:
    """Starts HAProxy and two instances; stops them after the block.

    `stores` are the settings of the store for each instance; by default both store in one folder.
    """
    stores = stores or ({"SURFACE_STORE": str(folder / "store")},) * 2
    first, second = (
        service_server(folder, {**SETTINGS, **store}, probe="/health/ready") for store in stores
    )
    try:
        first.start()
        second.start()
        first.wait_until_ready()
        second.wait_until_ready()
        with Proxy(folder, first.port, second.port) as proxy:
            yield proxy, (first, second)
    finally:
        for each in (first, second):
            if each.is_alive:
                each.kill()


def print_results(capsys: pytest.CaptureFixture[str], tally: Tally, *lines: str) -> None:
    """Prints the results, also if the test passes."""
    with capsys.disabled():
        failures = (*tally.incomplete_responses[:20], *tally.wrong_responses[:20])
        print("", *tally.format_lines(), *lines, *failures, sep="\n  ")


def check_store(folder: Path, traffic: Traffic, instances: tuple[Server, ...]) -> str:
    """Checks that stored objects are complete, and that all confirmed objects are stored."""
    objects = [path for path in (folder / "store" / SURFACES).rglob("*") if path.is_file()]
    for path in objects:
        assert hashlib.sha256(path.read_bytes()).hexdigest() == path.name, "an incomplete object"
    assert traffic.stored.keys() <= {path.name for path in objects}
    for number, instance in enumerate(instances):
        with httpx.Client(base_url=instance.url, timeout=30) as client:
            for id, body in list(traffic.stored.items())[number :: len(instances)]:
                response = client.get(f"/v1/surfaces/{id}")
                assert response.status_code == 200, f"{id} was confirmed, but is not stored"
                net = json.loads(body)["surface"]["control_net"]
                assert response.json()["surface"]["control_net"] == net
    return f"{len(objects)} objects, all complete; {len(traffic.stored)} confirmed, all stored"


def test_no_request_fails_while_instances_are_restarted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    traffic = Traffic()
    codes: list[int] = []
    seconds: list[float] = []
    peaks: list[int] = []
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):

        def restart(tally: Tally) -> None:
            begin = time.monotonic()
            rounds = 0
            while rounds < ROUNDS or tally.count < REQUESTS:
                if time.monotonic() - begin > MAX_SECONDS:
                    break
                for each in instances:
                    start = time.monotonic()
                    peaks.append(peak_memory(each.pid))
                    codes.append(each.stop())
                    seconds.append(time.monotonic() - start)
                    each.start()
                    each.wait_until_ready()
                    time.sleep(NOTICE_SECONDS)
                rounds += 1

        tally = run_under_load(proxy.port, traffic, CLIENTS, restart)
        retries = proxy.metric("haproxy_backend_retry_warnings_total")
        cache_hits = proxy.metric("haproxy_backend_http_cache_hits_total")
        store_summary = check_store(tmp_path, traffic, instances)
    print_results(
        capsys,
        tally,
        f"{len(codes)} restarts, the longest stop {max(seconds):.1f} s, the most memory"
        f" {max(peaks) / 1e6:.0f} MB; {retries:.0f} retries, {cache_hits:.0f} hits in HAProxy",
        store_summary,
    )
    assert not tally.incomplete_responses
    assert not tally.wrong_responses
    assert set(codes) == {0}
    assert tally.count >= REQUESTS
    assert len(codes) >= 2 * ROUNDS
    # Long requests ran all the time, so that some of them ran while an instance stopped.
    assert len(tally.seconds["long post"]) >= len(codes)


def test_killed_instances_lose_no_stored_surface_and_break_few_responses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only responses that have begun may be incomplete, and each client notices it.

    HAProxy sends a request again, to the other instance, if no byte of the response has arrived. If
    it cannot do so, the client gets status 502.
    """
    traffic = Traffic()
    clients = (
        *CLIENTS,
        Clients(6, {"store": 1}),
        Clients(2, {"large_hit": 1}, keeps_connection=False),
    )
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):

        def kill(tally: Tally) -> None:
            for number in range(KILLS):
                each = instances[number % 2]
                time.sleep(1.5 + 0.13 * number)
                assert each.kill() == -signal.SIGKILL
                count_before = tally.count
                time.sleep(0.5)
                assert tally.count > count_before, "the other instance does not respond"
                each.start()
                each.wait_until_ready()
                time.sleep(NOTICE_SECONDS)

        tally = run_under_load(proxy.port, traffic, clients, kill)
        retries = proxy.metric("haproxy_backend_retry_warnings_total")
        store_summary = check_store(tmp_path, traffic, instances)
    bad_gateways = [line for line in tally.wrong_responses if ": 502 " in line]
    print_results(
        capsys,
        tally,
        f"{KILLS} killed; {retries:.0f} retries, {len(bad_gateways)} responses 502",
        store_summary,
    )
    assert tally.wrong_responses == bad_gateways
    # Each client waits for one response at a time, so a kill breaks at most one for each.
    assert len(tally.incomplete_responses) + len(bad_gateways) <= KILLS * sum(
        group.number for group in clients
    )
    assert tally.count > 100 * KILLS


def test_a_client_notices_that_a_response_is_incomplete(tmp_path: Path) -> None:
    """The instance is killed while it sends a long response to the client."""
    target = f"/v1/surfaces/saddle/mesh.json?resolution=340&engine={ENGINE}"
    identity = {"Accept-Encoding": "identity"}
    # With a small buffer, only a few bytes have been sent while the client does not read.
    small_buffer = httpx.HTTPTransport(
        socket_options=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)]
    )
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):
        complete_response = httpx.get(proxy.url + target, headers=identity, timeout=60)
        assert complete_response.status_code == 200
        with (
            httpx.Client(base_url=proxy.url, transport=small_buffer, timeout=60) as client,
            client.stream("GET", target, headers=identity) as response,
        ):
            chunks = response.iter_raw(1 << 16)
            next(chunks)
            find_serving_instance(proxy, instances).kill()
            with pytest.raises(httpx.RemoteProtocolError):
                deque(chunks)  # reads to the end
        assert response.status_code == 200
        assert int(response.headers["content-length"]) == len(complete_response.content)
        # The other instance still responds.
        assert (
            httpx.get(proxy.url + target, headers=identity, timeout=60).content
            == complete_response.content
        )


def test_responses_that_the_proxy_refuses_passes_on_caches_and_makes_itself(
    tmp_path: Path,
) -> None:
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):
        # The proxy serves no metrics to clients, for any spelling of the URL.
        assert httpx.get(f"{instances[0].url}/metrics").status_code == 200
        for path in ("/metrics", "/%6detrics", "/metrics?x=1"):
            response = httpx.get(proxy.url + path)
            assert (response.status_code, response.json()["code"]) == (404, "not_found")
        # The proxy passes on a long head; the service refuses the unknown parameter.
        refusal = httpx.get(f"{proxy.url}/v1/surfaces/saddle/mesh.glb?{'a' * 60_000}=1")
        assert refusal.status_code == 422
        # The proxy caches a small response, and also answers 304 for it. Headers about one request
        # are not cached.
        for coding, resolution in (("identity", 4), ("gzip", 5)):
            query = f"resolution={resolution}&engine={ENGINE}"
            target = f"{proxy.url}/v1/surfaces/saddle/mesh.glb?{query}"
            headers = {"Accept-Encoding": coding}
            first, second = (httpx.get(target, headers=headers) for _ in range(2))
            assert first.content == second.content
            assert ("age" in first.headers, "age" in second.headers) == (False, True)
            assert first.headers["x-request-id"]
            assert not second.headers.keys() & {"x-request-id", "server-timing"}
            headers["If-None-Match"] = first.headers["etag"]
            assert httpx.get(target, headers=headers).status_code == 304
        for each in instances:
            each.kill()
        # The cached response does not need an instance.
        assert httpx.get(target).status_code == 200
        refusal = httpx.post(f"{proxy.url}/v1/points", json={})
        assert (refusal.status_code, refusal.json()["code"]) == (503, "no_instance")
        assert refusal.headers["content-type"] == "application/problem+json"
        assert int(refusal.headers["retry-after"]) > 0


@contextmanager
def start_workers(folder: Path) -> Iterator[Server]:
    """An instance with two workers, both of which serve; it is killed after the block."""
    settings = SETTINGS | {"SURFACE_STORE": str(folder / "store"), "SURFACE_WORKERS": "2"}
    server = service_server(folder, settings | {"SURFACE_ACCESS_LOG": "false"})
    server.start()
    try:
        wait_for_line(server, "All 2 workers serve", 1)
        yield server
    finally:
        if server.is_alive:
            server.stop()


def wait_for_line(server: Server, text: str, number: int) -> float:
    """Waits until a text stands `number` times in a service's log; returns the seconds."""
    start = time.monotonic()
    while server.log.read_text(encoding="utf-8").count(text) < number:
        assert time.monotonic() - start < PATIENCE, f"{text!r} is not in {server.log}"
        time.sleep(0.05)
    return time.monotonic() - start


def test_no_request_fails_while_workers_are_replaced_one_by_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    traffic = Traffic()
    probes: list[int] = []
    seconds: list[float] = []
    with start_workers(tmp_path) as server:

        def probe(is_over: Event) -> None:
            while not is_over.wait(0.02):
                probes.append(httpx.get(f"{server.url}/health/ready", verify=False).status_code)

        def replace(_: Tally) -> None:
            is_over = Event()
            prober = Thread(target=probe, args=(is_over,))
            prober.start()
            try:
                for number in range(HANGUPS):
                    old_pids = set(server.worker_pids())
                    server.process.send_signal(signal.SIGHUP)
                    seconds.append(wait_for_line(server, "All workers are replaced", number + 1))
                    while old_pids & set(server.worker_pids()):
                        time.sleep(0.05)
            finally:
                is_over.set()
                prober.join()

        tally = run_under_load(server.port, traffic, CLIENTS, replace)
        store_summary = check_store(tmp_path, traffic, (server,))
        code = server.stop()
    print_results(
        capsys,
        tally,
        f"{HANGUPS} × SIGHUP, the longest {max(seconds):.1f} s; {len(probes)} probes",
        store_summary,
    )
    assert not tally.incomplete_responses
    assert not tally.wrong_responses
    assert set(probes) == {200}
    assert code == 0


def test_killed_workers_are_replaced_and_lose_no_stored_surface(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    traffic = Traffic()
    clients = (*CLIENTS, Clients(6, {"store": 1}))
    seconds: list[float] = []
    with start_workers(tmp_path) as server:

        def kill(tally: Tally) -> None:
            for number in range(KILLS):
                victim = server.worker_pids()[number % 2]
                os.kill(victim, signal.SIGKILL)
                started = "Application startup complete"
                seconds.append(wait_for_line(server, started, 3 + number))
                count_before = tally.count
                time.sleep(1)
                assert tally.count > count_before
            # The parent, too: its workers end, with their running requests.
            pids = server.worker_pids()
            server.kill()
            start = time.monotonic()
            while any(Path(f"/proc/{pid}").exists() for pid in pids):
                assert time.monotonic() - start < PATIENCE
                time.sleep(0.05)
            ends.append(time.monotonic() - start)
            server.start()
            wait_for_line(server, "All 2 workers serve", 2)

        ends: list[float] = []
        tally = run_under_load(server.port, traffic, clients, kill)
        store_summary = check_store(tmp_path, traffic, (server,))
    refused = [line for line in tally.incomplete_responses if "ConnectionRefused" in line]
    broken = len(tally.incomplete_responses) - len(refused)
    print_results(
        capsys,
        tally,
        f"{KILLS} workers killed, replaced within {max(seconds):.1f} s, {broken} requests broken; "
        f"the workers ended {ends[0]:.1f} s after their parent, {len(refused)} refused meanwhile",
        store_summary,
    )
    assert not tally.wrong_responses
    assert max(seconds) < MAX_REPLACEMENT
    # Each client waits for one response at a time, so a kill breaks at most one for each.
    assert broken <= (KILLS + 1) * sum(group.number for group in clients)


def find_serving_instance(proxy: Proxy, instances: tuple[Server, Server]) -> Server:
    """The instance to which the proxy sends requests now."""
    sessions_of = {
        each: proxy.metric("haproxy_server_current_sessions", f'server="{name}"')
        for each, name in zip(instances, ("surface", "surface-2"), strict=True)
    }
    (serving_instance,) = (each for each, sessions in sessions_of.items() if sessions)
    return serving_instance
