"""Health and readiness: the responses, and the causes of being unready."""

import asyncio
import shutil
import threading
from pathlib import Path

import pytest

from service import __version__
from service.api.app import create_app
from service.api.observing import health
from service.api.observing.health import SelfTest, computes_rightly
from service.bases import bernstein
from service.engine.evaluation import at_once, grid_products
from service.engine.mesh.report import ENGINE
from service.engine.scratch import Workspaces
from service.settings.values import Settings
from service.storage import store as store_module
from tests.api.client import Client, start_client

pytestmark = pytest.mark.anyio


def test_a_ready_service(client: Client) -> None:
    reported = {"status": "ready", "version": __version__, "engine": ENGINE}
    assert client.get("/health").json() == reported
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


def test_a_store_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "REMEMBERED", -1.0)
    root = tmp_path / "store"
    with start_client(create_app(Settings(store=str(root)))) as client:
        assert client.get("/health/ready").status_code == 200
        shutil.rmtree(root)
        response = client.get("/health/ready")
        assert (response.status_code, response.json()["store"]) == (200, "unavailable")
        monkeypatch.setattr(health, "PATIENCE", 0.0)
        response = client.get("/health/ready")
        assert response.status_code == 503
        expected = {"status": "unready", "computing": "ready", "store": "unavailable"}
        assert response.json() == expected
        assert client.get("/health/live").status_code == 200
        (root / "surfaces").mkdir(parents=True)
        assert client.get("/health/ready").status_code == 200


def test_wrong_numbers_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert computes_rightly()
    true = bernstein.sample_partials_basis
    monkeypatch.setattr(at_once, "_WORKSPACES", Workspaces(at_once._Workspace))
    monkeypatch.setattr(grid_products, "sample_partials_basis", lambda *of: true(*of) * 1.001)
    assert not computes_rightly()
    with start_client(create_app(Settings())) as client:
        response = client.get("/health/ready")
    assert (response.status_code, response.json()["computing"]) == (503, "unavailable")


async def test_it_computes_once_in_5_s_for_all_callers() -> None:
    done: list[int] = []

    def work() -> bool:
        done.append(1)
        return True

    self_test = SelfTest(work)
    assert all(await asyncio.gather(*(self_test.passes() for _ in range(20))))
    assert len(done) == 1


async def test_an_engine_that_raises_or_hangs_is_not_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(health, "DEADLINE", 0.05)
    monkeypatch.setattr(health, "INTERVAL", -1.0)
    go_on = threading.Event()

    def fails() -> bool:
        raise MemoryError

    hanging = SelfTest(lambda: go_on.wait(10))
    assert not await SelfTest(fails).passes()
    assert not await hanging.passes()
    assert not await hanging.passes()
    go_on.set()


async def test_a_busy_engine_is_ready_until_it_is_silent_for_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(health, "INTERVAL", -1.0)
    go_on = threading.Event()
    answers = iter((False, True, True))

    def work() -> bool:
        return go_on.wait(10) if next(answers) else True

    self_test = SelfTest(work)
    assert await self_test.passes()
    monkeypatch.setattr(health, "DEADLINE", 0.05)
    assert await self_test.passes()
    monkeypatch.setattr(health, "SILENCE", 0.0)
    assert not await self_test.passes()
    go_on.set()
