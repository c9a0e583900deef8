"""trimesh reads quads of OBJ and OFF as a closed mesh of the right volume.

The meshes have no uvs, because trimesh needs Pillow to read texture coordinates.
"""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh

from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from tools.meshes import build_silo

SIDES, ROWS = 12, 3
AREA = SIDES / 2 * np.sin(2 * np.pi / SIDES)
VOLUME = AREA * (1 + 1 / 3)
"""Volume of the silo: a prism of height 1 below a pyramid of height 1."""


@pytest.mark.parametrize("name", ["obj", "off"])
def test_trimesh_reads_two_triangles_for_each_quad(name: str) -> None:
    mesh = replace(build_silo(SIDES, ROWS, "quads"), uvs=None)
    assert len(mesh.quads)
    assert len(mesh.triangles)
    file = BytesIO(bytes(BY_NAME[name].encode(mesh, EncodeOptions())))
    scene = trimesh.load_scene(file, file_type=name, process=True, merge_norm=True, merge_tex=True)
    (loaded,) = scene.geometry.values()
    assert isinstance(loaded, trimesh.Trimesh)
    assert len(loaded.faces) == len(mesh.triangles) + 2 * len(mesh.quads)
    assert loaded.is_watertight
    assert loaded.volume == pytest.approx(VOLUME, rel=1e-6)
