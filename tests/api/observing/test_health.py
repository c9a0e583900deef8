"""Health and readiness: the responses, and what makes a service not ready."""

import asyncio
import shutil
import threading
from pathlib import Path

import pytest

from service import __version__
from service.api.app import create_app
from service.api.observing import health
from service.api.observing.health import SelfTest, computes_correctly
from service.bases import bernstein
from service.engine.evaluation import at_once, grid_products
from service.engine.mesh.report import ENGINE
from service.engine.scratch import Workspaces
from service.settings.values import Settings
from service.storage import store as store_module
from tools.client import Client, start_client

pytestmark = pytest.mark.anyio


def test_a_ready_service_reports_its_version_its_engine_and_each_check(client: Client) -> None:
    expected = {"status": "ready", "version": __version__, "engine": ENGINE}
    assert client.get("/health").json() == expected
    assert client.get("/health/live").json() == {"status": "live"}
    response = client.get("/health/ready")
    assert response.json() == {"status": "ready", "computing": "ready", "store": "ready"}
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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A negative interval: each request checks the store again.
    monkeypatch.setattr(store_module, "CHECK_INTERVAL", -1.0)
    root = tmp_path / "store"
    with start_client(create_app(Settings(store=str(root)))) as client:
        assert client.get("/health/ready").status_code == 200
        shutil.rmtree(root)
        response = client.get("/health/ready")
        assert (response.status_code, response.json()["store"]) == (200, "unavailable")
        monkeypatch.setattr(health, "STORE_GRACE", 0.0)
        response = client.get("/health/ready")
        assert response.status_code == 503
        expected = {"status": "unready", "computing": "ready", "store": "unavailable"}
        assert response.json() == expected
        assert client.get("/health/live").status_code == 200
        (root / "surfaces").mkdir(parents=True)
        assert client.get("/health/ready").status_code == 200


def test_a_wrong_number_makes_the_service_unready(monkeypatch: pytest.MonkeyPatch) -> None:
    assert computes_correctly()
    sample = bernstein.sample_partials_basis
    # New workspaces: those of earlier tests have the right basis already.
    monkeypatch.setattr(at_once, "_WORKSPACES", Workspaces(at_once._Workspace))
    monkeypatch.setattr(grid_products, "sample_partials_basis", lambda *args: sample(*args) * 1.001)
    assert not computes_correctly()
    with start_client(create_app(Settings())) as client:
        response = client.get("/health/ready")
    assert (response.status_code, response.json()["computing"]) == (503, "unavailable")


async def test_the_self_test_computes_once_in_each_interval_for_all_callers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: list[int] = []

    def work() -> bool:
        calls.append(1)
        return True

    self_test = SelfTest(work)
    assert all(await asyncio.gather(*(self_test.passes() for _ in range(20))))
    assert len(calls) == 1
    monkeypatch.setattr(health, "TEST_INTERVAL", -1.0)  # the interval is over
    assert await self_test.passes()
    assert len(calls) == 2


async def test_an_engine_that_raises_or_hangs_is_not_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(health, "DEADLINE", 0.05)
    monkeypatch.setattr(health, "TEST_INTERVAL", -1.0)  # each call computes
    may_end = threading.Event()

    def raise_error() -> bool:
        raise MemoryError

    hanging = SelfTest(lambda: may_end.wait(10))
    assert not await SelfTest(raise_error).passes()
    assert not await hanging.passes()
    # The work of the first call still runs, so the second call waits for its thread.
    assert not await hanging.passes()
    may_end.set()


async def test_a_slow_engine_is_ready_until_the_last_success_is_long_ago(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(health, "TEST_INTERVAL", -1.0)  # each call computes
    may_end = threading.Event()
    hangs = iter((False, True, True))

    def work() -> bool:
        return may_end.wait(10) if next(hangs) else True

    self_test = SelfTest(work)
    assert await self_test.passes()
    monkeypatch.setattr(health, "DEADLINE", 0.05)
    assert await self_test.passes()
    monkeypatch.setattr(health, "STUCK_AFTER", 0.0)
    assert not await self_test.passes()
    may_end.set()
