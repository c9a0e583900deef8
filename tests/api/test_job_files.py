"""Files for parts of jobs: storing them, naming them, and a call with a file as a job."""

from collections.abc import Iterator
from hashlib import sha256

import httpx
import orjson
import pytest

from service.api.app import create_app
from service.api.guard.keys import format_entry, make_key
from service.settings.values import Settings
from tests.api.test_jobs import ASYNC, NDJSON, Service, start_service
from tests.cad import STEP, TETRAHEDRON
from tools.client import Client, start_client
from tools.hostile.files import NPY, build_net, save_array

ID = f"{sha256(TETRAHEDRON).hexdigest()}.step"


@pytest.fixture
def service() -> Iterator[Service]:
    yield from start_service(Settings())


def store(
    client: Client, content: bytes = TETRAHEDRON, media_type: str = STEP, query: str = ""
) -> httpx.Response:
    return client.request("POST", f"/v1/files{query}", content, {"Content-Type": media_type})


def test_a_file_has_the_hash_of_its_bytes(service: Service) -> None:
    first, second = store(service.client), store(service.client)
    assert (first.status_code, second.status_code) == (201, 200)
    assert first.json() == second.json() == {"id": ID, "bytes": len(TETRAHEDRON)}
    assert first.headers["cache-control"] == "no-store"
    assert store(service.client, save_array(build_net()), NPY).json()["id"].endswith(".npy")


def test_a_part_names_a_file(service: Service) -> None:
    store(service.client)
    part = {"name": "tip", "path": "/v1/mesh?format=glb&tolerance=0.1", "file": ID}
    response = service.client.post("/v1/jobs", {"parts": [part]})
    assert response.status_code == 202
    line = orjson.loads(service.jobs.lines[0])
    assert {name: line[name] for name in part} == part
    lines = service.client.request("POST", "/v1/jobs", orjson.dumps(part), NDJSON)
    assert lines.json()["id"] == response.json()["id"]


def test_a_call_with_a_file_can_be_a_job(service: Service) -> None:
    path = "/v1/mesh?format=glb&tolerance=0.1&name=tip"
    headers = ASYNC | {"Content-Type": STEP}
    response = service.client.request("POST", path, TETRAHEDRON, headers)
    assert response.status_code == 202
    assert response.headers["preference-applied"] == "respond-async"
    job = service.client.post("/v1/jobs", {"parts": [{"path": path, "file": ID}]})
    assert job.json()["id"] == response.json()["id"]
    accepting = headers | {"Accept": "model/gltf-binary"}
    other = service.client.request(
        "POST", "/v1/mesh?tolerance=0.1&name=tip", TETRAHEDRON, accepting
    )
    assert other.json()["id"] == response.json()["id"]


@pytest.mark.parametrize(
    ("query", "parameter"),
    [("tolerance=0", "tolerance"), ("degree=2", "degree"), ("up=x", "up"), ("x=1", "x")],
)
def test_errors_beside_a_file_are_those_of_the_call(
    service: Service, query: str, parameter: str
) -> None:
    headers = {"Content-Type": STEP}
    path = f"/v1/mesh?{query}"
    response = service.client.request("POST", path, TETRAHEDRON, headers | ASYNC)
    assert response.status_code == 422
    assert response.json()["errors"][0]["parameter"] == parameter
    assert response.json() == service.client.request("POST", path, TETRAHEDRON, headers).json()
    assert service.jobs.states == {}


def test_files_of_rays_and_other_calls_are_answered_at_once(service: Service) -> None:
    rays = save_array(build_net()[:, 0].repeat(2, axis=1))
    headers = ASYNC | {"Content-Type": NPY}
    response = service.client.request("POST", "/v1/intersect?surface=sphere", rays, headers)
    assert response.status_code == 200
    headers = ASYNC | {"Content-Type": STEP}
    response = service.client.request("POST", "/v1/estimate", TETRAHEDRON, headers)
    assert response.status_code == 200
    assert service.jobs.states == {}


def test_a_part_with_an_unknown_file_is_refused(service: Service) -> None:
    for id, code in ((ID, "unknown_file"), ("x", "wrong_value"), (5, "wrong_type")):
        part = {"path": "/v1/mesh", "file": id}
        response = service.client.post("/v1/jobs", {"parts": [{"path": "/v1/mesh", **part}]})
        error = response.json()["errors"][0]
        assert (response.status_code, error["code"]) == (422, code)
        assert error["pointer"] == "/parts/0/file"
    assert service.jobs.discarded > 0


def test_other_bodies_and_parameters_are_refused(service: Service) -> None:
    for media_type in ("application/json", "text/plain", ""):
        assert store(service.client, b"{}", media_type).status_code == 415
    needed = store(service.client, b"{}", "application/json").json()["errors"][0]["needed"]
    assert "application/json" not in needed
    assert "model/step" in needed
    assert store(service.client, query="?tolerance=1").status_code == 422


def test_storing_a_file_needs_a_key_that_computes() -> None:
    reader, computer = make_key(), make_key()
    entries = (
        format_entry("reader", reader, frozenset({"read"})),
        format_entry("computer", computer, frozenset({"compute"})),
    )
    with start_client(create_app(Settings(api_keys=entries))) as client:
        for key, status in (("", 401), (reader, 403), (computer, 201)):
            headers = {"Content-Type": STEP} | ({"Authorization": f"Bearer {key}"} if key else {})
            response = client.request("POST", "/v1/files", TETRAHEDRON, headers)
            assert response.status_code == status


def test_a_service_without_jobs_keeps_no_files() -> None:
    with start_client(create_app(Settings(jobs=False))) as client:
        assert store(client).status_code == 404
        headers = ASYNC | {"Content-Type": STEP}
        response = client.request("POST", "/v1/mesh", TETRAHEDRON, headers)
        assert response.status_code == 200
        assert "preference-applied" not in response.headers


def test_a_file_that_is_too_long_is_refused() -> None:
    with start_client(create_app(Settings(max_body_bytes=1024))) as client:
        assert store(client).status_code == 413
