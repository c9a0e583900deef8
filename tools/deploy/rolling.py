"""Restarts and kills instances behind HAProxy under load: `make test-rolling`.

HAProxy uses the shipped file. The instances share a folder, as containers share a bucket.
"""

import hashlib
import json
import os
import socket
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from service.engine.mesh.report import ENGINE
from service.storage.keys import SURFACES
from tools.deploy.load import Clients, Tally, run_under_load
from tools.deploy.traffic import Traffic
from tools.processes import Proxy, Server, peak_memory, service_server

REQUESTS = 20_000
ROUNDS = 4
KILLS = 10
LONGEST = float(os.environ.get("LONGEST", "180"))
"""Seconds after which no further round begins; a busy machine needs more."""

SETTINGS = {"SURFACE_DRAIN_DELAY": "5", "SURFACE_DRAIN_TIMEOUT": "60", "SURFACE_THREADS": "2"}
"""As in `deploy/compose.yaml`."""

SHORT = {
    "small_hit": 24,
    "unchanged": 14,
    "small_post": 8,
    "stored": 6,
    "points": 3,
    "store": 3,
    "cold": 2,
    "large_hit": 1,
}
CLIENTS = (
    Clients(6, SHORT),
    Clients(4, SHORT, keep=False),
    # Rare requests, so that connections are idle in between.
    Clients(2, {"small_post": 1, "large_hit": 1}, pause=3.0),
    Clients(1, {"long_post": 1}, pause=1.0),
)


@contextmanager
def start_two_behind_haproxy(folder: Path) -> Iterator[tuple[Proxy, tuple[Server, Server]]]:
    """HAProxy and two instances that store in one folder; stops all afterwards."""
    settings = SETTINGS | {"SURFACE_STORE": str(folder / "store")}
    one, two = (service_server(folder, settings, probe="/health/ready") for _ in range(2))
    try:
        one.start()
        two.start()
        one.wait_until_ready()
        two.wait_until_ready()
        with Proxy(folder, one.port, two.port) as proxy:
            yield proxy, (one, two)
    finally:
        for each in (one, two):
            if each.is_alive:
                each.kill()


def report(capsys: pytest.CaptureFixture[str], tally: Tally, *lines: str) -> None:
    """Prints the results, whether the test passes or not."""
    with capsys.disabled():
        failed = (*tally.broken[:20], *tally.wrong[:20])
        print("", *tally.lines(), *lines, *failed, sep="\n  ")


def check_store(folder: Path, traffic: Traffic, instances: tuple[Server, ...]) -> str:
    """Checks that stored objects are complete, and that all confirmed objects are stored."""
    objects = [path for path in (folder / "store" / SURFACES).rglob("*") if path.is_file()]
    for path in objects:
        assert hashlib.sha256(path.read_bytes()).hexdigest() == path.name, "a torn object"
    assert traffic.stored.keys() <= {path.name for path in objects}
    for number, instance in enumerate(instances):
        with httpx.Client(base_url=instance.url, timeout=30) as client:
            for id, body in list(traffic.stored.items())[number :: len(instances)]:
                response = client.get(f"/v1/surfaces/{id}")
                assert response.status_code == 200, f"{id} was acknowledged and is lost"
                net = json.loads(body)["surface"]["control_net"]
                assert response.json()["surface"]["control_net"] == net
    return f"{len(objects)} objects, all whole; {len(traffic.stored)} acknowledged, all there"


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
                if time.monotonic() - begin > LONGEST:
                    break
                for each in instances:
                    start = time.monotonic()
                    peaks.append(peak_memory(each.pid))
                    codes.append(each.stop())
                    seconds.append(time.monotonic() - start)
                    each.start()
                    each.wait_until_ready()
                    # Waits until HAProxy has seen it too, as an operator or Kubernetes does.
                    time.sleep(1.5)
                rounds += 1

        tally = run_under_load(proxy.port, traffic, CLIENTS, restart)
        retries = proxy.metric("haproxy_backend_retry_warnings_total")
        kept = proxy.metric("haproxy_backend_http_cache_hits_total")
        stored = check_store(tmp_path, traffic, instances)
    report(
        capsys,
        tally,
        f"{len(codes)} restarts, the longest stop {max(seconds):.1f} s, the most memory"
        f" {max(peaks) / 1e6:.0f} MB; {retries:.0f} retries, {kept:.0f} hits in HAProxy",
        stored,
    )
    assert not tally.broken
    assert not tally.wrong
    assert set(codes) == {0}
    assert tally.count >= REQUESTS
    assert len(codes) >= 2 * ROUNDS
    assert len(tally.seconds["long post"]) >= len(codes)


