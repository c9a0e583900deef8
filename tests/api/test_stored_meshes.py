"""Meshes of stored surfaces by URL: caches may keep them for ever; a deletion removes them."""

import threading
from collections.abc import Iterator

import pytest
from fastapi import FastAPI

from service.api.app import create_app
from service.encoders.registry import FORMATS
from service.engine.mesh.report import ENGINE
from service.pipeline.mesh import MeshFile, MeshWork
from service.settings.values import Settings
from service.storage.store import SurfaceStore
from tests.api.client import Client, start_client

NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]
SAIL = {"surface": {"control_net": NET, "name": "Main sail"}}
PLAIN = {"Accept-Encoding": "identity"}


@pytest.fixture
def app() -> FastAPI:
    return create_app(Settings(allow_delete=True))


@pytest.fixture
def client(app: FastAPI) -> Iterator[Client]:
    with start_client(app) as client:
        yield client


def store_surface(client: Client) -> dict[str, str]:
    """The URLs of the meshes of a stored surface, by suffix."""
    links: dict[str, str] = client.post("/v1/surfaces", SAIL).json()["links"]["mesh"]
    return links


def test_links_are_canonical_and_for_ever(client: Client) -> None:
    links = store_surface(client)
    assert list(links) == [fmt.suffix for fmt in FORMATS]
    for suffix, url in links.items():
        assert url.endswith(f"/mesh.{suffix}?engine={ENGINE}")
        for _ in range(2):
            response = client.get(url, PLAIN)
            assert response.status_code == 200
            assert response.headers["link"] == f'<{url}>; rel="canonical"'
            assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
            disposition = f'inline; filename="Main-sail.{suffix}"'
            assert response.headers["content-disposition"] == disposition


def test_without_the_engine_they_are_kept_for_an_hour(client: Client) -> None:
    url = store_surface(client)["glb"]
    plain = url.partition("?")[0]
    for _ in range(2):
        pinned, unpinned = client.get(url), client.get(plain)
        assert "immutable" in pinned.headers["cache-control"]
        assert unpinned.headers["cache-control"] == "public, max-age=3600, must-revalidate"
        assert unpinned.headers["etag"] == pinned.headers["etag"]
        assert unpinned.headers["link"] == pinned.headers["link"]


def test_a_tag_is_of_the_content_not_of_the_name(client: Client) -> None:
    example = client.get("/v1/surfaces/saddle").json()
    id = client.post("/v1/surfaces", example).json()["id"]
    one = client.get("/v1/surfaces/saddle/mesh.glb", PLAIN)
    other = client.get(f"/v1/surfaces/{id}/mesh.glb", PLAIN)
    assert one.content == other.content
    assert one.headers["etag"] == other.headers["etag"]
    assert one.headers["link"] != other.headers["link"]


def test_304_without_computing_but_only_where_the_surface_is(client: Client, app: FastAPI) -> None:
    url = store_surface(client)["glb"]
    tag = client.get(url, PLAIN).headers["etag"]
    condition = {**PLAIN, "If-None-Match": tag}
    fresh = create_app(Settings())
    with start_client(fresh) as other:
        assert other.get(url, condition).status_code == 404
        store_surface(other)
        response = other.get(url, condition)
    assert response.status_code == 304
    assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert len(fresh.state.services.cache) == 0
    assert len(app.state.services.cache) == 1


def test_a_deleted_surface_has_no_meshes(client: Client, app: FastAPI) -> None:
    url = store_surface(client)["glb"]
    first = client.get(url)
    kept = client.get("/v1/surfaces/saddle/mesh.glb").headers["link"]
    assert client.request("DELETE", url.rpartition("/")[0]).status_code == 204
    assert client.get(url).status_code == 404
    assert client.get(url, {"If-None-Match": first.headers["etag"]}).status_code == 404
    assert len(app.state.services.cache) == 1
    assert client.get("/v1/surfaces/saddle/mesh.glb").headers["link"] == kept
    assert store_surface(client)["glb"] == url
    assert client.get(url).content == first.content


def test_a_surface_deleted_during_the_computation_is_not_cached(
    client: Client, app: FastAPI, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, gate, response = threading.Event(), threading.Event(), MeshWork.run

    def slow(work: MeshWork) -> MeshFile:
        begun.set()
        assert gate.wait(60)
        return response(work)

    monkeypatch.setattr(MeshWork, "run", slow)
    url = store_surface(client)["glb"] + "&resolution=200"
    statuses: list[int] = []
    asking = threading.Thread(target=lambda: statuses.append(client.get(url).status_code))
    asking.start()
    assert begun.wait(60)
    assert client.request("DELETE", url.rpartition("/")[0]).status_code == 204
    gate.set()
    asking.join()
    assert statuses == [200]
    assert len(app.state.services.cache) == 0
    assert client.get(url).status_code == 404


def test_cached_responses_need_no_store(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    url = store_surface(client)["glb"]
    first = client.get(url)

    async def refuse(_store: SurfaceStore, _id: str) -> bytes:
        raise AssertionError("the store was asked")

    monkeypatch.setattr(SurfaceStore, "get", refuse)
    monkeypatch.setattr(SurfaceStore, "has", refuse)
    assert client.get(url).content == first.content
    other_spelling = url.replace("?", "?weld=true&")
    assert client.get(other_spelling).content == first.content


def test_where_numbers_are_rounded_differently_the_tag_is_another(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = store_surface(client)["glb"]
    tag = client.get(url, PLAIN).headers["etag"]
    monkeypatch.setattr("service.encoders.arithmetic.arithmetic", lambda: "another processor")
    with start_client(create_app(Settings())) as other:
        store_surface(other)
        response = other.get(url, {**PLAIN, "If-None-Match": tag})
    assert response.status_code == 200
    assert response.headers["etag"] != tag
