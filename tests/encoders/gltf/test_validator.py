"""The Khronos validator reports no issue in our files, not even a hint."""

from dataclasses import replace
from pathlib import Path

import pytest

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh_value import Mesh
from tests.clients.gltf_validator import issues, validate
from tests.meshes import carrying, sheet, silo, single, with_overlays, without_faces

MESHES = {
    "parts": single(silo(12, 3)),
    "far away": single(silo(12, 3), origin=(5e5, 4.6e6, 1e-3)),
    "z up": single(with_overlays(silo(12, 3)), origin=(1.0, 2.0, 3.0), up="z"),
    "positions alone": replace(single(silo(5)), normals=None, uvs=None),
    "one part": single(sheet(4)),
    "no faces": single(without_faces(silo())),
    "overlays alone": single(without_faces(with_overlays(silo()))),
    "odd name": replace(single(silo()), name='a "b" \\ \n ü \U0001f375'),
    "colours": single(carrying(silo(12, 3))),
    "colours one can see through": single(carrying(silo(5), opacity=True), (1.0, 2.0, 3.0), "z"),
}


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())
def test_valid(mesh: Mesh, suffix: str, tmp_path: Path) -> None:
    content = bytes(BY_NAME[suffix].encode(mesh, EncodeOptions()))
    assert issues(content, tmp_path / f"model.{suffix}") == []


def test_the_validator_finds_a_fault(tmp_path: Path) -> None:
    content = bytes(BY_NAME["gltf"].encode(single(sheet(1)), EncodeOptions()))
    path = tmp_path / "model.gltf"
    path.write_bytes(content.replace(b'"max":[1.0,', b'"max":[2.0,'))
    assert validate(path)["issues"]["numErrors"] > 0
