"""OFF with colours, which trimesh ignores and Geomview reads."""

from pathlib import Path

from service.encoders import off
from service.encoders.format import EncodeOptions
from tests.clients.geomview import read_oogl
from tools.meshes import add_attributes, build_silo


def test_geomview_reads_a_colour_for_each_vertex(tmp_path: Path) -> None:
    mesh = read_oogl(off.encode(add_attributes(build_silo(5, 2)), EncodeOptions()), tmp_path)
    assert mesh.colors is not None
    assert len(mesh.colors) == len(mesh.vertices)