def test_killed_instances_lose_nothing_and_tear_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only responses that have begun may break, and each client notices an incomplete response.

    HAProxy sends requests without any byte of response to the other instance.
    """
    traffic = Traffic()
    clients = (*CLIENTS, Clients(6, {"store": 1}), Clients(2, {"large_hit": 1}, keep=False))
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):

        def kill(tally: Tally) -> None:
            for number in range(KILLS):
                each = instances[number % 2]
                time.sleep(1.5 + 0.13 * number)
                assert each.kill() == -9
                before = tally.count
                time.sleep(0.5)
                assert tally.count > before, "the other one does not go on"
                each.start()
                each.wait_until_ready()
                time.sleep(1.5)

        tally = run_under_load(proxy.port, traffic, clients, kill)
        retries = proxy.metric("haproxy_backend_retry_warnings_total")
        stored = check_store(tmp_path, traffic, instances)
    refused = [line for line in tally.wrong if ": 502 " in line]
    report(
        capsys, tally, f"{KILLS} killed; {retries:.0f} retries, {len(refused)} answers 502", stored
    )
    assert tally.wrong == refused
    assert len(tally.broken) + len(refused) <= KILLS * sum(group.number for group in clients)
    assert tally.count > 100 * KILLS


def test_an_answer_that_breaks_off_is_seen_to(tmp_path: Path) -> None:
    """The killed instance is sending a long response to a client."""
    target = f"/v1/surfaces/saddle/mesh.json?resolution=340&engine={ENGINE}"
    plain = {"Accept-Encoding": "identity"}
    # Only a few bytes are in buffers while the client does not read.
    little = httpx.HTTPTransport(socket_options=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)])
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):
        complete = httpx.get(proxy.url + target, headers=plain, timeout=60)
        assert complete.status_code == 200
        with (
            httpx.Client(base_url=proxy.url, transport=little, timeout=60) as client,
            client.stream("GET", target, headers=plain) as answer,
        ):
            pieces = answer.iter_raw(1 << 16)
            next(pieces)
            find_serving(proxy, instances).kill()
            with pytest.raises(httpx.RemoteProtocolError):
                deque(pieces)
        assert answer.status_code == 200
        assert int(answer.headers["content-length"]) == len(complete.content)
        # The other instance still responds.
        assert httpx.get(proxy.url + target, headers=plain, timeout=60).content == complete.content


def test_responses_of_the_proxy_without_an_instance(tmp_path: Path) -> None:
    with start_two_behind_haproxy(tmp_path) as (proxy, instances):
        # The proxy serves no metrics to clients, for any spelling of the URL.
        assert httpx.get(f"{instances[0].url}/metrics").status_code == 200
        for path in ("/metrics", "/%6detrics", "/metrics?x=1"):
            shown = httpx.get(proxy.url + path)
            assert (shown.status_code, shown.json()["code"]) == (404, "not_found")
        # A long head reaches the service, which refuses the query itself.
        refused = httpx.get(f"{proxy.url}/v1/surfaces/saddle/mesh.glb?{'a' * 60_000}=1")
        assert refused.status_code == 422
        # The proxy caches a small response and revalidates it; headers about one request are not
        # cached.
        for coding, resolution in (("identity", 4), ("gzip", 5)):
            query = f"resolution={resolution}&engine={ENGINE}"
            target = f"{proxy.url}/v1/surfaces/saddle/mesh.glb?{query}"
            first, again = (httpx.get(target, headers={"Accept-Encoding": coding}) for _ in "12")
            assert first.content == again.content
            assert ("age" in first.headers, "age" in again.headers) == (False, True)
            assert first.headers["x-request-id"]
            assert not again.headers.keys() & {"x-request-id", "server-timing"}
            headers = {"Accept-Encoding": coding, "If-None-Match": first.headers["etag"]}
            assert httpx.get(target, headers=headers).status_code == 304
        for each in instances:
            each.kill()
        assert httpx.get(target).status_code == 200
        refused = httpx.post(f"{proxy.url}/v1/points", json={})
        assert (refused.status_code, refused.json()["code"]) == (503, "no_instance")
        assert refused.headers["content-type"] == "application/problem+json"
        assert int(refused.headers["retry-after"]) > 0


def find_serving(proxy: Proxy, instances: tuple[Server, Server]) -> Server:
    """The instance to which the proxy sends requests now."""
    busy = {
        each: proxy.metric("haproxy_server_current_sessions", f'server="{name}"')
        for each, name in zip(instances, ("surface", "surface-2"), strict=True)
    }
    (only,) = (each for each, sessions in busy.items() if sessions)
    return only
