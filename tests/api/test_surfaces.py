"""Surfaces with an address: stored, given back, deleted; one id for one content."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from hashlib import sha256
from io import BytesIO
from random import Random
from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.encoders.format import Format
from service.encoders.registry import FORMATS
from service.errors import StoreFailed, StoreFull
from service.settings.values import Settings
from service.storage.canonical import canonical, surface_id
from service.surface.examples import EXAMPLES, find
from tests.api.client import Client, client_of
from tests.api.hostile import ECHO
from tests.forms import PATCH, SURFACES
from tests.spellings import spelled

JSON = {"Content-Type": "application/json"}
FOR_EVER = "public, max-age=31536000, immutable"
AN_HOUR = "public, max-age=3600, must-revalidate"
NO_ID = "0" * 64
ID = surface_id(canonical(find("saddle").surface()))


@pytest.fixture
def fresh() -> Iterator[Client]:
    """A client of a service that has stored nothing yet, and lets surfaces be deleted."""
    with client_of(create_app(Settings(allow_delete=True))) as client:
        yield client


def stored(client: Client, surface: Any) -> str:
    """The address of a surface."""
    return str(client.post("/v1/surfaces", {"surface": surface}).headers["location"])


def test_a_surface_is_stored_once(fresh: Client) -> None:
    document = fresh.get("/v1/surfaces/saddle").json()
    for status in (201, 200, 200):
        answer = fresh.post("/v1/surfaces", document)
        assert answer.status_code == status
        assert answer.headers["location"] == f"/v1/surfaces/{ID}"
        assert answer.json()["id"] == ID
        assert answer.json()["links"]["self"] == f"/v1/surfaces/{ID}"
        assert answer.json()["links"]["mesh"]["glb"] == f"/v1/surfaces/{ID}/mesh.glb?engine=2"


@pytest.mark.parametrize("name", SURFACES)
def test_a_stored_surface_is_given_back(client: Client, name: str) -> None:
    """As a document that is the same surface, and has the same mesh."""
    address = stored(client, SURFACES[name])
    answer = client.get(address)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/json"
    assert answer.headers["etag"] == f'"{address.rpartition("/")[2]}"'
    assert answer.headers["cache-control"] == FOR_EVER
    again = client.post("/v1/surfaces", answer.json())
    assert (again.status_code, again.headers["location"]) == (200, address)
    meshes = {
        client.post("/v1/mesh?format=json", {**document, "resolution": 2}).content
        for document in (answer.json(), {"surface": SURFACES[name]})
    }
    assert len(meshes) == 1


def test_some_hundred_spellings_have_one_id_each(client: Client) -> None:
    """Ten thousand of them stand in the tests of the language."""
    random = Random(3)
    for surface in SURFACES.values():
        texts = [f'{{"surface":{spelled(surface, random)}}}'.encode() for _ in range(20)]
        answers = [client.request("POST", "/v1/surfaces", text, JSON) for text in texts]
        assert {answer.status_code for answer in answers} <= {201, 200}
        assert len({answer.content for answer in answers}) == 1


@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_every_spelling_has_the_mesh_of_the_stored_surface(client: Client, fmt: Format) -> None:
    random = Random(4)
    for surface in SURFACES.values():
        address = f"{stored(client, surface)}/mesh.{fmt.suffix}"
        fetched = client.get(f"{address}?resolution=2&engine=2")
        assert fetched.status_code == 200
        assert fetched.headers["cache-control"] == FOR_EVER
        body = f'{{"surface":{spelled(surface, random)},"resolution":2}}'.encode()
        posted = client.request("POST", f"/v1/mesh?format={fmt.name}", body, JSON)
        assert posted.content == fetched.content


def test_examples_are_surfaces_too(client: Client) -> None:
    for name in EXAMPLES:
        answer = client.get(f"/v1/surfaces/{name}")
        content = canonical(find(name).surface())
        assert answer.headers["etag"] == f'"{sha256(content).hexdigest()}"'
        assert answer.headers["cache-control"] == AN_HOUR
        assert client.post("/v1/surfaces", answer.json()).json()["id"] == surface_id(content)


@pytest.mark.parametrize("listed", ['"{tag}"', 'W/"{tag}"', '"other", "{tag}"', "*"])
def test_what_the_client_has_is_not_sent_again(client: Client, listed: str) -> None:
    address = stored(client, PATCH)
    for where in (address, "/v1/surfaces/saddle"):
        tag = client.get(where).headers["etag"].strip('"')
        answer = client.get(where, {"If-None-Match": listed.format(tag=tag)})
        assert (answer.status_code, answer.content) == (304, b"")
        assert answer.headers["etag"] == f'"{tag}"'
        assert answer.headers["cache-control"] == client.get(where).headers["cache-control"]
        assert client.get(where, {"If-None-Match": '"other"'}).status_code == 200


def test_what_is_not_there_is_not_unchanged(client: Client) -> None:
    for condition in (f'"{NO_ID}"', "*"):
        answer = client.get(f"/v1/surfaces/{NO_ID}", {"If-None-Match": condition})
        assert answer.status_code == 404


def test_the_head_is_that_of_the_whole(client: Client) -> None:
    address = stored(client, PATCH)
    whole, head = client.get(address), client.request("HEAD", address)
    assert head.content == b""
    timed = {"server-timing"}
    assert set(head.headers) == set(whole.headers)
    assert all(head.headers[name] == whole.headers[name] for name in set(whole.headers) - timed)


@pytest.mark.parametrize(
    "id", [NO_ID, ID[:-1], f"{ID}0", ID.upper(), "teapot", "..", "%00", f" {ID}", "é", "x" * 5000]
)
@pytest.mark.parametrize("method", ["GET", "HEAD", "DELETE"])
def test_unknown_ids(fresh: Client, id: str, method: str) -> None:
    stored(fresh, fresh.get("/v1/surfaces/saddle").json()["surface"])
    answer = fresh.request(method, f"/v1/surfaces/{id}")
    assert answer.status_code == 404
    if method != "HEAD" and id != "..":
        error = answer.json()["errors"][0]
        assert (error["code"], error["parameter"]) == ("unknown_surface", "id")
        assert "x" * 9 not in answer.text


def test_links_stay_below_the_path_the_service_is_mounted_at() -> None:
    app = create_app(Settings())
    app.root_path = "/shapes"
    with client_of(app) as client:
        answer = client.post("/v1/surfaces", {"surface": PATCH})
        links = answer.json()["links"]
        addresses = [answer.headers["location"], links["self"], *links["mesh"].values()]
        assert all(address.startswith("/shapes/v1/surfaces/") for address in addresses)
        assert client.get(links["self"]).status_code == 200


def test_a_surface_is_deleted(fresh: Client) -> None:
    address = stored(fresh, PATCH)
    answer = fresh.request("DELETE", address)
    assert (answer.status_code, answer.content) == (204, b"")
    assert fresh.get(address).status_code == 404
    assert fresh.request("DELETE", address).status_code == 404
    assert fresh.post("/v1/surfaces", {"surface": PATCH}).status_code == 201
    assert fresh.get(address).status_code == 200


def test_nothing_is_deleted_unless_it_is_allowed(client: Client) -> None:
    address = stored(client, PATCH)
    for where in (address, f"/v1/surfaces/{NO_ID}", "/v1/surfaces/saddle"):
        answer = client.request("DELETE", where)
        assert answer.status_code == 405
        assert answer.json()["code"] == "method_not_allowed"
        assert set(answer.headers["allow"].split(", ")) == {"GET", "HEAD"}
    assert client.get(address).status_code == 200


def test_examples_stay(fresh: Client) -> None:
    answer = fresh.request("DELETE", "/v1/surfaces/saddle")
    assert answer.status_code == 405
    assert set(answer.headers["allow"].split(", ")) == {"GET", "HEAD"}
    others = fresh.request("PUT", f"/v1/surfaces/{NO_ID}").headers["allow"]
    assert set(others.split(", ")) == {"GET", "HEAD", "DELETE"}


@pytest.mark.parametrize("method", ["POST", "GET", "DELETE"])
def test_parameters_are_refused(fresh: Client, method: str) -> None:
    address = "/v1/surfaces" if method == "POST" else stored(fresh, PATCH)
    answer = fresh.request(method, f"{address}?engine=2", b"{}", JSON)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["parameter"] == "engine"


def test_a_surface_and_nothing_else(client: Client) -> None:
    answer = client.post("/v1/surfaces", {"surface": PATCH, "resolution": 4, "name": ECHO})
    assert answer.status_code == 422
    errors = [(error["code"], error["pointer"]) for error in answer.json()["errors"]]
    assert errors == [("unknown_field", "/resolution"), ("unknown_field", "/name")]
    assert client.post("/v1/surfaces", PATCH).json()["errors"][0]["pointer"] == "/surface"


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
def test_bodies_are_those_of_other_calls(headers: dict[str, str], body: bytes, status: int) -> None:
    with client_of(create_app(Settings(max_body_bytes=1024))) as client:
        assert client.request("POST", "/v1/surfaces", body, headers).status_code == status


def test_a_file_is_the_surface_that_json_would_say(client: Client) -> None:
    """float32 or float64: these numbers are the same in both."""
    net = np.array(PATCH["control_net"]) + 0.5
    document = {"surface": {"control_net": net.tolist(), "name": "sail", "up": "z"}}
    wanted = client.post("/v1/surfaces", document).json()["id"]
    for dtype in ("<f4", ">f8"):
        file = BytesIO()
        np.save(file, net.astype(dtype))
        address = "/v1/surfaces?name=sail&up=z"
        headers = {"Content-Type": "application/x-npy"}
        answer = client.request("POST", address, file.getvalue(), headers)
        assert (answer.status_code, answer.json()["id"]) == (200, wanted)
        answer = client.request("POST", f"{address}&resolution=4", file.getvalue(), headers)
        error = answer.json()["errors"][0]
        assert (error["code"], error["parameter"]) == ("unknown_field", "resolution")


def test_a_surface_of_wider_limits_is_refused() -> None:
    """With a reason, and as what was asked for: the id."""
    wide, narrow = create_app(Settings()), create_app(Settings(max_control_points=5))
    narrow.state.services = replace(narrow.state.services, store=wide.state.services.store)
    with client_of(wide) as client:
        address = stored(client, PATCH)
    with client_of(narrow) as client:
        answer = client.get(address)
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert (error["code"], error["parameter"]) == ("too_many_control_points", "id")


def test_a_definition_that_would_be_too_long_is_refused() -> None:
    wide, narrow = create_app(Settings()), create_app(Settings(max_response_bytes=1024))
    narrow.state.services = replace(narrow.state.services, store=wide.state.services.store)
    with client_of(wide) as client:
        address = stored(client, SURFACES["bspline"])
    with client_of(narrow) as client:
        answer = client.get(address)
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert (error["code"], error["parameter"]) == ("too_many_bytes", "id")


def test_whole_objects_that_are_no_surfaces(caplog: pytest.LogCaptureFixture) -> None:
    """Somebody else's, under their own hashes: they are not given out, and the log says so."""
    content = b"no surface\n"
    id = surface_id(content)
    app = create_app(Settings())
    with client_of(app) as client, caplog.at_level(logging.ERROR):
        client.call(app.state.services.store.put, id, content)
        answer = client.get(f"/v1/surfaces/{id}")
    assert answer.status_code == 500
    assert answer.json()["code"] == "damaged_object"
    assert id in caplog.text


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [(StoreFull, 507, "store_full"), (StoreFailed, 503, "store_unavailable")],
)
def test_a_store_that_does_not_work(
    error: Callable[[], Exception], status: int, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = create_app(Settings())

    async def fails(*_: object) -> bool:
        raise error()

    monkeypatch.setattr(app.state.services.store, "put", fails)
    with client_of(app) as client:
        answer = client.post("/v1/surfaces", {"surface": PATCH})
    assert answer.status_code == status
    assert answer.json()["code"] == code
    assert answer.headers["cache-control"] == "no-store"


def test_a_quota_is_respected() -> None:
    with client_of(create_app(Settings(store_quota=400))) as client:
        assert client.post("/v1/surfaces", {"surface": PATCH}).status_code == 201
        answer = client.post("/v1/surfaces", {"surface": SURFACES["bspline"]})
        assert answer.status_code == 507
        assert client.post("/v1/surfaces", {"surface": PATCH}).status_code == 200


def test_a_large_surface_is_stored_in_a_thread(client: Client) -> None:
    net = [[[i / 7, j / 7, (i * j) % 5] for j in range(120)] for i in range(120)]
    surface = {"type": "bspline", "control_net": net}
    address = stored(client, surface)
    assert client.get(address).json()["surface"]["control_net"] == net
