"""A surface that one process removes ends in the caches of all others that share its store."""

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from service.api import removals
from service.api.app import Application, create_app
from service.api.caching.cached_response import CHECK_INTERVAL
from service.errors import StoreFailed
from service.settings.values import Settings
from tests.clock import Clock
from tools.client import Client, start_client

NET = {"surface": {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}


@pytest.fixture
def app(tmp_path: Path) -> Application:
    return create_app(Settings(store=str(tmp_path / "store"), allow_delete=True))


@pytest.fixture
def mesh(app: Application) -> Iterator[tuple[Client, str, Callable[[], None]]]:
    """A client of `app`, the URL of a mesh in its cache, and a call that removes the surface.

    Another application with the same store removes it.
    """
    settings = app.state.services.settings
    with start_client(app) as client, start_client(create_app(settings)) as other:
        links = client.post("/v1/surfaces", NET).json()["links"]
        url = links["mesh"]["glb"]
        assert client.get(url).status_code == 200

        def remove() -> None:
            assert other.request("DELETE", links["self"]).status_code == 204

        yield client, url, remove


def is_hit(client: Client, url: str) -> bool:
    response = client.get(url)
    assert response.status_code == 200
    return "cache;desc=hit" in response.headers["server-timing"]


def test_a_removed_surface_is_served_from_another_cache_for_half_a_minute_at_most(
    clock: Clock, app: Application, mesh: tuple[Client, str, Callable[[], None]]
) -> None:
    client, url, remove = mesh
    other_spelling = url.replace("?", "?resolution=16&")
    assert is_hit(client, other_spelling)
    remove()
    clock.now += CHECK_INTERVAL - 0.1
    assert is_hit(client, url)
    clock.now += 0.2
    assert client.get(url).status_code == 404
    assert client.get(other_spelling).status_code == 404
    assert len(app.state.services.cache) == 0


def test_a_spelling_that_is_not_in_the_cache_is_checked_too(
    clock: Clock, mesh: tuple[Client, str, Callable[[], None]]
) -> None:
    client, url, remove = mesh
    remove()
    clock.now += CHECK_INTERVAL + 0.1
    tag = client.get(url.replace("?", "?resolution=16&"), {"If-None-Match": "*"})
    assert tag.status_code == 404


def test_the_store_is_asked_once_in_half_a_minute_and_never_about_an_example(
    clock: Clock,
    app: Application,
    mesh: tuple[Client, str, Callable[[], None]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client, url, _ = mesh
    asked: list[str] = []
    has = app.state.services.store.has

    async def record_and_ask(id: str) -> Any:
        asked.append(id)
        return await has(id)

    monkeypatch.setattr(app.state.services.store, "has", record_and_ask)
    example = "/v1/surfaces/saddle/mesh.glb?resolution=2"
    client.get(example)
    for _ in range(10):  # 100 s
        clock.now += 10
        assert is_hit(client, url)
        assert is_hit(client, example)
    assert asked == [url.split("/")[3]] * 3


@pytest.mark.parametrize("fails", [True, False], ids=["failing", "hanging"])
def test_without_an_answer_of_the_store_the_cached_response_is_sent(
    fails: bool,
    clock: Clock,
    app: Application,
    mesh: tuple[Client, str, Callable[[], None]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client, url, _ = mesh

    async def ask(_: str) -> bool:
        if fails:
            raise StoreFailed
        await asyncio.Event().wait()
        return False

    monkeypatch.setattr(app.state.services.store, "has", ask)
    monkeypatch.setattr(removals, "PATIENCE", 0.0)
    clock.now += CHECK_INTERVAL + 1
    assert is_hit(client, url)
