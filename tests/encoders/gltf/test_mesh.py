"""The contents of GLB files, read by the independent reader in `oracles.gltf`."""

from dataclasses import replace

import numpy as np
import pytest

from oracles.gltf import ELEMENT_ARRAY_BUFFER, Gltf, read_glb
from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder
from service.encoders.gltf.glb import encode_glb
from service.engine.mesh.mesh import Mesh
from tools.meshes import add_attributes, add_overlays, build_silo, to_single

OPTIONS = EncodeOptions()
ARRAY_BUFFER = 34962
"""Target of a buffer view of vertex attributes."""


def encode_and_read(mesh: Mesh) -> Gltf:
    """Encodes a mesh as GLB, and reads the file again."""
    return read_glb(bytes(encode_glb(mesh, OPTIONS)))


def test_vertices_of_a_part_may_have_any_order() -> None:
    mesh = to_single(build_silo(5))
    order = np.random.default_rng(7).permutation(len(mesh.positions)).astype(np.uint32)
    row = np.argsort(order).astype(np.uint32)
    shuffled_mesh = replace(
        mesh, positions=mesh.positions[order], normals=None, uvs=None, triangles=row[mesh.triangles]
    )
    file, plain = encode_and_read(shuffled_mesh), encode_and_read(mesh)
    for part in mesh.parts:
        np.testing.assert_array_equal(file.corners(part.name), plain.corners(part.name))
        count = len(plain.attribute(part.name, "POSITION"))
        assert len(file.attribute(part.name, "POSITION")) == count


def test_bounds_of_accessors_are_the_least_and_largest_stored_numbers() -> None:
    mesh = build_silo(7, 200)
    sheared_mesh = replace(
        mesh, positions=mesh.positions @ np.array([[0.1, 3, 1], [2, 7, 0], [1, 1, 9]])
    )
    file = encode_and_read(to_single(sheared_mesh))
    accessors = file.document["accessors"]
    assert len([accessor for accessor in accessors if "min" in accessor]) == 3
    for name in ("base", "wall", "roof"):
        stored = file.attribute(name, "POSITION")
        accessor = accessors[file.primitive(name)["attributes"]["POSITION"]]
        assert accessor["min"] == stored.min(axis=0).tolist()
        assert accessor["max"] == stored.max(axis=0).tolist()


def test_views_are_aligned_follow_each_other_and_have_targets() -> None:
    # The indices of 3 triangles, in the base and in the roof, take 18 bytes: no multiple of 4.
    file = encode_and_read(to_single(add_overlays(build_silo(3))))
    end = 0
    for view in file.document["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert 0 <= view["byteOffset"] - end < 4
        end = view["byteOffset"] + view["byteLength"]
    assert file.document["buffers"] == [{"byteLength": len(file.buffer)}]
    assert 0 <= len(file.buffer) - end < 4
    for accessor in file.document["accessors"]:
        target = file.document["bufferViews"][accessor["bufferView"]]["target"]
        is_index = accessor["type"] == "SCALAR"
        assert target == (ELEMENT_ARRAY_BUFFER if is_index else ARRAY_BUFFER)


@pytest.mark.parametrize(("vertices", "component"), [(65535, 5123), (65536, 5125)])
def test_indices_are_uint16_up_to_65535_vertices(vertices: int, component: int) -> None:
    buffer = BufferBuilder()
    triangle = np.array([[0, 1, vertices - 1]], dtype=np.uint32)
    buffer.add_indices(triangle, vertices)
    assert buffer.accessors[0]["componentType"] == component
    assert read_first_accessor(buffer).ravel().tolist() == [0, 1, vertices - 1]


def read_first_accessor(buffer: BufferBuilder) -> np.ndarray:
    packed = buffer.pack()
    document = {"accessors": buffer.accessors, "bufferViews": packed.views}
    return Gltf(document, b"".join(packed.chunks)).array(0)


def to_srgb(light: float) -> float:
    """The sRGB value of linear light, by the formula of IEC 61966-2-1, without NumPy."""
    return 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055


@pytest.mark.parametrize("has_opacity", [False, True])
def test_vertex_colors_are_linear_and_the_material_is_white(has_opacity: bool) -> None:
    mesh = to_single(add_attributes(build_silo(12, 3), has_opacity))
    file = encode_and_read(mesh)
    assert mesh.colors is not None
    for part in mesh.parts:
        stored = file.attribute(part.name, "COLOR_0")
        rows = np.unique(mesh.triangles[slice(*part.triangles)])
        assert stored.dtype == np.float32
        srgb = [[to_srgb(float(light)) for light in row[:3]] for row in stored]
        np.testing.assert_allclose(srgb, mesh.colors[rows, :3], atol=3e-7)
        np.testing.assert_array_equal(stored[:, 3:], mesh.colors[rows, 3:])
    (material,) = file.document["materials"]
    assert "baseColorFactor" not in material["pbrMetallicRoughness"]
    assert material.get("alphaMode") == ("BLEND" if has_opacity else None)
