"""PLY without channels; other tests compare PLY with channels with golden files and trimesh."""

from dataclasses import replace

from service.encoders import ply
from service.encoders.format import EncodeOptions
from tools.meshes import build_silo


def test_missing_channels_have_no_properties() -> None:
    content = ply.encode(replace(build_silo(), normals=None, uvs=None), EncodeOptions())
    head, _, _ = content.partition(b"end_header")
    names = [line.split()[-1] for line in head.splitlines() if line.startswith(b"property")]
    assert names == [b"x", b"y", b"z", b"vertex_indices"]
