"""Tests of a service whose disk fills up: `make test-disk`.

The disk is a tmpfs of two megabytes. Mounting one takes root, or the root of a name space of its
own.
"""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.storage.backends import STAGING
from tests.storage.backends import find_file, list_files
from tools.processes import service_server

BALLAST = 1 << 20


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A small disk; a file called `ballast` takes half of it."""
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    if mounted.returncode:
        pytest.skip(
            "no tmpfs can be mounted here: run this as root, or where `unshare --map-root-user "
            f"--mount` is allowed ({mounted.stderr.strip()})"
        )
    try:
        (tmp_path / "ballast").write_bytes(bytes(BALLAST))
        yield tmp_path
    finally:
        subprocess.run(["umount", "--lazy", tmp_path], check=True)


@contextmanager
def start_service(store: Path, folder: Path) -> Iterator[tuple[httpx.Client, Path]]:
    """A client of a service in its own process, and its log; the process must outlive the block."""
    with (
        service_server(folder, {"SURFACE_STORE": str(store)}) as server,
        httpx.Client(base_url=server.url) as client,
    ):
        yield client, server.log


def build_surface(number: int) -> dict[str, Any]:
    """A surface of some 90 kB; each number gives another."""
    size = 61
    net = [[[row, column, number / 7] for column in range(size)] for row in range(size)]
    return {"surface": {"control_net": net}}


def test_full_disk(disk: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    with start_service(disk / "store", tmp_path_factory.mktemp("log")) as (client, log):
        answers: list[httpx.Response] = []
        while not answers or answers[-1].status_code == 201:
            answers.append(client.post("/v1/surfaces", json=build_surface(len(answers))))
        *stored, refused = answers
        assert len(stored) > 5
        _is_full(refused, disk)
        for number in range(3):  # the disk stays full
            _is_full(client.post("/v1/surfaces", json=build_surface(100 + number)), disk)

        # The service still computes meshes, and returns stored surfaces.
        ready = client.get("/health/ready")
        assert (ready.status_code, ready.json()["store"]) == (200, "ready")
        assert client.post("/v1/mesh", json=build_surface(0) | {"resolution": 1}).status_code == 200
        assert client.post("/v1/surfaces", json=build_surface(0)).status_code == 200
        for response in stored:
            assert client.get(response.headers["location"]).status_code == 200

        (disk / "ballast").unlink()
        again = client.post("/v1/surfaces", json=build_surface(len(stored)))
        assert again.status_code == 201
        assert client.get(again.headers["location"]).json() is not None

    # The log is complete only after the service has ended.
    assert "No space left on device" in log.read_text(encoding="utf-8")
    objects = list_files(disk / "store" / "surfaces")
    assert {path.name for path in objects} == {
        response.json()["id"] for response in (*stored, again)
    }
    for path in objects:
        assert path == find_file(disk / "store", path.read_bytes())
    assert list_files(disk / "store" / STAGING) == []


def test_service_starts_on_a_full_disk(
    disk: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    logs = tmp_path_factory.mktemp("log")
    with start_service(disk / "store", logs) as (client, _):
        kept = client.post("/v1/surfaces", json=build_surface(0)).headers["location"]
    with pytest.raises(OSError, match="No space"):
        (disk / "more ballast").write_bytes(bytes(2 * BALLAST))
    with start_service(disk / "store", logs) as (client, _):
        assert client.get(kept).status_code == 200
        _is_full(client.post("/v1/surfaces", json=build_surface(1)), disk)


def _is_full(response: httpx.Response, disk: Path) -> None:
    assert response.status_code == 507
    assert response.headers["content-type"] == "application/problem+json"
    problem = response.json()
    assert problem["code"] == "store_full"
    assert [error["code"] for error in problem["errors"]] == ["disk_full"]
    assert str(disk) not in response.text
