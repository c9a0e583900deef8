"""STL, OBJ, PLY and OFF as trimesh reads them: counts, volume, closed, normals.

Without parameters: trimesh takes them for texture coordinates, and wants Pillow for those.
"""

from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np
import pytest
import trimesh

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import Mesh
from tests.meshes import Faces, carrying, silo, single

SIDES, ROWS = 12, 3
AREA = SIDES / 2 * np.sin(2 * np.pi / SIDES)
VOLUME = AREA * (1 + 1 / 3)
"""Prism of height 1 below a pyramid of height 1."""


def read(mesh: Mesh, name: str, **options: Any) -> trimesh.Trimesh:
    content = BY_NAME[name].encode(replace(mesh, uvs=None), EncodeOptions())
    scene = trimesh.load_scene(BytesIO(content), file_type=name, **options)
    # Not `to_mesh`: a copy forgets the normals of the file and makes up its own.
    (loaded,) = scene.geometry.values()
    assert isinstance(loaded, trimesh.Trimesh)
    return loaded


def body(name: str, faces: Faces = "triangles") -> Mesh:
    mesh = silo(SIDES, ROWS, faces)
    return single(mesh) if BY_NAME[name].single else mesh


@pytest.mark.parametrize("name", ["obj", "off"])
def test_quads_are_kept(name: str) -> None:
    mesh = body(name, "quads")
    assert len(mesh.quads)
    assert len(mesh.triangles)
    loaded = read(mesh, name, process=True, merge_norm=True, merge_tex=True)
    assert len(loaded.faces) == len(mesh.triangles) + 2 * len(mesh.quads)
    assert loaded.is_watertight
    assert loaded.volume == pytest.approx(VOLUME, rel=1e-6)


def test_ply_attributes_arrive() -> None:
    mesh = carrying(body("ply"))
    loaded = read(mesh, "ply", process=False)
    found = loaded.metadata["_ply_raw"]["vertex"]["data"]["_temperature"]
    np.testing.assert_array_equal(found.ravel(), mesh.attributes[0][1].ravel().astype(np.float32))


def test_stl_normals_are_those_of_the_triangles() -> None:
    loaded = read(single(silo()), "stl", process=False)
    normals = np.cross(*np.diff(loaded.triangles, axis=1).swapaxes(0, 1))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    content = BY_NAME["stl"].encode(single(silo()), EncodeOptions())
    layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    stored = np.frombuffer(content, dtype=layout, offset=84)["normal"]
    np.testing.assert_allclose(stored, normals, atol=1e-6)
