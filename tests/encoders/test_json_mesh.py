"""The JSON format: its numbers are exact, and channels that a mesh lacks have no keys."""

import json
from dataclasses import replace
from typing import Any

import numpy as np

from service.encoders import json_mesh
from service.encoders.format import EncodeOptions
from service.engine.mesh.mesh import Mesh
from tools.meshes import add_attributes, add_overlays, build_sheet, build_silo, to_single


def decode(mesh: Mesh) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json_mesh.encode(mesh, EncodeOptions()))
    return document


def test_positions_are_written_with_all_bits() -> None:
    bits = np.random.default_rng(3).integers(0, 2**64, (500, 3), dtype=np.uint64)
    values = bits.view(np.float64)
    positions = np.where(np.isfinite(values), values, -0.0)
    mesh = replace(build_sheet(1), positions=positions)
    vertices = np.array(decode(mesh)["vertices"], dtype=np.float64)
    np.testing.assert_array_equal(vertices.view(np.uint64), positions.view(np.uint64))


def test_normals_and_uvs_are_float32() -> None:
    mesh = build_silo(7)
    document = decode(mesh)
    assert mesh.normals is not None
    assert mesh.uvs is not None
    for key, values in (("normals", mesh.normals), ("uvs", mesh.uvs)):
        rows = np.array(document[key], dtype=np.float32)
        np.testing.assert_array_equal(rows, values.astype(np.float32))
    max_length = max(len(repr(number)) for row in document["normals"] for number in row)
    # A float64 such as 1/3 would have more digits.
    assert max_length < len(repr(1 / 3))


def test_a_mesh_with_attributes_and_creases_has_attribute_faces() -> None:
    """At a crease several rows of attributes belong to one position.

    `attribute_faces` are the faces by rows of attributes; `faces` are those by positions.
    """
    mesh = replace(add_attributes(build_silo()), normals=None, uvs=None, colors=None)
    assert decode(mesh)["attribute_faces"] == mesh.triangles.tolist()
    assert "attribute_faces" not in decode(replace(mesh, attributes=()))


def find_rows(mesh: Mesh) -> list[int]:
    """For each vertex of the mesh, the row of `vertices` in JSON that has its position.

    JSON has each position once, in the order of first occurrence.
    """
    rows: dict[int, int] = {}
    welds = range(len(mesh.positions)) if mesh.welds is None else mesh.welds.tolist()
    return [rows.setdefault(weld, len(rows)) for weld in welds]


def test_missing_channels_have_no_keys() -> None:
    for mesh in (build_sheet(1), build_silo()):
        document = decode(replace(mesh, normals=None, uvs=None))
        assert list(document) == ["vertices", "faces", "parts", "report"]
    all_keys = ["vertices", "faces", "normals", "uvs", "attribute_faces", "parts", "lines"]
    assert list(decode(add_overlays(build_silo()))) == [*all_keys, "report"]


def test_the_local_origin_is_added_to_positions() -> None:
    origin = (5e5, 4.6e6, 0.125)
    document = decode(to_single(add_overlays(build_silo()), origin))
    expected = build_silo().positions + np.array(origin)
    # For each row of the document, the first vertex of the mesh with its position.
    first = [find_rows(build_silo()).index(k) for k in range(len(document["vertices"]))]
    np.testing.assert_array_equal(document["vertices"], expected[first])
    # The boundary begins at the point (0, 0, 0) of the mesh.
    np.testing.assert_array_equal(document["lines"][1]["vertices"][0], origin)
