"""The contents of glTF and GLB, read back by a reader of our own."""

from dataclasses import replace

import numpy as np
import pytest

from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder
from service.encoders.gltf.glb import encode_glb
from service.engine.mesh.mesh_value import Mesh
from tests.encoders.gltf.reader import Gltf, read_glb
from tests.meshes import add_attributes, add_overlays, build_silo, to_single

OPTIONS = EncodeOptions()


def encode_mesh(mesh: Mesh) -> Gltf:
    return read_glb(bytes(encode_glb(mesh, OPTIONS)))


def test_vertices_of_a_part_may_lie_anywhere() -> None:
    mesh = to_single(build_silo(5))
    order = np.random.default_rng(7).permutation(len(mesh.positions)).astype(np.uint32)
    row = np.argsort(order).astype(np.uint32)
    shuffled = replace(
        mesh, positions=mesh.positions[order], normals=None, uvs=None, triangles=row[mesh.triangles]
    )
    file, plain = encode_mesh(shuffled), encode_mesh(mesh)
    for part in mesh.parts:
        np.testing.assert_array_equal(file.corners(part.name), plain.corners(part.name))
        count = len(plain.attribute(part.name, "POSITION"))
        assert len(file.attribute(part.name, "POSITION")) == count


def test_bounds_are_the_stored_numbers() -> None:
    mesh = build_silo(7, 200)
    tilted = replace(mesh, positions=mesh.positions @ np.array([[0.1, 3, 1], [2, 7, 0], [1, 1, 9]]))
    file = encode_mesh(to_single(tilted))
    bounded = [entry for entry in file.document["accessors"] if "min" in entry]
    assert len(bounded) == 3
    for name in ("base", "wall", "roof"):
        stored = file.attribute(name, "POSITION")
        entry = file.document["accessors"][file.primitive(name)["attributes"]["POSITION"]]
        assert entry["min"] == stored.min(axis=0).tolist()
        assert entry["max"] == stored.max(axis=0).tolist()


def test_views_are_aligned_tight_and_targeted() -> None:
    # Four triangles and three lines: views whose lengths are not multiples of four.
    file = encode_mesh(to_single(add_overlays(build_silo(3))))
    end = 0
    for view in file.document["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert 0 <= view["byteOffset"] - end < 4
        end = view["byteOffset"] + view["byteLength"]
    assert file.document["buffers"] == [{"byteLength": len(file.buffer)}]
    assert 0 <= len(file.buffer) - end < 4
    for entry in file.document["accessors"]:
        target = file.document["bufferViews"][entry["bufferView"]]["target"]
        assert target == (34963 if entry["type"] == "SCALAR" else 34962)


@pytest.mark.parametrize(("vertices", "component"), [(65535, 5123), (65536, 5125)])
def test_indices_are_short_while_they_may(vertices: int, component: int) -> None:
    buffer = BufferBuilder()
    last = np.array([[0, 1, vertices - 1]], dtype=np.uint32)
    buffer.add_indices(last, vertices)
    assert buffer.accessors[0]["componentType"] == component
    assert read_back(buffer).ravel().tolist() == [0, 1, vertices - 1]


def read_back(buffer: BufferBuilder) -> np.ndarray:
    packed = buffer.pack()
    document = {"accessors": buffer.accessors, "bufferViews": packed.views}
    return Gltf(document, b"".join(packed.chunks)).array(0)


def to_srgb(light: float) -> float:
    """The inverse of the formula in IEC 61966-2-1, in Python's own arithmetic."""
    return 12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055


@pytest.mark.parametrize("opacity", [False, True])
def test_colors_are_linear_on_white(opacity: bool) -> None:
    mesh = to_single(add_attributes(build_silo(12, 3), opacity))
    file = encode_mesh(mesh)
    assert mesh.colors is not None
    for part in mesh.parts:
        stored = file.attribute(part.name, "COLOR_0")
        rows = np.unique(mesh.triangles[slice(*part.triangles)])
        assert stored.dtype == np.float32
        back = [[to_srgb(float(light)) for light in row[:3]] for row in stored]
        np.testing.assert_allclose(back, mesh.colors[rows, :3], atol=3e-7)
        np.testing.assert_array_equal(stored[:, 3:], mesh.colors[rows, 3:])
    (material,) = file.document["materials"]
    assert "baseColorFactor" not in material["pbrMetallicRoughness"]
    assert material.get("alphaMode") == ("BLEND" if opacity else None)
