"""POST /v1/check: distances that are known, files, options, refused requests, and jobs."""

from base64 import b64encode
from math import pi, sqrt
from typing import Any

import pytest

from service.api.app import create_app
from service.api.models.checks import MeshCheck
from service.settings.values import Settings
from tools.client import Client, start_client

SQUARE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]}
SADDLE = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}
QUAD = {"vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "faces": [[0, 1, 2, 3]]}
TWISTED = {"vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]], "faces": [[0, 1, 2, 3]]}
OFF = b"OFF\n4 1 0\n0 0 0.25\n1 0 0.25\n1 1 0.25\n0 1 0.25\n4 0 1 2 3\n"
OFF_TYPE = {"Content-Type": "model/x-off"}
ASYNC = {"Prefer": "respond-async"}


def check(client: Client, **fields: Any) -> Any:
    """The valid answer to a request with these fields."""
    response = client.post("/v1/check", fields)
    assert response.status_code == 200, response.text
    MeshCheck.model_validate_json(response.content)
    return response.json()


def post_file(
    client: Client, query: str, content: bytes = OFF, headers: dict[str, str] | None = None
) -> Any:
    return client.request("POST", f"/v1/check?{query}", content, OFF_TYPE | (headers or {}))


def contains(interval: dict[str, Any], value: float, width: float = 0.1) -> bool:
    """Whether an interval contains the value, and is as narrow as a share of its upper end."""
    low, high = interval["low"], interval["high"]
    return bool(low <= value <= high and high - low <= width * high)


def test_a_mesh_beside_its_surface_is_as_far_away_everywhere(client: Client) -> None:
    lifted = QUAD | {"vertices": [[x, y, 0.25] for x, y, _ in QUAD["vertices"]]}
    result = check(client, surface=SQUARE, mesh=lifted)
    assert contains(result["surface_to_mesh"], 0.25)
    assert contains(result["mesh_to_surface"], 0.25)
    assert result["reached"]
    assert (result["vertices"], result["triangles"], result["open_edges"]) == (4, 2, 4)
    assert result["max_normal_angle"] < 1e-6
    assert "mesh" not in result


def test_a_hole_is_far_from_the_surface_but_not_the_other_way_round(client: Client) -> None:
    result = check(client, surface=SQUARE, mesh=QUAD | {"faces": [[0, 1, 3]]})
    assert contains(result["surface_to_mesh"], sqrt(0.5))
    assert result["surface_to_mesh"]["point"] == pytest.approx([1, 1, 0])
    assert result["surface_to_mesh"]["uv"] == pytest.approx([1, 1])
    assert result["surface_to_mesh"]["triangle"] == 0
    assert result["mesh_to_surface"]["high"] < 1e-6


def test_the_place_of_the_largest_distance_is_a_point_of_the_surface(client: Client) -> None:
    result = check(client, surface=SADDLE, mesh=TWISTED, relative_tolerance=0.01)
    found = result["surface_to_mesh"]
    # The saddle z = x y is furthest from the triangles of the diagonal x = y in its middle.
    assert contains(found, 0.25 / sqrt(2), 0.01)
    point = client.post("/v1/points", {"surface": SADDLE, "uv": [found["uv"]]}).json()
    assert found["point"] == pytest.approx(point["positions"][0])
    # With the other diagonal two planes are as near: t² = (1 − t)²/√3 where x = y = t.
    other = check(client, surface=SADDLE, mesh=TWISTED, quad_diagonal="13", relative_tolerance=0.01)
    assert contains(other["surface_to_mesh"], 1 / (1 + 3**0.25) ** 2, 0.01)


def test_faults_of_the_mesh_are_counted(client: Client) -> None:
    mesh = {"vertices": QUAD["vertices"], "faces": [[0, 1, 2], [0, 3, 2], [0, 0, 1]]}
    result = check(client, surface=SQUARE, mesh=mesh)
    counts = {name: result[name] for name in ("open_edges", "flipped_edges", "degenerate_faces")}
    assert counts == {"open_edges": 4, "flipped_edges": 1, "degenerate_faces": 1}
    assert result["max_normal_angle"] == pytest.approx(pi)
    assert result["max_normal_angle_triangle"] == 1


def test_distances_of_vertices_come_with_the_mesh(client: Client) -> None:
    mesh = {"vertices": [[0, 0, 0], [1, 0, 0.5], [1, 1, 0.25], [0, 1, 0]], "faces": [[0, 1, 2, 3]]}
    result = check(client, surface=SQUARE, mesh=mesh, distances=True)
    assert result["mesh"] == {"vertices": mesh["vertices"], "faces": [[0, 1, 2], [0, 2, 3]]}
    assert result["distances"] == pytest.approx([0, 0.5, 0.25, 0], abs=0.05)
    assert result["middle_distances"] == pytest.approx([0.25, 1 / 12], abs=0.05)


def test_files_are_bodies_or_fields(client: Client) -> None:
    id = client.post("/v1/surfaces", {"surface": SQUARE}).json()["id"]
    query = f"surface={id}&relative_tolerance=0.05&distances=true&quad_diagonal=13"
    as_body = post_file(client, query)
    assert as_body.status_code == 200, as_body.text
    file = {"file": b64encode(OFF).decode(), "format": "off"}
    options = {"relative_tolerance": 0.05, "distances": True, "quad_diagonal": "13"}
    assert as_body.json() == check(client, surface=SQUARE, mesh=file, **options)
    assert as_body.json()["mesh"]["faces"] == [[0, 1, 3], [1, 2, 3]]
    assert contains(as_body.json()["mesh_to_surface"], 0.25, 0.05)


@pytest.mark.parametrize("format", ["glb", "gltf", "json", "stl"])
def test_meshes_of_this_service_are_as_near_as_their_reports_say(
    client: Client, format: str
) -> None:
    """A surface in millimetres with z up: the root of a glTF file is undone."""
    cylinder = client.get("/v1/surfaces/cylinder").json()["surface"]
    surface = {
        "type": "group",
        "up": "z",
        "metres_per_unit": 0.001,
        "members": [{"surface": cylinder | {"up": "z"}}],
    }
    options = {"tolerance": 0.01, "two_sided": True}
    written = client.post(f"/v1/mesh?format={format}", options | {"surface": surface})
    bound = float(written.headers["surface-deviation-bound"])
    file = {"file": b64encode(written.content).decode(), "format": format}
    mesh = written.json() if format == "json" else file
    result = check(client, surface=surface, mesh=mesh)
    for name in ("surface_to_mesh", "mesh_to_surface"):
        assert 0.001 < result[name]["low"] <= bound
        assert result[name]["high"] < 0.02
    assert result["flipped_edges"] == result["non_manifold_edges"] == 0


@pytest.mark.parametrize(
    ("query", "status", "code", "parameter"),
    [
        ("", 422, "missing_field", "surface"),
        ("surface=nothing", 404, "unknown_surface", "surface"),
        (f"surface={'0' * 64}", 404, "unknown_surface", "surface"),
        ("surface=saddle&surface=sphere", 422, "repeated_key", "surface"),
        ("surface=saddle&mesh=1", 422, "unknown_field", "mesh"),
        ("surface=saddle&up=z", 422, "unknown_field", "up"),
        ("surface=saddle&relative_tolerance=0", 422, "out_of_range", "relative_tolerance"),
        ("surface=saddle&relative_tolerance=x", 422, "wrong_type", "relative_tolerance"),
        ("surface=saddle&quad_diagonal=2", 422, "wrong_value", "quad_diagonal"),
        ("surface=saddle&distances=1", 422, "wrong_type", "distances"),
    ],
)
def test_wrong_queries_beside_a_file_are_refused(
    client: Client, query: str, status: int, code: str, parameter: str
) -> None:
    for headers in ({}, ASYNC):
        response = post_file(client, query, headers=headers)
        error = response.json()["errors"][0]
        assert (response.status_code, error["code"]) == (status, code)
        assert error["parameter"] == parameter


def test_a_surface_stands_in_the_document_or_in_the_query(client: Client) -> None:
    document = {"surface": SQUARE, "mesh": QUAD}
    response = client.post("/v1/check?surface=saddle", document)
    assert response.status_code == 422
    assert response.json()["errors"][0]["parameter"] == "surface"


def test_a_file_that_is_no_mesh_is_refused(client: Client) -> None:
    response = post_file(client, "surface=saddle", b"FFO 1 2 3")
    assert response.status_code == 400
    assert response.json()["errors"][0]["pointer"] == ""
    assert post_file(client, "surface=saddle", b"").status_code == 400
    file = {"file": b64encode(b"FFO 1 2 3").decode(), "format": "off"}
    response = client.post("/v1/check", {"surface": SQUARE, "mesh": file})
    assert response.status_code == 400
    assert response.json()["errors"][0]["pointer"] == "/mesh/file"
    for media_type in ("model/step", "model/x-oogl", "application/octet-stream", ""):
        response = post_file(client, "surface=saddle", headers={"Content-Type": media_type})
        assert response.status_code == 415
        assert "model/gltf-binary" in response.json()["errors"][0]["needed"]


def test_too_large_files_and_documents_are_refused() -> None:
    settings = Settings(max_body_bytes=2000, max_json_bytes=1024)
    with start_client(create_app(settings)) as client:
        response = post_file(client, "surface=saddle", OFF + b" " * 2000)
        assert (response.status_code, response.json()["code"]) == (413, "body_too_large")
        mesh = QUAD | {"faces": [[0, 1, 2]] * 200}
        assert client.post("/v1/check", {"surface": SQUARE, "mesh": mesh}).status_code == 413
        # As a job, this file would be too long: the preference is ignored.
        response = post_file(client, "surface=saddle", OFF + b" " * 1500, ASYNC)
        assert response.status_code == 200
