"""OFF with colours, line by line, because trimesh ignores the colours."""

from pathlib import Path

from service.encoders import off
from service.encoders.format import EncodeOptions
from tests.clients.geomview import read_oogl
from tests.meshes import add_attributes, build_silo


def test_geomview_reads_it(tmp_path: Path) -> None:
    read = read_oogl(off.encode(add_attributes(build_silo(5, 2)), EncodeOptions()), tmp_path)
    assert read.colors is not None
    assert len(read.colors) == len(read.vertices)
