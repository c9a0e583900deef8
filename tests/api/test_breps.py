"""Breps over HTTP: meshes, reports, estimates, links, storing, signing, and where errors point."""

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from pydantic import SecretStr

from oracles.gltf import read_glb
from oracles.solids import read_solid
from service.api.app import create_app
from service.api.guard.keys import format_entry, make_key
from service.api.models.meshes import Estimate, Mesh
from service.api.responses import BOUND_HEADER, GAP_HEADER, TRIANGLES_HEADER
from service.encoders.registry import FORMATS
from service.settings.values import Settings
from tools.client import Client, start_client

BOX = read_solid("box")
CONE = {"surface": read_solid("cone")}
PLAIN = {"Accept-Encoding": "identity"}


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(Settings(allow_delete=True))) as client:
        yield client


def store(client: Client, body: dict[str, Any], **headers: str) -> dict[str, Any]:
    response = client.post("/v1/surfaces", body, headers)
    assert response.status_code == 201, response.text
    document: dict[str, Any] = response.json()
    return document


def first_error(client: Client, body: dict[str, Any]) -> tuple[str, str]:
    """The code and the pointer of the first error."""
    response = client.post("/v1/mesh", body)
    assert response.status_code == 422, response.text
    error = response.json()["errors"][0]
    return error["code"], error["pointer"]


def test_the_mesh_is_as_described(client: Client) -> None:
    response = client.post("/v1/mesh", {**CONE, "two_sided": True, "relative_tolerance": 0.01})
    assert response.status_code == 200
    mesh = Mesh.model_validate(response.json(), extra="forbid")
    report = mesh.report
    assert report.watertight
    assert report.reached
    assert report.complete
    assert report.skipped_faces == []
    assert report.collapsed_edges is not None
    assert report.collapsed_edges.count == 0
    assert report.parts is not None
    assert len(report.parts) == len(mesh.parts) == len(CONE["surface"]["faces"])
    assert max(part.deviation_bound or 0 for part in report.parts) <= (report.deviation_bound or 0)
    assert float(response.headers[BOUND_HEADER]) == report.deviation_bound
    assert float(response.headers[GAP_HEADER]) == report.gap_bound


def test_files_without_a_report_have_the_bounds_in_headers(client: Client) -> None:
    response = client.post("/v1/mesh", CONE, {"Accept": "model/stl"})
    assert response.status_code == 200
    assert int(response.headers[TRIANGLES_HEADER]) == (len(response.content) - 84) // 50
    assert float(response.headers[BOUND_HEADER]) > 0
    assert float(response.headers[GAP_HEADER]) >= 0
    net = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}
    assert GAP_HEADER not in client.post("/v1/mesh", {"surface": net}).headers


def test_an_estimate_is_as_described(client: Client) -> None:
    response = client.post("/v1/estimate", CONE)
    estimate = Estimate.model_validate(response.json(), extra="forbid")
    assert estimate.accepted
    assert not estimate.certain
    assert not estimate.exact
    assert set(estimate.memory) == {fmt.name for fmt in FORMATS}


@pytest.mark.slow
def test_a_stored_brep_has_meshes_by_url_without_options(client: Client) -> None:
    stored = store(client, CONE)
    links = stored["links"]["mesh"]
    assert list(links) == [fmt.suffix for fmt in FORMATS]
    for fmt in FORMATS:
        url = links[fmt.suffix]
        response = client.get(url, PLAIN)
        assert response.status_code == 200, response.text
        assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
        posted = client.post("/v1/mesh", CONE, {"Accept": fmt.media_type})
        assert posted.content == response.content
        again = client.get(url, {"If-None-Match": response.headers["etag"], **PLAIN})
        assert again.status_code == 304
        assert client.request("HEAD", url, headers=PLAIN).headers["content-length"] == str(
            len(response.content)
        )
    # The same content has the same id, and the document is the body of a request.
    assert client.post("/v1/surfaces", CONE).json()["id"] == stored["id"]
    definition = client.get(f"/v1/surfaces/{stored['id']}").json()
    assert client.post("/v1/mesh", {"surface": definition["surface"]}).status_code == 200


def test_options_of_urls_are_those_of_bodies(client: Client) -> None:
    url = store(client, {"surface": BOX})["links"]["mesh"]["glb"].partition("?")[0]
    edges = client.get(f"{url}?overlays=boundary&max_triangles=12")
    assert edges.status_code == 200
    names = [node["name"] for node in read_glb(edges.content).document["nodes"]]
    assert names == ["box", "box", "boundary"]
    for query in ("resolution=8", "method=de_casteljau", "overlays=control_net"):
        response = client.get(f"{url}?{query}")
        assert response.status_code == 422
        error = response.json()["errors"][0]
        assert (error["code"], error["parameter"]) == ("not_parametric", query.partition("=")[0])


def test_a_deleted_brep_has_no_mesh(client: Client) -> None:
    moved = deepcopy(BOX)
    moved["name"] = "to be deleted"
    stored = store(client, {"surface": moved})
    url = stored["links"]["mesh"]["stl"]
    assert client.get(url).status_code == 200
    assert client.request("DELETE", f"/v1/surfaces/{stored['id']}").status_code == 204
    assert client.get(url).status_code == 404


def test_the_mesh_of_a_private_brep_has_a_signed_url() -> None:
    key = make_key()
    settings = Settings(
        api_keys=(format_entry("alice", key),),
        public_reads=False,
        signing_keys=(SecretStr("0123456789abcdef" * 2),),
    )
    header = {"Authorization": f"Bearer {key}"}
    with start_client(create_app(settings)) as client:
        url = store(client, {"surface": BOX}, **header)["links"]["mesh"]["glb"]
        assert client.get(url).status_code == 401
        signed = client.post("/v1/sign", {"url": url, "seconds": 600}, header).json()["url"]
        assert client.get(signed).status_code == 200


def test_errors_that_only_meshing_shows_point_to_the_entity(client: Client) -> None:
    broken = deepcopy(BOX)
    # The surface of face 2 is far from its edges.
    net = np.array(broken["faces"][2]["surface"]["control_net"]) + 20
    broken["faces"][2]["surface"]["control_net"] = net.tolist()
    code, pointer = first_error(client, {"surface": broken})
    assert code == "edge_not_on_surface"
    assert pointer.startswith("/surface/faces/2/loops/0/edges/")
    members = [{"surface": BOX}, {"surface": broken}]
    code, pointer = first_error(client, {"surface": {"type": "group", "members": members}})
    assert code == "edge_not_on_surface"
    assert pointer.startswith("/surface/members/1/surface/faces/2/loops/0/edges/")


def test_invalid_faces_are_skipped_on_request_and_listed(client: Client) -> None:
    broken = deepcopy(BOX)
    net = np.array(broken["faces"][2]["surface"]["control_net"]) + 20
    broken["faces"][2]["surface"]["control_net"] = net.tolist()
    broken["invalid_faces"] = "skip"
    response = client.post("/v1/mesh", {"surface": broken})
    assert response.status_code == 200
    mesh = Mesh.model_validate(response.json(), extra="forbid")
    (skipped,) = mesh.report.skipped_faces or []
    assert (skipped.face, skipped.code) == (2, "edge_not_on_surface")
    assert mesh.report.complete is False
    assert mesh.report.watertight is False
    assert mesh.report.boundary_edges == 4
    first, last = mesh.parts[2].faces
    assert first == last
