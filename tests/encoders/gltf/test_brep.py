"""Breps in glTF: one mesh, a primitive for each colour, and extras that tell the faces apart."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oracles.gltf import Gltf, read_glb
from oracles.solids import read_solid
from service.encoders.format import Compression, EncodeOptions
from service.encoders.gltf import meshopt
from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import Mesh
from service.engine.quantize import quantize_mesh
from service.engine.scenes.scene import Scene, arrange
from service.pipeline.mesh import render
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.bezier import BezierSurface
from service.surface.lowered import Color, GroupModel, PatchModel, PlacedModel
from tests.clients.gltf_validator import list_issues
from tools.meshes import add_overlays, build_brep, to_single

BREP = to_single(build_brep(12, 3))
BLUE: Color = (0.1, 0.2, 0.9, 1.0)

each_compression = pytest.mark.parametrize(
    "compression", ["none", *(["meshopt"] if meshopt.is_available() else [])]
)


def encode_and_read(mesh: Mesh, **options: Any) -> Gltf:
    return read_glb(bytes(BY_NAME["glb"].encode(mesh, EncodeOptions(**options))))


def split_faces(file: Gltf, primitive: dict[str, Any]) -> dict[int, Any]:
    """The corners (N, 3, 3) of the triangles of each face of a primitive, as stored."""
    corners = file.array(primitive["attributes"]["POSITION"])[
        file.array(primitive["indices"]).ravel()
    ].reshape(-1, 3, 3)
    runs = primitive["extras"]["faces"]
    ends = [*runs["first_triangle"][1:], len(corners)]
    return {
        face: corners[begin:end]
        for face, begin, end in zip(runs["face"], runs["first_triangle"], ends, strict=True)
    }


def list_triangles(corners: Any) -> set[Any]:
    """Triangles as sets of corners: their order, and that of their corners, does not matter."""
    return {frozenset(map(tuple, triangle)) for triangle in np.asarray(corners).tolist()}


@each_compression
def test_a_click_on_a_triangle_finds_its_face(compression: Compression) -> None:
    file = encode_and_read(BREP, compression=compression)
    (mesh,) = file.document["meshes"]
    assert mesh["name"] == "bin"
    first, second = mesh["primitives"]
    faces = split_faces(file, first) | split_faces(file, second)
    assert sorted(faces) == [1, 2, 3]  # face 0 was skipped
    for number, corners in faces.items():
        triangles = BREP.triangles[slice(*BREP.parts[number].triangles)]
        assert list_triangles(corners) == list_triangles(BREP.positions[triangles])
        assert len(corners) == len(triangles)


def test_faces_of_one_colour_are_one_primitive() -> None:
    file = encode_and_read(BREP)
    first, second = file.document["meshes"][0]["primitives"]
    assert first["extras"]["faces"]["face"] == [1, 3]
    assert second["extras"]["faces"] == {"first_triangle": [0], "face": [2]}
    names = [file.document["materials"][each["material"]]["name"] for each in (first, second)]
    assert names == ["surface #cc331a", "surface"]
    # Base, wall and roof are one node; there is no node for each face.
    assert [node["name"] for node in file.document["nodes"]] == ["bin", "bin"]


def test_the_report_has_the_facts_of_breps() -> None:
    report = encode_and_read(BREP).document["asset"]["extras"]["report"]
    assert [part["name"] for part in report["parts"]] == ["lid", "base", "wall", "roof"]
    assert [part.get("deviation_bound") for part in report["parts"]] == [None, 0.0, 0.25, 0.5]
    assert report["complete"] is False
    assert report["reached"] is True
    assert report["collapsed_edges"] == {"count": 0, "longest_chain": 0.0}
    assert report["skipped_faces"] == [
        {
            "face": 0,
            "code": "loop_open",
            "got": "a distance of 0.5",
            "needed": "a closed loop",
        }
    ]
    assert "mesh_deviation_bound" not in report


def test_a_bound_that_is_not_finite_is_null_and_has_a_reason() -> None:
    assert BREP.report.brep is not None
    brep = replace(BREP.report.brep, unbounded_reason="The part is thin.")
    mesh = replace(BREP, report=replace(BREP.report, brep=brep))
    report = encode_and_read(mesh).document["asset"]["extras"]["report"]
    assert report["mesh_deviation_bound"] is None
    assert report["mesh_deviation_reason"] == "The part is thin."


def test_parts_beyond_ten_thousand_are_not_listed() -> None:
    parts = (*BREP.parts[:3], *[replace(BREP.parts[0], name=f"f{k}") for k in range(10_000)])
    mesh = replace(BREP, parts=(*parts, BREP.parts[3]))
    assert "parts" not in encode_and_read(mesh).document["asset"]["extras"]["report"]
    document = json.loads(bytes(BY_NAME["json"].encode(mesh, EncodeOptions())))
    assert document["parts"] == []
    assert "parts" not in document["report"]
    assert len(json.loads(bytes(BY_NAME["json"].encode(BREP, EncodeOptions())))["parts"]) == 4


def build_scene(*members: PlacedModel) -> Scene:
    """A scene of copies of the brep and of a sheet without colours."""
    sheet = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]])).lower()
    assert isinstance(sheet, PatchModel)
    return arrange(GroupModel("group", (sheet,), members), (BREP,))


@each_compression
def test_the_colour_of_a_member_applies_to_faces_without_one(
    compression: Compression, tmp_path: Path
) -> None:
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    members = [PlacedModel("a", 0), PlacedModel("b", 0, BLUE), PlacedModel("c", 0, BLUE, mirror)]
    content = BY_NAME["glb"].write_scene(
        build_scene(*members), EncodeOptions(compression=compression)
    )
    file = read_glb(bytes(content))
    document = file.document
    names = [
        [document["materials"][each["material"]]["name"] for each in mesh["primitives"]]
        for mesh in document["meshes"]
    ]
    # The two blue copies share a mesh, and all three share the arrays.
    assert names == [["surface #cc331a", "surface"], ["surface #cc331a", "surface #1a33e6"]]
    assert [node.get("mesh") for node in document["nodes"]] == [None, 0, 1, 1]
    attributes = [
        [each["attributes"] for each in mesh["primitives"]] for mesh in document["meshes"]
    ]
    assert attributes[0] == attributes[1]
    if compression == "none":  # the validator knows no compression
        assert list_issues(bytes(content), tmp_path / "scene.glb") == []


@each_compression
def test_the_validator_finds_no_issue_in_compact_files(
    compression: Compression, tmp_path: Path
) -> None:
    mesh = quantize_mesh(to_single(add_overlays(build_brep(12, 3))), 2.0**-14)
    options = EncodeOptions(quantize=True, compression=compression)
    content = bytes(BY_NAME["glb"].encode(mesh, options))
    if compression == "none":  # the validator knows no compression
        assert list_issues(content, tmp_path / "model.glb") == []
    first, second = read_glb(content).document["meshes"][0]["primitives"]
    assert first["extras"]["faces"]["face"] == [1, 3]
    assert second["extras"]["faces"]["face"] == [2]


@pytest.mark.parametrize("name", ["plate", "sphere"])
def test_the_validator_finds_no_issue_in_a_solid(name: str, tmp_path: Path) -> None:
    solid = read_solid(name)
    for face in solid["faces"][::2]:
        face["color"] = [0.1, 0.2, 0.9, 0.5]
    document = {"surface": solid, "uvs": True, "curvatures": True, "overlays": ["boundary"]}
    request = validate_document(MeshRequest, document)
    content = render(request.to_surface(), request.mesh_options(), BY_NAME["glb"])
    assert list_issues(content, tmp_path / "model.glb") == []
