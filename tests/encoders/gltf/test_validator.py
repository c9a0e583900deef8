"""The Khronos validator reports no issues in our files: no errors, no warnings and no hints."""

from dataclasses import replace
from pathlib import Path

import pytest

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import Mesh
from tests.clients.gltf_validator import list_issues, validate
from tools.meshes import (
    add_attributes,
    add_overlays,
    build_brep,
    build_sheet,
    build_silo,
    remove_faces,
    to_single,
)

MESHES = {
    "parts": to_single(build_silo(12, 3)),
    "far away": to_single(build_silo(12, 3), origin=(5e5, 4.6e6, 1e-3)),
    "z up": to_single(add_overlays(build_silo(12, 3)), origin=(1.0, 2.0, 3.0), up="z"),
    "positions alone": replace(to_single(build_silo(5)), normals=None, uvs=None),
    "one part": to_single(build_sheet(4)),
    "no faces": to_single(remove_faces(build_silo())),
    "overlays alone": to_single(remove_faces(add_overlays(build_silo()))),
    "odd name": replace(to_single(build_silo()), name='a "b" \\ \n ü \U0001f375'),
    "colours": to_single(add_attributes(build_silo(12, 3))),
    "brep": to_single(add_overlays(build_brep(12, 3)), (1.0, 2.0, 3.0), "z"),
    "translucent colours": to_single(
        add_attributes(build_silo(5), opacity=True), (1.0, 2.0, 3.0), "z"
    ),
}


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())
def test_the_validator_finds_no_issue(mesh: Mesh, suffix: str, tmp_path: Path) -> None:
    content = bytes(BY_NAME[suffix].encode(mesh, EncodeOptions()))
    assert list_issues(content, tmp_path / f"model.{suffix}") == []


def test_the_validator_finds_a_wrong_bound(tmp_path: Path) -> None:
    content = bytes(BY_NAME["gltf"].encode(to_single(build_sheet(1)), EncodeOptions()))
    path = tmp_path / "model.gltf"
    path.write_bytes(content.replace(b'"max":[1.0,', b'"max":[2.0,'))
    assert validate(path)["issues"]["numErrors"] > 0
