"""trimesh reads quads of OBJ and OFF, and breps, as closed meshes of the right volume.

The meshes have no uvs, because trimesh needs Pillow to read texture coordinates.
"""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh

from oracles.solids import MEASURES, read_solid
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.pipeline.mesh import render
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
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


@pytest.mark.slow
@pytest.mark.parametrize("name", ["glb", "gltf", "obj", "off", "ply", "stl"])
@pytest.mark.parametrize("solid", ["cone", "crossholes"])
def test_trimesh_reads_a_closed_brep(name: str, solid: str) -> None:
    document = read_solid(solid)
    for face in document["faces"][::3]:
        face["color"] = [0.8, 0.2, 0.1]
    request = validate_document(MeshRequest, {"surface": document, "normals": False})
    content = render(request.to_surface(), request.mesh_options(), BY_NAME[name])
    loaded = trimesh.load_scene(BytesIO(content), file_type=name).to_mesh()
    loaded.merge_vertices(merge_tex=True, merge_norm=True)
    assert loaded.is_watertight
    assert loaded.is_winding_consistent
    assert loaded.volume == pytest.approx(MEASURES[solid]["volume"], rel=5e-3)
