"""PLY without optional channels; golden files and trimesh test PLY with channels."""

from dataclasses import replace

from service.encoders import ply
from service.encoders.format import EncodeOptions
from tests.meshes import build_silo


def test_missing_channels_have_no_column() -> None:
    content = ply.encode(replace(build_silo(), normals=None, uvs=None), EncodeOptions())
    head, _, _ = content.partition(b"end_header")
    names = [line.split()[-1] for line in head.splitlines() if line.startswith(b"property")]
    assert names == [b"x", b"y", b"z", b"vertex_indices"]
