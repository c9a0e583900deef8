"""Jobs of a service that runs: job processes compute them, and results equal those of the calls."""

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest

from service.settings.values import Settings
from tests.cad import ASSEMBLY, OPEN_TETRAHEDRON, STEP, TETRAHEDRON
from tests.forms import PATCH
from tools.live import run_service
from tools.programs import find_program

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    settings = Settings(store=str(tmp_path_factory.mktemp("store")), job_processes=1)
    with run_service(settings) as url, httpx.Client(base_url=url, timeout=60) as client:
        yield client


def follow(service: httpx.Client, job: Any) -> Any:
    """The last state of a job, from its events."""
    with service.stream("GET", job["links"]["events"]) as response:
        lines = [line for line in response.iter_lines() if line.startswith("data: ")]
    return orjson.loads(lines[-1].removeprefix("data: "))


def test_results_equal_those_of_the_calls(service: httpx.Client) -> None:
    points = {"surface": PATCH, "uv": [[0.5, 0.5]]}
    stored = service.post("/v1/surfaces", json={"surface": PATCH}).json()
    mesh_path = f"{stored['links']['self']}/mesh.stl?resolution=3"
    parts = [
        {"name": "lid", "path": "/v1/mesh?format=glb", "body": {"surface": PATCH}},
        {"path": "/v1/points", "body": points},
        {"path": mesh_path},
    ]
    job = service.post("/v1/jobs", json={"parts": parts}).json()
    state = follow(service, job)
    assert (state["state"], state["parts"]["succeeded"]) == ("succeeded", 3)
    expected = [
        service.post("/v1/mesh?format=glb", json={"surface": PATCH}),
        service.post("/v1/points", json=points),
        service.get(mesh_path),
    ]
    listed = service.get(job["links"]["results"]).json()["results"]
    assert [each["name"] for each in listed] == ["lid", "1", "2"]
    for each, response in zip(listed, expected, strict=True):
        result = service.get(each["link"])
        assert result.content == response.content
        assert result.headers["content-type"] == response.headers["content-type"]
        for name in ("surface-vertices", "surface-triangles", "surface-deviation-bound"):
            assert result.headers.get(name) == response.headers.get(name)
    again = service.post("/v1/jobs", json={"parts": parts})
    assert (again.status_code, again.json()["id"]) == (200, job["id"])


def test_a_part_that_fails_has_the_problem_of_its_call(service: httpx.Client) -> None:
    """Only the computation shows that the tolerance is too small."""
    body = {"surface": PATCH, "tolerance": 1e-300}
    problem = service.post("/v1/mesh?format=glb", json=body).json()
    parts = [
        {"path": "/v1/mesh?format=glb", "body": body},
        {"path": "/v1/surfaces/saddle/mesh.glb?resolution=2"},
    ]
    response = service.post("/v1/jobs", json={"parts": parts})
    if response.status_code == 422:  # the shapes show it already
        expected = [e | {"pointer": f"/parts/0/body{e['pointer']}"} for e in problem["errors"]]
        assert response.json()["errors"] == expected
        return
    assert follow(service, response.json())["state"] == "failed"
    listed = service.get(response.json()["links"]["results"]).json()["results"]
    found = [error["pointer"] for error in listed[0]["problem"]["errors"]]
    assert found == [f"/parts/0/body{error['pointer']}" for error in problem["errors"]]


def test_the_commands_of_the_page_work(service: httpx.Client, tmp_path: Path) -> None:
    text = (DOCS / "jobs.md").read_text(encoding="utf-8")
    blocks = [block.partition("\n```")[0] for block in text.split("```sh\n")[1:]]
    script = "\n".join(blocks).replace("http://127.0.0.1:8000", str(service.base_url).rstrip("/"))
    (tmp_path / "part.step").write_bytes(TETRAHEDRON)
    command = [find_program("bash"), "-euc", script]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "event: end" in process.stdout
    assert (tmp_path / "hull.stl").stat().st_size > 84
    names = [
        each["name"] for each in orjson.loads((tmp_path / "results.json").read_bytes())["results"]
    ]
    assert names == ["lid", "hull"]
    assert orjson.loads((tmp_path / "job.json").read_bytes())["parts"]["total"] == 1


