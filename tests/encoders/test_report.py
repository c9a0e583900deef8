"""Deviation bounds in the reports and comments of formats."""

import io
import json
from dataclasses import replace
from typing import Any

import pytest
import trimesh

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh_value import Mesh
from tests.encoders.gltf.reader import read_glb
from tests.meshes import build_silo, to_single

PLAIN = EncodeOptions()
BOUND = 0.0012345678901234567


def add_bounds(mesh: Mesh) -> Mesh:
    """The mesh with bounds for the whole and for all parts but the last."""
    *parts, last = mesh.parts
    report = replace(
        mesh.report, deviation_bound=BOUND, mesh_deviation_bound=2 * BOUND, normal_angle=0.25
    )
    bounded = (replace(part, deviation_bound=BOUND / 2) for part in parts)
    return replace(mesh, report=report, parts=(*bounded, last))


def read_reports(mesh: Mesh) -> list[dict[str, Any]]:
    """The reports in JSON and in glTF."""
    document = json.loads(bytes(BY_NAME["json"].encode(mesh, PLAIN)))
    asset = read_glb(bytes(BY_NAME["glb"].encode(to_single(mesh), PLAIN))).document["asset"]
    return [document["report"], asset["extras"]["report"]]


def test_reports_have_bounds_of_the_whole_and_of_each_part_with_one() -> None:
    mesh = build_silo()
    assert len(mesh.parts) > 1
    for report in read_reports(add_bounds(mesh)):
        assert report["deviation_bound"] == BOUND
        assert report["mesh_deviation_bound"] == 2 * BOUND
        assert report["normal_angle"] == 0.25
        assert [part["name"] for part in report["parts"]] == [part.name for part in mesh.parts]
        *bounded, last = report["parts"]
        assert all(part["deviation_bound"] == BOUND / 2 for part in bounded)
        assert "deviation_bound" not in last


def test_unknown_values_are_left_out() -> None:
    names = {"deviation_bound", "mesh_deviation_bound", "normal_angle", "parts"}
    for report in read_reports(build_silo()):
        assert not names & report.keys()


@pytest.mark.parametrize(
    ("name", "line"),
    [("obj", f"# deviation_bound {BOUND!r}"), ("ply", f"comment deviation_bound {BOUND!r}")],
)
def test_comments_have_the_bound_and_readers_ignore_them(name: str, line: str) -> None:
    fmt, mesh = BY_NAME[name], build_silo()
    content = bytes(fmt.encode(add_bounds(mesh), PLAIN))
    assert line.encode() in content.splitlines()[:3]
    assert line.split()[1].encode() not in bytes(fmt.encode(mesh, PLAIN))
    plain = replace(add_bounds(mesh), uvs=None)
    content = bytes(fmt.encode(plain, PLAIN))
    scene = trimesh.load_scene(io.BytesIO(content), file_type=name)
    assert sum(len(read.faces) for read in scene.geometry.values()) == len(mesh.triangles)
