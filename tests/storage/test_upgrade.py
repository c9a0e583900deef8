"""A store and a keys file of version 0.1.0 work under this version, and under that one again.

`version_0_1_0.zip` was written by version 0.1.0: `store/`, with surfaces of all kinds; `keys`, the
file of `SURFACE_API_KEYS_FILE`; and `key`, the key that belongs to it. `make test-upgrade` runs the
program of version 0.1.0 itself beside this one.
"""

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZipFile

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from service.storage.watch import PROBE_INTERVAL
from tests.clock import Clock
from tools.client import Client, start_client

OLD_FILES = Path(__file__).with_name("version_0_1_0.zip")
NEW_PATCH = {"surface": {"control_net": [[[0, 0, 7], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files of version 0.1.0."""
    with ZipFile(OLD_FILES) as file:
        file.extractall(tmp_path)
    return tmp_path


@pytest.fixture
def client(folder: Path) -> Iterator[Client]:
    """A client of this version of the service, with the old store and the old keys file."""
    settings = Settings(
        store=str(folder / "store"),
        store_create=False,
        api_keys_file=str(folder / "keys"),
        allow_delete=True,
    )
    with start_client(create_app(settings)) as client:
        yield client


def read_objects(folder: Path) -> dict[str, bytes]:
    """The content of each surface in the store, by its path below `surfaces/`."""
    surfaces = folder / "store" / "surfaces"
    return {
        str(path.relative_to(surfaces)): path.read_bytes()
        for path in surfaces.rglob("*")
        if path.is_file()
    }


def test_old_surfaces_and_keys_are_valid_and_keep_their_ids(folder: Path, client: Client) -> None:
    old_objects = read_objects(folder)
    assert len(old_objects) == 17
    headers = {"Authorization": f"Bearer {(folder / 'key').read_text('ascii').strip()}"}
    assert client.post("/v1/surfaces", NEW_PATCH).status_code == 401
    types = set()
    for path in old_objects:
        id = path.partition("/")[2]
        document = client.get(f"/v1/surfaces/{id}").json()
        types.add(document["surface"]["type"])
        assert client.get(f"/v1/surfaces/{id}/mesh.glb?resolution=2").status_code == 200
        response = client.post("/v1/surfaces", {"surface": document["surface"]}, headers)
        assert (response.status_code, response.json()["id"]) == (200, id), "it is stored already"
    assert types == {
        *("bezier", "bspline", "group", "multipatch", "patches", "ribbon", "triangle", "tube")
    }
    assert read_objects(folder) == old_objects


def test_the_old_version_reads_or_ignores_all_files_of_this_one(
    folder: Path, client: Client, clock: Clock
) -> None:
    """Version 0.1.0 lists and reads `surfaces/`, and removes old files from `staging/`.

    It reads nothing else in the folder, and a surface is a file with the SHA-256 of its content.
    """
    old_objects = read_objects(folder)
    headers = {"Authorization": f"Bearer {(folder / 'key').read_text('ascii').strip()}"}
    clock.now += PROBE_INTERVAL
    assert client.get("/health/ready").json()["writes"] == "ready"
    id = client.post("/v1/surfaces", NEW_PATCH, headers).json()["id"]
    deleted = next(iter(old_objects))
    url = f"/v1/surfaces/{deleted.partition('/')[2]}"
    assert client.request("DELETE", url, headers=headers).status_code == 204
    objects = read_objects(folder)
    assert objects.keys() == {*old_objects, f"{id[:2]}/{id}"} - {deleted}
    for path, content in objects.items():
        assert path[3:] == hashlib.sha256(content).hexdigest()
        assert old_objects.get(path, content) == content
    for file in (folder / "store").rglob("*"):
        name = str(file.relative_to(folder / "store"))
        assert re.fullmatch(
            r"staging|surfaces(/[0-9a-f]{2}(/[0-9a-f]{64})?)?|\.surface-(store|probe)", name
        )
    assert (folder / "keys").read_text("ascii").count("\n") == 1
