"""Responses over HTTP if a stored surface is damaged, and if the store is full."""

from pathlib import Path

import pytest

from service.api.app import create_app
from service.settings.values import Settings
from tests.storage.backends import list_files
from tools.client import start_client

NET = [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]
PATCH = {"surface": {"control_net": NET}}
OTHER_PATCH = {"surface": {"control_net": [NET[0], [[1, 0, 1], [1, 1, 0.5]]]}}


def test_a_damaged_surface_is_not_sent_until_it_is_stored_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with start_client(create_app(Settings(store=str(tmp_path)))) as client:
        document = client.post("/v1/surfaces", PATCH).json()
        surface_url = document["links"]["self"]
        other_document = client.post("/v1/surfaces", OTHER_PATCH).json()
        files = {path.name: path for path in list_files(tmp_path)}
        files[document["id"]].write_bytes(files[other_document["id"]].read_bytes())
        mesh_url = document["links"]["mesh"]["glb"]
        for url in (surface_url, mesh_url):
            response = client.get(url)
            assert response.status_code == 500
            assert response.json()["code"] == "damaged_object"
            assert response.headers["cache-control"] == "no-store"
            assert str(tmp_path) not in response.text
        assert document["id"] in caplog.text
        assert client.get(other_document["links"]["self"]).status_code == 200
        assert client.post("/v1/surfaces", PATCH).status_code == 201
        net = client.get(surface_url).json()["surface"]["control_net"]
        assert net == NET
        assert client.get(mesh_url).status_code == 200


def test_the_error_of_a_full_store_names_its_free_bytes(tmp_path: Path) -> None:
    # There is room for one of the two surfaces.
    quota = 400
    with start_client(create_app(Settings(store=str(tmp_path), store_quota=quota))) as client:
        assert client.post("/v1/surfaces", PATCH).status_code == 201
        (file,) = list_files(tmp_path)
        size = file.stat().st_size
        response = client.post("/v1/surfaces", OTHER_PATCH)
        assert response.status_code == 507
        assert response.json()["code"] == "store_full"
        (error,) = response.json()["errors"]
        assert (error["code"], error["needed"]) == ("store_full", f"at most {quota - size} bytes")
        assert list_files(tmp_path) == [file]
