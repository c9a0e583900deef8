"""Health and readiness: the responses, and what makes a service not ready."""

import asyncio
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from service import __version__
from service.api.app import create_app
from service.api.observing import health
from service.api.observing.health import DEADLINE, STUCK_AFTER, SelfTest, computes_correctly
from service.engine.mesh.mesh import ENGINE, Mesh
from service.pipeline.mesh import build_mesh
from service.settings.values import Settings
from tests.clock import Clock
from tools.client import Client, start_client

pytestmark = pytest.mark.anyio
PAUSE = 6.0
"""Seconds after which the results of checks are no longer valid."""


def test_a_ready_service_reports_its_version_its_engine_and_each_check(client: Client) -> None:
    expected = {"status": "ready", "version": __version__, "engine": ENGINE}
    assert client.get("/health").json() == expected
    assert client.get("/health/live").json() == {"status": "live"}
    response = client.get("/health/ready")
    expected = {"status": "ready", "computing": "ready", "store": "ready", "writes": "ready"}
    assert response.json() == expected
    assert response.headers["cache-control"] == "no-store"


def test_a_draining_service_is_alive_and_not_ready() -> None:
    app = create_app(Settings())
    app.state.ready = False
    with start_client(app) as client:
        assert client.get("/health/live").status_code == 200
        response = client.get("/health/ready")
    assert response.status_code == 503
    assert response.json() == {"status": "draining"}


def test_a_store_that_fails_for_long_makes_the_service_unready(
    tmp_path: Path, clock: Clock
) -> None:
    root = tmp_path / "store"
    with start_client(create_app(Settings(store=str(root)))) as client:
        assert client.get("/health/ready").status_code == 200
        root.rename(tmp_path / "elsewhere")
        clock.now += PAUSE
        response = client.get("/health/ready")
        assert (response.status_code, response.json()["store"]) == (200, "unavailable")
        clock.now += PAUSE
        response = client.get("/health/ready")
        assert response.status_code == 503
        assert response.json() == {
            "status": "unready",
            "computing": "ready",
            "store": "unavailable",
            "writes": "unavailable",
        }
        assert client.get("/health/live").status_code == 200
        (tmp_path / "elsewhere").rename(root)
        clock.now += PAUSE
        assert client.get("/health/ready").status_code == 200


def test_the_service_is_not_ready_before_its_store_has_answered(
    tmp_path: Path, clock: Clock
) -> None:
    root = tmp_path / "store"
    app = create_app(Settings(store=str(root)))
    root.rename(tmp_path / "elsewhere")
    with start_client(app) as client:
        response = client.get("/health/ready")
        assert (response.status_code, response.json()["store"]) == (503, "unavailable")
        (tmp_path / "elsewhere").rename(root)
        clock.now += PAUSE
        assert client.get("/health/ready").json()["status"] == "ready"


def test_a_wrong_number_makes_the_service_unready(monkeypatch: pytest.MonkeyPatch) -> None:
    def build_wrongly(*arguments: Any) -> Mesh:
        mesh: Mesh = build_mesh(*arguments)
        return replace(mesh, positions=mesh.positions * 1.001)

    assert computes_correctly()
    monkeypatch.setattr(health, "build_mesh", build_wrongly)
    with start_client(create_app(Settings())) as client:
        response = client.get("/health/ready")
    assert (response.status_code, response.json()["computing"]) == (503, "unavailable")


async def test_the_self_test_computes_once_in_each_interval_for_all_callers(clock: Clock) -> None:
    calls: list[int] = []

    def work() -> bool:
        calls.append(1)
        return True

    self_test = SelfTest(work)
    assert all(await asyncio.gather(*(self_test.passes() for _ in range(20))))
    assert len(calls) == 1
    clock.now += PAUSE
    assert await self_test.passes()
    assert len(calls) == 2


class Engine:
    """Work for a self-test; while it hangs, it ends only when the test allows it."""

    def __init__(self) -> None:
        self.hangs = True
        self.may_end = threading.Event()

    def work(self) -> bool:
        return not self.hangs or self.may_end.wait(10)


async def wait_in_vain(self_test: SelfTest, clock: Clock) -> bool:
    """The result of a self-test whose work does not end before its deadline."""
    clock.now += PAUSE  # the last result is no longer valid
    test = asyncio.create_task(self_test.passes())
    for _ in range(10):  # until it waits for its work
        await asyncio.sleep(0)
    clock.now += DEADLINE
    return await test


async def test_an_engine_that_raises_or_hangs_is_not_ready(clock: Clock) -> None:
    def raise_error() -> bool:
        raise MemoryError

    engine = Engine()
    hanging = SelfTest(engine.work)
    assert not await SelfTest(raise_error).passes()
    assert not await wait_in_vain(hanging, clock)
    # The work of the first call still runs, so the second call waits for its thread.
    assert not await wait_in_vain(hanging, clock)
    engine.may_end.set()


async def test_a_slow_engine_is_ready_until_the_last_success_is_long_ago(clock: Clock) -> None:
    engine = Engine()
    self_test = SelfTest(engine.work)
    engine.hangs = False
    assert await self_test.passes()
    engine.hangs = True
    assert await wait_in_vain(self_test, clock)
    clock.now += STUCK_AFTER
    assert not await wait_in_vain(self_test, clock)
    engine.may_end.set()
