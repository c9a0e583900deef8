"""The JSON form: exact numbers, and only the keys that the mesh has."""

import json
from dataclasses import replace
from typing import Any

import numpy as np

from service.encoders import json_mesh
from service.encoders.format import EncodeOptions
from service.engine.mesh.mesh_value import Mesh
from tests.meshes import add_attributes, add_overlays, build_sheet, build_silo, to_single


def decode(mesh: Mesh) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json_mesh.encode(mesh, EncodeOptions()))
    return document


def test_positions_read_back_bit_for_bit() -> None:
    bits = np.random.default_rng(3).integers(0, 2**64, (500, 3), dtype=np.uint64)
    values = bits.view(np.float64)
    positions = np.where(np.isfinite(values), values, -0.0)
    mesh = replace(build_sheet(1), positions=positions)
    read = np.array(decode(mesh)["vertices"], dtype=np.float64)
    np.testing.assert_array_equal(read.view(np.uint64), positions.view(np.uint64))


def test_normals_and_parameters_are_float32() -> None:
    mesh = build_silo(7)
    document = decode(mesh)
    assert mesh.normals is not None
    assert mesh.uvs is not None
    for key, values in (("normals", mesh.normals), ("uvs", mesh.uvs)):
        read = np.array(document[key], dtype=np.float32)
        np.testing.assert_array_equal(read, values.astype(np.float32))
    longest = max(len(repr(x)) for row in document["normals"] for x in row)
    assert longest < len(repr(1 / 3))


def test_attributes_alone_have_faces_of_their_own_where_they_must() -> None:
    mesh = replace(add_attributes(build_silo()), normals=None, uvs=None, colors=None)
    assert decode(mesh)["attribute_faces"] == mesh.triangles.tolist()
    assert "attribute_faces" not in decode(replace(mesh, attributes=()))


def find_rows(mesh: Mesh) -> list[int]:
    """For each vertex the row of `vertices` that holds its position: positions in first order."""
    rows: dict[int, int] = {}
    welds = range(len(mesh.positions)) if mesh.welds is None else mesh.welds.tolist()
    return [rows.setdefault(weld, len(rows)) for weld in welds]


def test_missing_channels_have_no_key() -> None:
    mesh = replace(build_sheet(1), normals=None, uvs=None)
    assert list(decode(mesh)) == ["vertices", "faces", "parts", "report"]
    bare = replace(build_silo(), normals=None, uvs=None)
    assert list(decode(bare)) == ["vertices", "faces", "parts", "report"]
    everything = ["vertices", "faces", "normals", "uvs", "attribute_faces", "parts", "lines"]
    assert list(decode(add_overlays(build_silo()))) == [*everything, "report"]


def test_origin_is_added_back() -> None:
    origin = (5e5, 4.6e6, 0.125)
    moved = decode(to_single(add_overlays(build_silo()), origin))
    expected = build_silo().positions + np.array(origin)
    first = [find_rows(build_silo()).index(k) for k in range(len(moved["vertices"]))]
    np.testing.assert_array_equal(moved["vertices"], expected[first])
    np.testing.assert_array_equal(moved["lines"][1]["vertices"][0], origin)
