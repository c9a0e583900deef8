"""Surfaces by URL: clients store, read and delete them; equal surfaces have one id."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from hashlib import sha256
from typing import Any

import pytest

from service.api.app import create_app
from service.engine.mesh.mesh import ENGINE
from service.errors import StoreFailed, StoreFull
from service.settings.values import Settings
from service.storage.canonical import canonical_content, surface_id
from service.surface.examples.catalogue import EXAMPLES, find
from tests.forms import PATCH, SURFACES
from tools.client import Client, start_client

JSON = {"Content-Type": "application/json"}
FOR_EVER = "public, max-age=31536000, immutable"
AN_HOUR = "public, max-age=3600, must-revalidate"
NO_ID = "0" * 64
ID = surface_id(canonical_content(find("saddle").surface()))


@pytest.fixture
def fresh_client() -> Iterator[Client]:
    """A client of a service with an empty store, which allows deletion."""
    with start_client(create_app(Settings(allow_delete=True))) as client:
        yield client


def store_surface(client: Client, surface: Any) -> str:
    """Stores a surface and returns its URL."""
    return str(client.post("/v1/surfaces", {"surface": surface}).headers["location"])


def test_a_surface_is_stored_once(fresh_client: Client) -> None:
    document = fresh_client.get("/v1/surfaces/saddle").json()
    mesh_url = f"/v1/surfaces/{ID}/mesh.glb?engine={ENGINE}"
    for status in (201, 200, 200):
        response = fresh_client.post("/v1/surfaces", document)
        assert response.status_code == status
        assert response.headers["location"] == f"/v1/surfaces/{ID}"
        assert response.json()["id"] == ID
        assert response.json()["links"]["self"] == f"/v1/surfaces/{ID}"
        assert response.json()["links"]["mesh"]["glb"] == mesh_url
        image_url = f"/v1/surfaces/{ID}/image.png?engine={ENGINE}"
        assert response.json()["links"]["image"] == image_url


@pytest.mark.parametrize("name", SURFACES)
def test_a_stored_surface_is_returned(client: Client, name: str) -> None:
    """The response is the document of the same surface, and has the same mesh."""
    url = store_surface(client, SURFACES[name])
    response = client.get(url)
    assert response.status_code == 200
    assert response.headers["content-type"] == "application/json"
    assert response.headers["etag"] == f'"{url.rpartition("/")[2]}"'
    assert response.headers["cache-control"] == FOR_EVER
    second_response = client.post("/v1/surfaces", response.json())
    assert (second_response.status_code, second_response.headers["location"]) == (200, url)
    meshes = {
        client.post("/v1/mesh?format=json", {**document, "resolution": 2}).content
        for document in (response.json(), {"surface": SURFACES[name]})
    }
    assert len(meshes) == 1


def test_examples_are_returned_like_stored_surfaces(client: Client) -> None:
    for name in EXAMPLES:
        response = client.get(f"/v1/surfaces/{name}")
        content = canonical_content(find(name).surface())
        assert response.headers["etag"] == f'"{sha256(content).hexdigest()}"'
        assert response.headers["cache-control"] == AN_HOUR
        assert client.post("/v1/surfaces", response.json()).json()["id"] == surface_id(content)


@pytest.mark.parametrize("condition", ['"{tag}"', 'W/"{tag}"', '"other", "{tag}"', "*"])
def test_an_unchanged_surface_is_not_sent_again(client: Client, condition: str) -> None:
    for url in (store_surface(client, PATCH), "/v1/surfaces/saddle"):
        tag = client.get(url).headers["etag"].strip('"')
        response = client.get(url, {"If-None-Match": condition.format(tag=tag)})
        assert (response.status_code, response.content) == (304, b"")
        assert response.headers["etag"] == f'"{tag}"'
        assert response.headers["cache-control"] == client.get(url).headers["cache-control"]
        assert client.get(url, {"If-None-Match": '"other"'}).status_code == 200


def test_a_missing_surface_never_gets_304(client: Client) -> None:
    for condition in (f'"{NO_ID}"', "*"):
        response = client.get(f"/v1/surfaces/{NO_ID}", {"If-None-Match": condition})
        assert response.status_code == 404


@pytest.mark.slow
@pytest.mark.parametrize(
    "id", [NO_ID, ID[:-1], f"{ID}0", ID.upper(), "teapot", "..", "%00", f" {ID}", "é", "x" * 5000]
)
@pytest.mark.parametrize("method", ["GET", "HEAD", "DELETE"])
def test_unknown_ids_are_not_found(fresh_client: Client, id: str, method: str) -> None:
    store_surface(fresh_client, fresh_client.get("/v1/surfaces/saddle").json()["surface"])
    response = fresh_client.request(method, f"/v1/surfaces/{id}")
    assert response.status_code == 404
    if method != "HEAD" and id != "..":  # httpx resolves "..", so that the URL is /v1
        error = response.json()["errors"][0]
        assert (error["code"], error["parameter"]) == ("unknown_surface", "id")
        assert "x" * 9 not in response.text, "the error repeats the long id"


def test_a_surface_is_deleted(fresh_client: Client) -> None:
    url = store_surface(fresh_client, PATCH)
    response = fresh_client.request("DELETE", url)
    assert (response.status_code, response.content) == (204, b"")
    assert fresh_client.get(url).status_code == 404
    assert fresh_client.request("DELETE", url).status_code == 404
    assert fresh_client.post("/v1/surfaces", {"surface": PATCH}).status_code == 201
    assert fresh_client.get(url).status_code == 200


def test_deletion_is_refused_unless_the_settings_allow_it(client: Client) -> None:
    stored_url = store_surface(client, PATCH)
    for url in (stored_url, f"/v1/surfaces/{NO_ID}", "/v1/surfaces/saddle"):
        response = client.request("DELETE", url)
        assert response.status_code == 405
        assert response.json()["code"] == "method_not_allowed"
        assert set(response.headers["allow"].split(", ")) == {"GET", "HEAD"}
    assert client.get(stored_url).status_code == 200


def test_examples_cannot_be_deleted(fresh_client: Client) -> None:
    response = fresh_client.request("DELETE", "/v1/surfaces/saddle")
    assert response.status_code == 405
    assert set(response.headers["allow"].split(", ")) == {"GET", "HEAD"}
    allowed_methods = fresh_client.request("PUT", f"/v1/surfaces/{NO_ID}").headers["allow"]
    assert set(allowed_methods.split(", ")) == {"GET", "HEAD", "DELETE"}


@pytest.mark.parametrize(
    ("headers", "body", "status"),
    [
        ({"Content-Type": "text/plain"}, b"{}", 415),
        ({"Content-Type": "application/json", "Content-Encoding": "gzip"}, b"{}", 415),
        ({}, b"{}", 415),
        (JSON, b" " * 2000, 413),
        (JSON, b"{", 400),
    ],
)
def test_invalid_bodies_are_refused(headers: dict[str, str], body: bytes, status: int) -> None:
    with start_client(create_app(Settings(max_body_bytes=1024))) as client:
        assert client.request("POST", "/v1/surfaces", body, headers).status_code == status


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        (Settings(max_control_points=5), "too_many_control_points"),
        (Settings(max_degree=2), "degree_too_high"),
        (Settings(max_response_bytes=1024), "too_many_bytes"),
    ],
)
def test_a_stored_surface_above_the_limits_is_refused(settings: Settings, code: str) -> None:
    """Another instance with wider limits stored the surface. The error names the parameter `id`."""
    unlimited_app, limited_app = create_app(Settings()), create_app(settings)
    limited_app.state.services = replace(
        limited_app.state.services, store=unlimited_app.state.services.store
    )
    with start_client(unlimited_app) as client:
        url = store_surface(client, SURFACES["bspline"])
    with start_client(limited_app) as client:
        response = client.get(url)
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["code"], error["parameter"]) == (code, "id")


def test_an_object_that_is_not_a_surface_is_logged_and_not_sent(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Another program may store a content of its own under the right hash."""
    content = b"no surface\n"
    id = surface_id(content)
    app = create_app(Settings())
    with start_client(app) as client, caplog.at_level(logging.ERROR):
        client.call(app.state.services.store.put, id, content)
        response = client.get(f"/v1/surfaces/{id}")
    assert response.status_code == 500
    assert response.json()["code"] == "damaged_object"
    assert id in caplog.text


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [(StoreFull, 507, "store_full"), (StoreFailed, 503, "store_unavailable")],
)
def test_errors_of_the_store_have_statuses(
    error: Callable[[], Exception], status: int, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = create_app(Settings())

    async def raise_error(*_: object) -> bool:
        raise error()

    monkeypatch.setattr(app.state.services.store, "put", raise_error)
    with start_client(app) as client:
        response = client.post("/v1/surfaces", {"surface": PATCH})
    assert response.status_code == status
    assert response.json()["code"] == code
    assert response.headers["cache-control"] == "no-store"


def test_a_large_surface_is_stored_and_returned(client: Client) -> None:
    """A thread computes its content, because that takes too long for the event loop."""
    net = [[[i / 7, j / 7, (i * j) % 5] for j in range(120)] for i in range(120)]
    surface = {"type": "bspline", "control_net": net}
    url = store_surface(client, surface)
    assert client.get(url).json()["surface"]["control_net"] == net
