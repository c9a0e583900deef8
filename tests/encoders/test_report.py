"""Deviation bounds in the reports of JSON and glTF, and in the comments of OBJ and PLY."""

import io
import json
from dataclasses import replace
from typing import Any

import pytest
import trimesh

from oracles.gltf import read_glb
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import Mesh
from tools.meshes import build_silo, to_single

DEFAULTS = EncodeOptions()
BOUND = 0.0012345678901234567


def add_bounds(mesh: Mesh) -> Mesh:
    """The mesh with bounds for the whole mesh and for all parts except the last."""
    *parts, last_part = mesh.parts
    report = replace(
        mesh.report, deviation_bound=BOUND, mesh_deviation_bound=2 * BOUND, normal_angle=0.25
    )
    parts_with_bounds = (replace(part, deviation_bound=BOUND / 2) for part in parts)
    return replace(mesh, report=report, parts=(*parts_with_bounds, last_part))


def read_reports(mesh: Mesh) -> list[dict[str, Any]]:
    """The report in the JSON file and the report in the GLB file of a mesh."""
    document = json.loads(bytes(BY_NAME["json"].encode(mesh, DEFAULTS)))
    asset = read_glb(bytes(BY_NAME["glb"].encode(to_single(mesh), DEFAULTS))).document["asset"]
    return [document["report"], asset["extras"]["report"]]


def test_reports_have_the_bounds_of_the_mesh_and_of_its_parts() -> None:
    mesh = build_silo()
    assert len(mesh.parts) > 1
    for report in read_reports(add_bounds(mesh)):
        assert report["deviation_bound"] == BOUND
        assert report["mesh_deviation_bound"] == 2 * BOUND
        assert report["normal_angle"] == 0.25
        assert [part["name"] for part in report["parts"]] == [part.name for part in mesh.parts]
        *parts_with_bounds, last_part = report["parts"]
        assert all(part["deviation_bound"] == BOUND / 2 for part in parts_with_bounds)
        assert "deviation_bound" not in last_part


def test_reports_of_meshes_without_bounds_have_no_bounds() -> None:
    names = {"deviation_bound", "mesh_deviation_bound", "normal_angle", "parts"}
    for report in read_reports(build_silo()):
        assert not names & report.keys()


@pytest.mark.parametrize(
    ("name", "line"),
    [("obj", f"# deviation_bound {BOUND!r}"), ("ply", f"comment deviation_bound {BOUND!r}")],
)
def test_the_comment_has_the_bound_and_trimesh_ignores_it(name: str, line: str) -> None:
    fmt, mesh = BY_NAME[name], build_silo()
    content = bytes(fmt.encode(add_bounds(mesh), DEFAULTS))
    assert line.encode() in content.splitlines()[:3]
    assert line.split()[1].encode() not in bytes(fmt.encode(mesh, DEFAULTS))
    # trimesh needs Pillow to read texture coordinates.
    mesh_without_uvs = replace(add_bounds(mesh), uvs=None)
    content = bytes(fmt.encode(mesh_without_uvs, DEFAULTS))
    scene = trimesh.load_scene(io.BytesIO(content), file_type=name)
    assert sum(len(loaded.faces) for loaded in scene.geometry.values()) == len(mesh.triangles)
