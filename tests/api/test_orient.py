"""The operation `orient`, and the option of meshes: in bodies, in URLs and on the command line."""

import json
from pathlib import Path
from typing import Any

import pytest

from oracles.gltf import read_glb
from service.cli.main import main
from tools.client import Client

PLATE: dict[str, Any] = {
    "type": "multipatch",
    "surfaces": [
        {"control_net": [[[-2, -2, 0], [-1, -1, 0]], [[2, -2, 0], [1, -1, 0]]]},
        {"control_net": [[[2, -2, 0], [1, -1, 0]], [[2, 2, 0], [1, 1, 0]]]},
        {"control_net": [[[-2, 2, 0], [-1, 1, 0]], [[2, 2, 0], [1, 1, 0]]]},
        {"control_net": [[[-2, 2, 0], [-1, 1, 0]], [[-2, -2, 0], [-1, -1, 0]]]},
    ],
}
"""A square plate with a square hole; the third patch is turned to the other side."""

MOEBIUS: dict[str, Any] = {
    "type": "patches",
    "vertices": [[1, 0, -1], [1, 0, 1], [-1, 2, 0], [-2, 3, 1], [-1, -2, 0], [-2, -3, 1]],
    "patches": [[[0, 1], [2, 3]], [[2, 3], [4, 5]], [[4, 5], [1, 0]]],
}


def test_the_response_of_a_conversion_lists_what_was_turned(client: Client) -> None:
    document = {"surface": PLATE, "operations": [{"op": "orient"}]}
    response = client.post("/v1/convert", document)
    assert response.status_code == 200
    oriented = response.json()
    assert oriented["orientation"] == {"turned": [2], "not_orientable": []}
    # The response is a body for other calls, as it is.
    measures = client.post("/v1/measure", oriented).json()
    assert measures["inconsistent_edges"] == 0
    assert (measures["area"]["value"], measures["boundary_count"]) == (pytest.approx(12), 2)
    again = client.post("/v1/convert", oriented | {"operations": [{"op": "orient"}]}).json()
    assert again["orientation"]["turned"] == []
    assert again["surface"] == oriented["surface"]
    project = {"points": [[0, 0, 1]]}
    assert client.post("/v1/project", oriented | project).status_code == 200


@pytest.mark.parametrize(
    "options", [{}, {"relative_tolerance": 1e-3}, {"max_triangles": 100}], ids=str
)
def test_the_report_of_a_mesh_lists_what_was_turned(client: Client, options: Any) -> None:
    document = {"surface": PLATE, "orient": True, **options}
    mesh = client.post("/v1/mesh?format=json", document).json()
    assert (mesh["report"]["turned"], mesh["report"]["not_orientable"]) == ([2], [])
    assert {tuple(normal) for normal in mesh["normals"]} == {(0.0, 0.0, 1.0)}
    glb = read_glb(client.post("/v1/mesh?format=glb", document).content)
    assert glb.document["asset"]["extras"]["report"]["turned"] == [2]
    plain = client.post("/v1/mesh?format=json", {"surface": PLATE, **options}).json()
    assert "turned" not in plain["report"]
    assert {tuple(normal) for normal in plain["normals"]} > {(0.0, 0.0, 1.0)}


def test_a_moebius_strip_is_said_and_not_turned(client: Client) -> None:
    document = {"surface": MOEBIUS, "orient": True, "resolution": 2}
    mesh = client.post("/v1/mesh?format=json", document).json()
    assert (mesh["report"]["turned"], mesh["report"]["not_orientable"]) == ([], [0, 1, 2])
    plain = client.post("/v1/mesh?format=json", document | {"orient": False}).json()
    lists = {name: value for name, value in mesh.items() if name != "report"}
    assert lists == {name: value for name, value in plain.items() if name != "report"}


def test_meshes_of_stored_surfaces_are_oriented_by_url(client: Client) -> None:
    stored = client.post("/v1/surfaces", {"surface": PLATE}).json()
    url = f"/v1/surfaces/{stored['id']}/mesh.json?resolution=2"
    assert client.get(f"{url}&orient=true").json()["report"]["turned"] == [2]
    assert "turned" not in client.get(f"{url}&orient=false").json()["report"]
    error = client.get(f"{url}&orient=maybe").json()["errors"][0]
    assert (error["code"], error["parameter"]) == ("wrong_type", "orient")


@pytest.mark.parametrize("fmt", ["stl", "obj", "off", "ply", "oogl", "3mf"])
def test_every_format_has_the_oriented_surface(client: Client, fmt: str) -> None:
    oriented = client.post(
        "/v1/convert", {"surface": PLATE, "operations": [{"op": "orient"}]}
    ).json()
    options = {"resolution": [2, 3]}
    expected = client.post(f"/v1/mesh?format={fmt}", oriented | options).content
    asked = {"surface": PLATE, "orient": True} | options
    assert client.post(f"/v1/mesh?format={fmt}", asked).content == expected


def test_an_estimate_counts_the_oriented_surface(client: Client) -> None:
    options = {"orient": True, "resolution": [2, 3]}
    estimate = client.post("/v1/estimate", {"surface": PLATE, **options}).json()
    mesh = client.post("/v1/mesh?format=json", {"surface": PLATE, **options})
    assert estimate["accepted"]
    assert estimate["vertices"] == mesh.json()["report"]["vertices"]
    assert len(mesh.content) <= estimate["bytes"]["json"]


@pytest.mark.slow
def test_the_lists_are_in_the_bound_of_the_bytes(client: Client) -> None:
    """Many patches, in pairs of which one is turned."""
    count = 400
    surfaces = [
        {"control_net": [[[3 * k, 0, 0], [3 * k, 1, 0]], [[3 * k + 1, 0, 0], [3 * k + 1, 1, 1]]]}
        for k in range(count)
    ]
    twins = [
        {"control_net": [row[::-1] for row in surface["control_net"][::-1]]} for surface in surfaces
    ]
    surface = {"type": "multipatch", "surfaces": [*surfaces, *twins]}
    document = {"surface": surface, "orient": True, "resolution": 1}
    estimate = client.post("/v1/estimate", document).json()
    for fmt in ("json", "glb", "gltf"):
        content = client.post(f"/v1/mesh?format={fmt}", document).content
        assert len(content) <= estimate["bytes"][fmt]


def test_cad_files_have_the_oriented_surface(client: Client) -> None:
    document = {"surface": PLATE, "operations": [{"op": "orient"}]}
    response = client.post("/v1/convert?format=vtu", document)
    assert response.status_code == 200
    oriented = client.post("/v1/convert", document).json()
    assert client.post("/v1/convert?format=vtu", {"surface": oriented["surface"]}).content == (
        response.content
    )


def test_the_command_line_orients(
    tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    file = tmp_path / "plate.json"
    file.write_text(json.dumps(PLATE))
    assert main(["convert", str(file), "-o", "-", "--orient", "--elevate", "2"]) == 0
    document = json.loads(capsysbinary.readouterr().out)
    assert document["orientation"]["turned"] == [2]
    (tmp_path / "again.json").write_text(json.dumps(document))
    assert main(["measure", str(tmp_path / "again.json"), "-o", "-"]) == 0
    assert json.loads(capsysbinary.readouterr().out)["inconsistent_edges"] == 0
