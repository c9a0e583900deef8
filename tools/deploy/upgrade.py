"""Runs an older version of the service and this one on one store and one keys file.

`make test-upgrade` takes the older version from the Git repository, by a commit or a tag in
`UPGRADE_FROM`; both versions run in the Python environment of this one.
"""

import os
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from tarfile import open as open_tar
from typing import Any

import httpx
import pytest

from service.api.guard.keys import format_entry, make_key
from tools.deploy.traffic import build_patch
from tools.processes import ROOT, Server, free_port, service_environment

KEY = make_key()
HEADERS = {"Authorization": f"Bearer {KEY}"}
COUNT = 5
"""Surfaces that each version stores in each step."""


@pytest.fixture(scope="module")
def older(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the older version of the service."""
    folder = tmp_path_factory.mktemp("older")
    command = ("git", "archive", os.environ["UPGRADE_FROM"], "service")
    archive = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    with open_tar(fileobj=BytesIO(archive)) as tar:
        tar.extractall(folder, filter="data")
    return folder


class Versions:
    """Starts both versions with one store and one keys file, and remembers what they stored."""

    def __init__(self, older: Path, folder: Path) -> None:
        self._folder, self._older = folder, older
        self._numbers = iter(range(10_000))
        self.stored: dict[str, Any] = {}
        """The control nets of all confirmed surfaces, by id."""
        (folder / "keys").write_text(format_entry("anna", KEY) + "\n", encoding="ascii")

    def start_older(self) -> Server:
        return self._build_server("older", self._older)

    def start_newer(self) -> Server:
        return self._build_server("newer", ROOT)

    def _build_server(self, name: str, code: Path) -> Server:
        port = free_port()
        settings = {
            "SURFACE_STORE": str(self._folder / "store"),
            "SURFACE_API_KEYS_FILE": str(self._folder / "keys"),
            "PYTHONPATH": str(code),
        }
        return Server(
            self._folder / f"{name}.log",
            (sys.executable, "-m", "service", "serve", "--port", str(port)),
            port,
            service_environment(settings),
            probe="/health/ready",
            folder=code,
        )

    def store(self, server: Server) -> None:
        """Stores surfaces by one version."""
        with httpx.Client(base_url=server.url) as client:
            for _ in range(COUNT):
                surface = build_patch(next(self._numbers))
                body = {"surface": surface}
                assert client.post("/v1/surfaces", json=body).status_code == 401
                response = client.post("/v1/surfaces", json=body, headers=HEADERS)
                assert response.status_code == 201
                self.stored[response.json()["id"]] = surface["control_net"]

    def check(self, server: Server) -> None:
        """Checks that a version reads all surfaces, and gives all the same ids."""
        with httpx.Client(base_url=server.url) as client:
            assert client.get("/health/ready").status_code == 200
            for id, net in self.stored.items():
                url = f"/v1/surfaces/{id}"
                assert client.get(url).json()["surface"]["control_net"] == net
                assert client.get(f"{url}/mesh.glb?resolution=2").status_code == 200
                body = {"surface": {"control_net": net}}
                response = client.post("/v1/surfaces", json=body, headers=HEADERS)
                assert (response.status_code, response.json()["id"]) == (200, id)


@pytest.fixture
def versions(older: Path, tmp_path: Path) -> Versions:
    return Versions(older, tmp_path)


def test_a_store_survives_an_upgrade_and_a_rollback(versions: Versions) -> None:
    for start in (
        versions.start_older,
        versions.start_newer,
        versions.start_older,
        versions.start_newer,
    ):
        with start() as server:
            versions.check(server)
            versions.store(server)
            versions.check(server)


def test_two_versions_serve_one_store_side_by_side(versions: Versions) -> None:
    with versions.start_older() as older, versions.start_newer() as newer:
        for _ in range(3):
            for server in (older, newer):
                versions.store(server)
                versions.check(older)
                versions.check(newer)
