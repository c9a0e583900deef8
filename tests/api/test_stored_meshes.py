"""Meshes of stored surfaces by URL: caches may keep them for ever; a deletion removes them."""

import threading
from collections.abc import Iterator

import pytest
from fastapi import FastAPI

from service.api.app import create_app
from service.encoders.registry import FORMATS
from service.engine.mesh.mesh import ENGINE
from service.pipeline.mesh import MeshFile, make_file
from service.pipeline.mesh_plan import MeshPlan
from service.settings.values import Settings
from service.storage.store import SurfaceStore
from service.surface.sizes import SurfaceKind
from tools.client import Client, start_client

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
    """Stores a surface; returns the URLs of its meshes by suffix."""
    links: dict[str, str] = client.post("/v1/surfaces", SAIL).json()["links"]["mesh"]
    return links


def test_links_to_meshes_are_canonical_and_may_be_cached_for_ever(client: Client) -> None:
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


def test_urls_without_the_engine_may_be_cached_for_an_hour(client: Client) -> None:
    url = store_surface(client)["glb"]
    url_without_engine = url.partition("?")[0]
    for _ in range(2):
        with_engine, without_engine = client.get(url), client.get(url_without_engine)
        assert "immutable" in with_engine.headers["cache-control"]
        assert without_engine.headers["cache-control"] == "public, max-age=3600, must-revalidate"
        assert without_engine.headers["etag"] == with_engine.headers["etag"]
        assert without_engine.headers["link"] == with_engine.headers["link"]


def test_equal_meshes_under_two_urls_have_equal_tags(client: Client) -> None:
    example = client.get("/v1/surfaces/saddle").json()
    id = client.post("/v1/surfaces", example).json()["id"]
    mesh_of_example = client.get("/v1/surfaces/saddle/mesh.glb", PLAIN)
    mesh_of_stored = client.get(f"/v1/surfaces/{id}/mesh.glb", PLAIN)
    assert mesh_of_example.content == mesh_of_stored.content
    assert mesh_of_example.headers["etag"] == mesh_of_stored.headers["etag"]
    assert mesh_of_example.headers["link"] != mesh_of_stored.headers["link"]


def test_304_needs_the_surface_but_no_computation(client: Client, app: FastAPI) -> None:
    url = store_surface(client)["glb"]
    tag = client.get(url, PLAIN).headers["etag"]
    condition = {**PLAIN, "If-None-Match": tag}
    other_app = create_app(Settings())
    with start_client(other_app) as other_client:
        assert other_client.get(url, condition).status_code == 404
        store_surface(other_client)
        response = other_client.get(url, condition)
    assert response.status_code == 304
    assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert len(other_app.state.services.cache) == 0
    assert len(app.state.services.cache) == 1


def test_meshes_of_a_deleted_surface_are_not_found_and_others_stay_cached(
    client: Client, app: FastAPI
) -> None:
    url = store_surface(client)["glb"]
    first = client.get(url)
    link_of_example = client.get("/v1/surfaces/saddle/mesh.glb").headers["link"]
    assert client.request("DELETE", url.rpartition("/")[0]).status_code == 204
    assert client.get(url).status_code == 404
    assert client.get(url, {"If-None-Match": first.headers["etag"]}).status_code == 404
    assert len(app.state.services.cache) == 1, "only the mesh of the example"
    assert client.get("/v1/surfaces/saddle/mesh.glb").headers["link"] == link_of_example
    assert store_surface(client)["glb"] == url
    assert client.get(url).content == first.content


def test_a_mesh_is_not_cached_if_its_surface_is_deleted_during_the_computation(
    client: Client, app: FastAPI, monkeypatch: pytest.MonkeyPatch
) -> None:
    has_begun, may_end = threading.Event(), threading.Event()

    def run_until_allowed(plan: MeshPlan, surface: SurfaceKind) -> MeshFile:
        has_begun.set()
        assert may_end.wait(60)
        return make_file(plan, surface)

    monkeypatch.setattr("service.pipeline.mesh.make_file", run_until_allowed)
    # At this resolution a thread computes, so that the service can delete meanwhile.
    url = store_surface(client)["glb"] + "&resolution=200"
    statuses: list[int] = []
    thread = threading.Thread(target=lambda: statuses.append(client.get(url).status_code))
    thread.start()
    assert has_begun.wait(60)
    assert client.request("DELETE", url.rpartition("/")[0]).status_code == 204
    may_end.set()
    thread.join()
    assert statuses == [200]
    assert len(app.state.services.cache) == 0
    assert client.get(url).status_code == 404


def test_cached_responses_are_sent_without_reading_the_store(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = store_surface(client)["glb"]
    first = client.get(url)

    async def refuse(_store: SurfaceStore, _id: str) -> bytes:
        raise AssertionError("the store was read")

    monkeypatch.setattr(SurfaceStore, "get", refuse)
    monkeypatch.setattr(SurfaceStore, "has", refuse)
    assert client.get(url).content == first.content
    other_spelling = url.replace("?", "?weld=true&")
    assert client.get(other_spelling).content == first.content


def test_a_processor_that_rounds_differently_has_other_tags(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = store_surface(client)["glb"]
    tag = client.get(url, PLAIN).headers["etag"]
    monkeypatch.setattr("service.encoders.libraries.describe_platform", lambda: "another processor")
    with start_client(create_app(Settings())) as other_client:
        store_surface(other_client)
        response = other_client.get(url, {**PLAIN, "If-None-Match": tag})
    assert response.status_code == 200
    assert response.headers["etag"] != tag