def test_a_check_of_a_mesh_file_can_be_a_job(service: httpx.Client) -> None:
    """The surface is stored, and the file goes into the part."""
    id = service.post("/v1/surfaces", json={"surface": PATCH}).json()["id"]
    mesh = service.post("/v1/mesh?format=stl", json={"surface": PATCH, "resolution": 2}).content
    path, headers = f"/v1/check?surface={id}", {"Content-Type": "model/stl"}
    job = service.post(path, content=mesh, headers=headers | {"Prefer": "respond-async"})
    assert (job.status_code, job.headers["preference-applied"]) == (202, "respond-async")
    assert follow(service, job.json())["state"] == "succeeded"
    (listed,) = service.get(job.json()["links"]["results"]).json()["results"]
    result = service.get(listed["link"])
    assert result.content == service.post(path, content=mesh, headers=headers).content
    again = service.post(path, content=mesh, headers=headers | {"Prefer": "respond-async"})
    assert (again.status_code, again.json()["id"]) == (200, job.json()["id"])
    broken = service.post(path, content=mesh[:-9], headers=headers | {"Prefer": "respond-async"})
    assert follow(service, broken.json())["state"] == "failed"
    (listed,) = service.get(broken.json()["links"]["results"]).json()["results"]
    (error,) = listed["problem"]["errors"]
    assert error["pointer"] == "/parts/0/body/mesh/file"


def test_parts_with_a_file_have_the_results_of_the_call(service: httpx.Client) -> None:
    headers = {"Content-Type": STEP}
    file = service.post("/v1/files", content=OPEN_TETRAHEDRON, headers=headers).json()["id"]
    paths = [
        "/v1/mesh?format=glb&tolerance=0.1&name=tip",
        "/v1/convert?invalid_faces=refuse",
        "/v1/convert?format=step",
        "/v1/measure",
    ]
    refused = "/v1/convert?format=vtu"
    parts = [{"path": path, "file": file} for path in (*paths, refused)]
    job = service.post("/v1/jobs", json={"parts": parts}).json()
    state = follow(service, job)
    assert (state["state"], state["parts"]["succeeded"]) == ("failed", 4)
    listed = service.get(job["links"]["results"]).json()["results"]
    for path, each in zip(paths, listed, strict=False):
        response = service.post(path, content=OPEN_TETRAHEDRON, headers=headers)
        result = service.get(each["link"])
        assert result.content == response.content
        assert result.headers["surface-reading"] == "faces=3; skipped=1"
        assert response.headers["surface-reading"] == "faces=3; skipped=1"
        written = response.headers.get("surface-writing")
        assert result.headers.get("surface-writing") == written
        assert (written is not None) == path.endswith("step")
    problem = service.post(refused, content=OPEN_TETRAHEDRON, headers=headers).json()
    assert listed[4]["problem"]["code"] == problem["code"]
    assert listed[4]["problem"]["errors"][0]["pointer"].startswith("/parts/4/path")


@pytest.mark.slow
def test_a_file_that_is_preferred_later_becomes_a_job(service: httpx.Client) -> None:
    path = "/v1/mesh?format=stl&relative_tolerance=0.01"
    headers = {"Content-Type": STEP}
    job = service.post(path, content=ASSEMBLY, headers=headers | {"Prefer": "respond-async"})
    assert job.headers["preference-applied"] == "respond-async"
    assert follow(service, job.json())["state"] == "succeeded"
    result = service.get(f"{job.headers['location']}/results/0")
    assert result.content == service.post(path, content=ASSEMBLY, headers=headers).content
