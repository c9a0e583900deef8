"""Groups with definitions over HTTP: meshes, stored ids, documents, limits and refusals."""

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import pytest

from oracles.gltf import read_glb
from oracles.solids import read_solid
from service.api.app import create_app
from service.api.models.meshes import Mesh
from service.settings.values import Settings
from tools.client import Client, start_client

SHIFT = [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
MACHINE: dict[str, Any] = {
    "type": "group",
    "up": "z",
    "metres_per_unit": 0.001,
    "definitions": [read_solid("box")],
    "members": [
        {"name": "machine"},
        {"name": "bolt", "definition": 0, "parent": 0, "matrix": SHIFT},
        {"name": "nut", "definition": 0, "parent": 1, "matrix": SHIFT},
    ],
}


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(Settings(max_members=2, max_placed_faces=40))) as client:
        yield client


def test_meshes_have_the_tree_or_its_paths(client: Client) -> None:
    """The unit is in the report, and scales the root of glTF alone."""
    mesh = Mesh.model_validate(client.post("/v1/mesh", {"surface": MACHINE}).json())
    assert mesh.report.metres_per_unit == 0.001
    assert mesh.report.watertight
    assert {part.name.rpartition("/")[0] for part in mesh.parts} == {
        "machine/bolt", "machine/bolt/nut"
    }  # fmt: skip
    response = client.post("/v1/mesh?format=glb", {"surface": MACHINE})
    nodes = read_glb(response.content).document["nodes"]
    assert [node["name"] for node in nodes] == ["group", "machine", "bolt", "nut"]
    assert nodes[0]["scale"] == [0.001] * 3
    assert nodes[2]["children"] == [3]
    assert nodes[2]["mesh"] == nodes[3]["mesh"]
    assert nodes[3]["translation"] == [5, 0, 0]


def test_the_stored_group_has_definitions(client: Client) -> None:
    """The document that comes back has the same id, also with a surface in each member."""
    stored = client.post("/v1/surfaces", {"surface": MACHINE}).json()
    answer = client.get(f"/v1/surfaces/{stored['id']}").json()["surface"]
    assert len(answer["definitions"]) == 1
    assert [member.get("definition") for member in answer["members"]] == [None, 0, 0]
    own = deepcopy(MACHINE)
    (box,) = own.pop("definitions")
    for member in own["members"][1:]:
        del member["definition"]
        member["surface"] = box
    for each in (answer, own):
        assert client.post("/v1/surfaces", {"surface": each}).json()["id"] == stored["id"]
    mesh = client.get(f"/v1/surfaces/{stored['id']}/mesh.glb")
    assert mesh.content == client.post("/v1/mesh?format=glb", {"surface": MACHINE}).content
    converted = client.post("/v1/convert", {"surface": answer})
    assert converted.json()["surface"] == answer


def test_an_estimate_counts_copies(client: Client) -> None:
    estimate = client.post("/v1/estimate", {"surface": MACHINE}).json()
    assert estimate["accepted"]
    content = client.post("/v1/mesh?format=glb", {"surface": MACHINE}).content
    assert len(content) <= estimate["bytes"]["glb"]


@pytest.mark.parametrize(
    ("change", "status", "code", "pointer"),
    [
        ({"members": [{"definition": 1}]}, 422, "unknown_definition", "/members/0/definition"),
        (
            {"members": [{"definition": 0}, {"definition": 0, "parent": 2}]},
            422,
            "unknown_parent",
            "/members/1/parent",
        ),
        ({"definitions": MACHINE["definitions"] * 3}, 422, "wrong_length", "/definitions"),
        ({"members": [{"definition": 0}] * 33}, 422, "wrong_length", "/members"),
        ({"members": [{"definition": 0}] * 7}, 422, "too_many_placed_faces", ""),
        ({"metres_per_unit": 0}, 422, "out_of_range", "/metres_per_unit"),
    ],
)
def test_refusals(
    client: Client, change: dict[str, Any], status: int, code: str, pointer: str
) -> None:
    """The limits are settings: 2 surfaces, 32 members, and 40 placed faces of a box of six."""
    response = client.post("/v1/mesh", {"surface": MACHINE | change})
    error = response.json()["errors"][0]
    assert (response.status_code, error["code"]) == (status, code)
    assert error["pointer"] == f"/surface{pointer}"
