"""Tests of a service whose disk becomes full: `make test-disk`.

The disk is a tmpfs of two megabytes. To mount it, a process must be root, at least in a name space
of its own (`unshare --map-root-user --mount`).
"""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.storage.folder import STAGING
from tests.storage.backends import compute_path, list_files
from tools.processes import service_server

BALLAST_BYTES = 1 << 20


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """The folder of a small disk; a file named `ballast` fills half of the disk."""
    process = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    if process.returncode:
        pytest.skip(
            "no tmpfs can be mounted here: run this as root, or where `unshare --map-root-user "
            f"--mount` is allowed ({process.stderr.strip()})"
        )
    try:
        (tmp_path / "ballast").write_bytes(bytes(BALLAST_BYTES))
        yield tmp_path
    finally:
        subprocess.run(["umount", "--lazy", tmp_path], check=True)


@contextmanager
def start_service(store: Path, folder: Path) -> Iterator[tuple[httpx.Client, Path]]:
    """Starts a service in its own process; yields a client of the service and the path of its log.

    An error is raised if the service ends before the end of the block.
    """
    with (
        service_server(folder, {"SURFACE_STORE": str(store)}) as server,
        httpx.Client(base_url=server.url) as client,
    ):
        yield client, server.log


def build_surface(number: int) -> dict[str, Any]:
    """A request to store a surface of about 90 kB; each number gives another surface."""
    size = 61
    net = [[[row, column, number / 7] for column in range(size)] for row in range(size)]
    return {"surface": {"control_net": net}}


def test_on_a_full_disk_the_service_refuses_to_store_and_all_else_works(
    disk: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with start_service(disk / "store", tmp_path_factory.mktemp("log")) as (client, log):
        responses: list[httpx.Response] = []
        while not responses or responses[-1].status_code == 201:
            responses.append(client.post("/v1/surfaces", json=build_surface(len(responses))))
        *successes, refusal = responses
        assert len(successes) > 5  # the disk has 1 MiB for surfaces of 90 kB
        assert_disk_full(refusal, disk)
        for number in range(3):  # the disk stays full
            assert_disk_full(client.post("/v1/surfaces", json=build_surface(100 + number)), disk)

        # The service still computes meshes, and returns stored surfaces.
        health = client.get("/health/ready")
        assert (health.status_code, health.json()["store"]) == (200, "ready")
        assert client.post("/v1/mesh", json=build_surface(0) | {"resolution": 1}).status_code == 200
        # Storing a surface again needs no space, and its status is 200 in place of 201.
        assert client.post("/v1/surfaces", json=build_surface(0)).status_code == 200
        for response in successes:
            assert client.get(response.headers["location"]).status_code == 200

        (disk / "ballast").unlink()
        last_response = client.post("/v1/surfaces", json=build_surface(len(successes)))
        assert last_response.status_code == 201
        assert client.get(last_response.headers["location"]).json() is not None

    # The log is complete only after the service has ended.
    assert "No space left on device" in log.read_text(encoding="utf-8")
    objects = list_files(disk / "store" / "surfaces")
    assert {path.name for path in objects} == {
        response.json()["id"] for response in (*successes, last_response)
    }
    # The content of every file is complete: the path in the store depends on the content.
    for path in objects:
        assert path == compute_path(disk / "store", path.read_bytes())
    assert list_files(disk / "store" / STAGING) == []


def test_a_service_starts_on_a_full_disk(
    disk: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    logs = tmp_path_factory.mktemp("log")
    with start_service(disk / "store", logs) as (client, _):
        path_of_surface = client.post("/v1/surfaces", json=build_surface(0)).headers["location"]
    with pytest.raises(OSError, match="No space"):
        (disk / "more ballast").write_bytes(bytes(2 * BALLAST_BYTES))
    with start_service(disk / "store", logs) as (client, _):
        assert client.get(path_of_surface).status_code == 200
        assert_disk_full(client.post("/v1/surfaces", json=build_surface(1)), disk)


def assert_disk_full(response: httpx.Response, disk: Path) -> None:
    """Checks that the problem is `store_full` with the issue `disk_full`, without the folder."""
    assert response.status_code == 507
    assert response.headers["content-type"] == "application/problem+json"
    problem = response.json()
    assert problem["code"] == "store_full"
    assert [error["code"] for error in problem["errors"]] == ["disk_full"]
    assert str(disk) not in response.text
