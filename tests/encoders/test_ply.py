"""PLY with both kinds of faces, which trimesh cannot read: read by the letter of its header."""

from dataclasses import replace

import numpy as np
import pytest

from service.encoders import ply
from service.encoders.format import EncodeOptions
from service.engine.mesh.mesh import Mesh
from tests.meshes import Faces, carrying, silo

SCALARS = {"double": "<f8", "float": "<f4", "uchar": "u1"}


def read(mesh: Mesh) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices as a structured array, and faces."""
    head, body = ply.encode(mesh, EncodeOptions()).split(b"end_header\n", 1)
    magic, layout, *lines = [line.split() for line in head.decode("ascii").splitlines()]
    assert (magic, layout) == (["ply"], ["format", "binary_little_endian", "1.0"])
    assert lines[-1] == ["property", "list", "uchar", "int", "vertex_indices"]
    properties = [words for words in lines if words[0] == "property"][:-1]
    (vertices, faces) = (int(words[2]) for words in lines if words[0] == "element")
    dtype = np.dtype([(name, SCALARS[kind]) for _, kind, name in properties])
    table = np.frombuffer(body, dtype, vertices)
    offset = table.nbytes
    loops = []
    for _ in range(faces):
        loop = np.frombuffer(body, "<i4", body[offset], offset + 1)
        offset += 1 + loop.nbytes
        loops.append(loop.tolist())
    assert offset == len(body)
    return table, loops


@pytest.mark.parametrize("faces", ["triangles", "quads"])
def test_faces_and_columns(faces: Faces) -> None:
    mesh = silo(5, 2, faces)
    assert mesh.normals is not None
    assert mesh.uvs is not None
    table, loops = read(mesh)
    assert loops == mesh.quads.tolist() + mesh.triangles.tolist()
    columns = np.hstack((mesh.positions, mesh.normals, mesh.uvs)).T
    for name, column in zip(("x", "y", "z", "nx", "ny", "nz", "s", "t"), columns, strict=True):
        np.testing.assert_array_equal(table[name], column.astype(table.dtype[name]))


@pytest.mark.parametrize("opacity", [False, True])
def test_colors_are_bytes_and_attributes_properties(opacity: bool) -> None:
    mesh = carrying(silo(5, 2), opacity)
    assert mesh.colors is not None
    table, loops = read(mesh)
    assert len(loops) == len(mesh.triangles)
    names = ("red", "green", "blue", "alpha")[: mesh.colors.shape[1]]
    for name, column in zip(names, mesh.colors.T, strict=True):
        assert table.dtype[name] == np.uint8
        assert np.abs(table[name] / 255 - column).max() <= 0.5 / 255 + 1e-12
    (_, temperature), (_, flow) = mesh.attributes
    np.testing.assert_array_equal(table["_temperature"], temperature[:, 0].astype(np.float32))
    for k in range(6):
        np.testing.assert_array_equal(table[f"_flow_{k}"], flow[:, k].astype(np.float32))
    assert ("alpha" in (table.dtype.names or ())) == opacity


def test_what_is_not_there_has_no_column() -> None:
    table, _ = read(replace(silo(), normals=None, uvs=None))
    assert table.dtype.names == ("x", "y", "z")
