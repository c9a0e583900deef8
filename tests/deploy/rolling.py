"""Instances behind HAProxy that are restarted, and killed, under load: `make test-rolling`.

HAProxy runs the file that we ship. The instances share a folder, as containers share a bucket.
"""

import asyncio
import hashlib
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from service.storage.keys import SURFACES
from tests.deploy.load import Clients, Tally, under_load
from tests.deploy.processes import Instance, Proxy
from tests.deploy.traffic import Traffic

REQUESTS = 20_000
ROUNDS = 4
LONGEST = 200.0
"""Seconds after which no further round begins."""

SETTINGS = {
    "SURFACE_DRAIN_DELAY": "5",
    "SURFACE_DRAIN_TIMEOUT": "60",
    "SURFACE_THREADS": "2",
}
"""As in `deploy/compose.yaml`."""

SHORT = {
    "small_hit": 6,
    "large_hit": 1,
    "unchanged": 3,
    "cold": 1,
    "small_post": 4,
    "points": 2,
    "store": 2,
    "stored": 2,
}
CLIENTS = (
    Clients(6, SHORT),
    Clients(4, SHORT, keep=False),
    Clients(2, {"small_post": 1, "large_hit": 1}, pause=0.5),
    Clients(1, {"long_post": 1}, keep=False, pause=0.3),
)


@contextmanager
def two_behind_haproxy(folder: Path) -> Iterator[tuple[Proxy, tuple[Instance, Instance]]]:
    """HAProxy and two instances that store in one folder; all are gone afterwards."""
    settings = SETTINGS | {"SURFACE_STORE": str(folder / "store")}
    instances = (Instance("one", folder, settings), Instance("two", folder, settings))
    proxy = None
    try:
        for each in instances:
            each.start()
        for each in instances:
            each.wait_until_ready()
        proxy = Proxy(folder, instances)
        yield proxy, instances
    finally:
        if proxy is not None:
            proxy.stop()
        for each in instances:
            if each.process is not None and each.process.poll() is None:
                each.kill()


def report(capsys: pytest.CaptureFixture[str], *lines: str) -> None:
    """Shows what was seen, whether the test passes or not."""
    with capsys.disabled():
        print("", *lines, sep="\n  ")


def check_store(folder: Path, traffic: Traffic, instances: tuple[Instance, ...]) -> str:
    """Whatever is stored is whole, and all that was acknowledged is there, at every instance."""
    objects = [path for path in (folder / "store" / SURFACES).rglob("*") if path.is_file()]
    for path in objects:
        assert hashlib.sha256(path.read_bytes()).hexdigest() == path.name, "a torn object"
    assert traffic.stored.keys() <= {path.name for path in objects}
    for instance in instances:
        with httpx.Client(base_url=instance.url, timeout=30) as client:
            for id, body in traffic.stored.items():
                given = client.get(f"/v1/surfaces/{id}")
                assert given.status_code == 200, f"{id} was acknowledged and is lost"
                net = json.loads(body)["surface"]["control_net"]
                assert given.json()["surface"]["control_net"] == net
    return f"{len(objects)} objects, all whole; {len(traffic.stored)} acknowledged, all there"


def test_no_request_fails_while_instances_are_restarted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    traffic = Traffic()
    codes: list[int] = []
    seconds: list[float] = []
    with two_behind_haproxy(tmp_path) as (proxy, instances):

        async def restart(tally: Tally) -> None:
            begin = time.monotonic()
            rounds = 0
            while rounds < ROUNDS or tally.count < REQUESTS:
                assert time.monotonic() - begin < LONGEST, f"only {tally.count} requests"
                for each in instances:
                    start = time.monotonic()
                    codes.append(await asyncio.to_thread(each.stop))
                    seconds.append(time.monotonic() - start)
                    each.start()
                    await asyncio.to_thread(each.wait_until_ready)
                    # Until HAProxy has seen it too: as an operator waits, or Kubernetes does.
                    await asyncio.sleep(1.5)
                rounds += 1

        tally = asyncio.run(under_load(proxy.port, traffic, CLIENTS, restart))
        retries = proxy.metric("haproxy_backend_retry_warnings_total")
        kept = proxy.metric("haproxy_frontend_http_cache_hits_total")
        stored = check_store(tmp_path, traffic, instances)
    report(
        capsys,
        *tally.lines(),
        f"{len(codes)} restarts, the longest stop {max(seconds):.1f} s;"
        f" {retries:.0f} retries, {kept:.0f} answers from HAProxy's cache",
        stored,
        *tally.broken[:20],
        *tally.wrong[:20],
    )
    assert not tally.broken
    assert not tally.wrong
    assert set(codes) == {0}
    assert tally.count >= REQUESTS
    assert len(tally.seconds["long post"]) >= len(codes)
