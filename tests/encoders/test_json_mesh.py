"""The JSON form: exact numbers, and only the keys that the mesh has."""

import json
from dataclasses import replace
from typing import Any

import numpy as np

from service.encoders import json_mesh
from service.encoders.format import EncodeOptions
from service.engine.mesh import Mesh
from tests.meshes import sheet, silo, single, with_overlays, without_faces


def decode(mesh: Mesh) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json_mesh.encode(mesh, EncodeOptions()))
    return document


def test_positions_read_back_bit_for_bit() -> None:
    bits = np.random.default_rng(3).integers(0, 2**64, (500, 3), dtype=np.uint64)
    values = bits.view(np.float64)
    positions = np.where(np.isfinite(values), values, -0.0)
    mesh = replace(sheet(1), positions=positions)
    read = np.array(decode(mesh)["vertices"], dtype=np.float64)
    np.testing.assert_array_equal(read.view(np.uint64), positions.view(np.uint64))


def test_normals_and_parameters_are_float32() -> None:
    mesh = silo(7)
    document = decode(mesh)
    assert mesh.normals is not None
    assert mesh.uvs is not None
    for key, values in (("normals", mesh.normals), ("uvs", mesh.uvs)):
        read = np.array(document[key], dtype=np.float32)
        np.testing.assert_array_equal(read, values.astype(np.float32))
    longest = max(len(repr(x)) for row in document["normals"] for x in row)
    assert longest < len(repr(1 / 3))


def test_faces_of_one_kind_are_those_of_the_mesh() -> None:
    assert decode(silo())["faces"] == silo().triangles.tolist()
    wall = replace(silo(faces="quads"), triangles=np.empty((0, 3), dtype=np.uint32))
    wall = replace(wall, parts=tuple(replace(p, triangles=(0, 0)) for p in wall.parts))
    assert decode(wall)["faces"] == wall.quads.tolist()


def test_mixed_faces_stand_part_by_part() -> None:
    mesh = silo(5, 2, faces="quads")
    document = decode(mesh)
    assert len(document["faces"]) == len(mesh.quads) + len(mesh.triangles)
    assert [part["name"] for part in document["parts"]] == ["base", "wall", "roof"]
    end = 0
    for part, expected in zip(document["parts"], mesh.parts, strict=True):
        first, last = part["faces"]
        assert first == end
        end = last
        quads = mesh.quads[slice(*expected.quads)].tolist()
        triangles = mesh.triangles[slice(*expected.triangles)].tolist()
        assert document["faces"][first:last] == quads + triangles
    assert end == len(document["faces"])


def test_overlays_are_lines() -> None:
    mesh = with_overlays(silo())
    net, border = decode(mesh)["lines"]
    assert net["name"] == "control net"
    assert net["vertices"] == mesh.overlays[0].positions.tolist()
    assert net["segments"] == mesh.overlays[0].segments.tolist()
    assert border["name"] == "boundary"


def test_what_is_not_there_has_no_key() -> None:
    mesh = replace(sheet(1), normals=None, uvs=None)
    assert list(decode(mesh)) == ["vertices", "faces", "parts", "report"]
    everything = ["vertices", "faces", "normals", "uvs", "parts", "lines", "welds", "report"]
    assert list(decode(with_overlays(silo()))) == everything


def test_welds_close_the_surface() -> None:
    mesh = silo()
    document = decode(mesh)
    vertices, welds = document["vertices"], document["welds"]
    assert len(welds) == len(vertices)
    assert all(vertices[k] == vertices[i] for i, k in enumerate(welds))
    assert max(welds) < len(vertices)
    assert document["report"]["watertight"] is True


def test_origin_is_added_back() -> None:
    origin = (5e5, 4.6e6, 0.125)
    moved = decode(single(with_overlays(silo()), origin))
    expected = silo().positions + np.array(origin)
    np.testing.assert_array_equal(moved["vertices"], expected)
    np.testing.assert_array_equal(moved["lines"][1]["vertices"][0], origin)


def test_no_faces_is_an_empty_list() -> None:
    document = decode(without_faces(silo()))
    assert document["faces"] == []
    assert [part["faces"] for part in document["parts"]] == [[0, 0]] * 3
