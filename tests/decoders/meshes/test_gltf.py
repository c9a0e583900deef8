"""glTF files made by hand: nodes, strides, sparse accessors, and values that are wrong."""

import base64
import json
import struct
from typing import Any

import numpy as np
import pytest

from tests.decoders.meshes.files import read, refuse
from tools.hostile.gltf import CODES, SQUARE, TRIANGLE, Gltf, build_triangle, write_glb


def test_a_primitive_without_indices_is_read() -> None:
    mesh = read("glb", build_triangle().write())
    assert mesh.corners.tolist() == [TRIANGLE]
    assert mesh.normals is None


@pytest.mark.parametrize("kind", ["u1", "u2", "u4"])
def test_indices_have_three_types(kind: str) -> None:
    gltf = Gltf()
    faces = [0, 1, 2, 0, 2, 3]
    gltf.node(mesh=gltf.mesh(POSITION=gltf.array(SQUARE), indices=gltf.array(faces, kind)))
    mesh = read("glb", gltf.write())
    assert mesh.triangles.tolist() == [faces[:3], faces[3:]]
    assert mesh.positions.tolist() == SQUARE


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
    ],
)
@pytest.mark.parametrize("has_indices", [False, True])
def test_strips_and_fans_become_triangles(
    mode: int, expected: list[list[int]], has_indices: bool
) -> None:
    points = np.arange(15.0).reshape(5, 3)
    gltf = Gltf()
    fields: dict[str, Any] = {"mode": mode, "POSITION": gltf.array(points)}
    if has_indices:
        fields["indices"] = gltf.array([4, 3, 2, 1, 0], "u2")
        points = points[::-1]
    gltf.node(mesh=gltf.mesh(**fields))
    corners = read("glb", gltf.write()).corners
    for found, row in zip(corners, expected, strict=True):
        turned = [np.roll(points[row], k, axis=0).tolist() for k in range(3)]
        assert found.tolist() in turned  # the same corners, in the same sense


def test_primitives_that_share_vertices_have_those_that_they_use() -> None:
    points = np.random.default_rng(4).normal(size=(1000, 3)).astype("<f4")
    gltf = Gltf()
    position, normal = gltf.array(points), gltf.array(points[::-1])
    faces = np.random.default_rng(5).integers(0, 1000, (40, 2, 3))
    for rows in faces:
        indices = gltf.array(rows.ravel(), "u2")
        gltf.node(mesh=gltf.mesh(POSITION=position, NORMAL=normal, indices=indices))
    mesh = read("glb", gltf.write())
    np.testing.assert_array_equal(mesh.corners, points[faces.reshape(-1, 3)])
    assert mesh.normals is not None
    np.testing.assert_array_equal(mesh.normals[mesh.triangles], points[::-1][faces.reshape(-1, 3)])
    assert len(mesh.positions) <= faces.size


def test_interleaved_vertices_are_read() -> None:
    gltf = Gltf()
    normals = np.array([[0.0, 0, 1], [0, 1, 0], [1, 0, 0]])
    rows = np.hstack([np.array(TRIANGLE), normals, np.full((3, 2), 7.0)]).astype("<f4")
    view = gltf.view(b"\xff" * 8 + rows.tobytes(), byteStride=32)
    position = gltf.accessor(view, "f4", 3, 2, byteOffset=8)
    normal = gltf.accessor(view, "f4", 3, 2, byteOffset=20)
    gltf.node(mesh=gltf.mesh(POSITION=position, NORMAL=normal))
    mesh = read("glb", gltf.write())
    assert mesh.corners.tolist() == [TRIANGLE]
    assert mesh.normals is not None
    assert mesh.normals.tolist() == normals.tolist()


@pytest.mark.parametrize(
    ("kind", "largest"), [("i1", 127), ("u1", 255), ("i2", 32767), ("u2", 65535)]
)
def test_integers_are_positions(kind: str, largest: int) -> None:
    """Normalized ones are divided by the largest of their type; −128 is −1, too."""
    least = -largest - 1 if kind[0] == "i" else 0
    points = [[0, 0, largest], [largest, 1, 0], [least, 3, 2]]
    for is_normalized in (False, True):
        gltf = Gltf()
        gltf.document["extensionsRequired"] = ["KHR_mesh_quantization"]
        position = gltf.array(points, kind, normalized=is_normalized)
        gltf.node(mesh=gltf.mesh(POSITION=position), scale=[2, 2, 2])
        expected = np.array(points, float)
        if is_normalized:
            expected = np.maximum(expected / largest, -1)
        np.testing.assert_array_equal(read("glb", gltf.write()).corners, 2 * expected[np.newaxis])


@pytest.mark.parametrize("has_base", [False, True])
def test_sparse_accessors_are_read(has_base: bool) -> None:
    gltf = Gltf()
    base = gltf.view(np.array(SQUARE, "<f4").tobytes()) if has_base else None
    indices = gltf.view(np.array([1, 3], "<u2").tobytes())
    values = gltf.view(np.array([[5, 6, 7], [8, 9, 10]], "<f4").tobytes())
    changes = {
        "count": 2,
        "indices": {"bufferView": indices, "componentType": CODES["u2"]},
        "values": {"bufferView": values},
    }
    position = gltf.accessor(base, "f4", 4, 2, sparse=changes)
    faces = gltf.array([0, 1, 3], "u1")
    gltf.node(mesh=gltf.mesh(POSITION=position, indices=faces))
    expected = np.array(SQUARE) if has_base else np.zeros((4, 3))
    expected[[1, 3]] = [[5, 6, 7], [8, 9, 10]]
    assert read("glb", gltf.write()).corners.tolist() == [expected[[0, 1, 3]].tolist()]


def test_nodes_place_meshes_in_the_order_of_the_file() -> None:
    """A node scales, then turns, then shifts what is below it."""
    gltf = Gltf()
    triangle, line = gltf.array(TRIANGLE), gltf.array(SQUARE)
    mesh = gltf.mesh(POSITION=triangle)
    gltf.mesh(POSITION=line, mode=1)
    half = 0.5**0.5
    turned = gltf.node(is_root=False, mesh=mesh, rotation=[0, 0, half, half], scale=[2, 3, 1])
    camera = gltf.node(is_root=False, camera=0, children=[turned], translation=[0, 0, 1])
    columns = [1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1]
    sheared = gltf.node(is_root=False, mesh=mesh, matrix=columns)
    gltf.node(mesh=1)
    gltf.node(children=[sheared, camera], translation=[100, 0, 0])
    gltf.node(mesh=mesh)
    corners = read("glb", gltf.write()).corners
    expected: Any = [
        [[110, 20, 30], [111, 20, 30], [110.5, 21, 30]],
        [[100, 0, 1], [100, 2, 1], [97, 0, 1]],
        TRIANGLE,
    ]
    np.testing.assert_allclose(corners, expected, rtol=0, atol=1e-13)


def test_a_mirror_image_keeps_its_outside() -> None:
    gltf = Gltf()
    normals = [[0.0, 0, 1]] * 3
    mesh = gltf.mesh(POSITION=gltf.array(TRIANGLE), NORMAL=gltf.array(normals))
    for scale in ([-1, 1, 1], [1, 1, -2], [-1, -1, -1], [3, 1, 1]):
        gltf.node(mesh=mesh, scale=scale)
    found = read("glb", gltf.write())
    assert found.normals is not None
    for corners, normals_found in zip(found.corners, found.normals[found.triangles], strict=True):
        across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert (normals_found @ across > 0).all()


def test_only_the_scene_that_is_shown_is_read() -> None:
    gltf = Gltf()
    mesh = gltf.mesh(POSITION=gltf.array(TRIANGLE))
    gltf.node(mesh=mesh, translation=[1, 0, 0])
    gltf.node(mesh=mesh, is_root=False, translation=[2, 0, 0])
    gltf.document["scenes"].append({"nodes": [1]})
    assert read("glb", gltf.write()).positions[0].tolist() == [1, 0, 0]
    gltf.document["scene"] = 1
    assert read("glb", gltf.write()).positions[0].tolist() == [2, 0, 0]
    # Without scenes, all nodes are shown that are below no other.
    gltf.document["nodes"][0]["children"] = [1]
    del gltf.document["scenes"]
    assert [p[0] for p in read("glb", gltf.write()).corners[:, 0].tolist()] == [1, 3]


def test_a_document_may_have_its_buffers_as_base64() -> None:
    gltf = build_triangle()
    gltf.write()
    text = base64.b64encode(gltf.content).decode()
    for media_type in ("application/octet-stream", "application/gltf-buffer"):
        gltf.document["buffers"][0]["uri"] = f"data:{media_type};base64,{text}"
        assert read("gltf", json.dumps(gltf.document)).corners.tolist() == [TRIANGLE]
        assert read("glb", write_glb(gltf.document)).corners.tolist() == [TRIANGLE]


def test_pictures_are_not_looked_at() -> None:
    gltf = build_triangle(material=0)
    gltf.document["images"] = [{"bufferView": gltf.view(b"\x89PNG no picture")}, {"uri": "x.png"}]
    gltf.document["textures"] = [{"source": 0}]
    gltf.document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    assert read("glb", gltf.write()).corners.tolist() == [TRIANGLE]


def test_other_files_are_never_opened() -> None:
    for uri in ("model.bin", "file:///etc/passwd", "https://example.com/a.bin", "/etc/passwd"):
        gltf = build_triangle()
        gltf.write()
        gltf.document["buffers"][0]["uri"] = uri
        assert refuse("gltf", json.dumps(gltf.document)) == "malformed_file"
        assert refuse("glb", write_glb(gltf.document, gltf.content)) == "malformed_file"


@pytest.mark.parametrize(
    "extension",
    ["KHR_draco_mesh_compression", "EXT_mesh_gpu_instancing", "NEW_one"],
)
def test_an_extension_that_is_not_read_is_named(extension: str) -> None:
    gltf = build_triangle()
    gltf.document["extensionsRequired"] = [extension]
    assert refuse("glb", gltf.write()) == "format_not_read"


def test_extensions_of_materials_do_not_matter() -> None:
    gltf = build_triangle()
    gltf.document["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform"]
    assert read("glb", gltf.write()).corners.tolist() == [TRIANGLE]


def test_instances_on_the_gpu_and_compressed_primitives_are_refused() -> None:
    gltf = build_triangle()
    gltf.document["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {}}}
    assert refuse("glb", gltf.write()) == "format_not_read"
    gltf = Gltf()
    position = gltf.accessor(None, "f4", 3, 2)
    extensions = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}
    gltf.node(mesh=gltf.mesh(POSITION=position, extensions=extensions))
    gltf.view(bytes(8))
    assert refuse("glb", gltf.write()) == "format_not_read"


def test_lines_and_points_alone_are_no_mesh() -> None:
    for mode in (0, 1, 2, 3):
        assert refuse("glb", build_triangle(mode=mode).write()) == "no_geometry"
    assert refuse("glb", write_glb({"asset": {"version": "2.0"}})) == "no_geometry"


def _change(path: str, value: Any) -> Any:
    """A function that sets the value at a path of a document."""

    def change(document: dict[str, Any]) -> None:
        *outer, last = [int(key) if key.isdigit() else key for key in path.split("/")]
        place: Any = document
        for key in outer:
            place = place[key]
        place[last] = value

    return change


FAULTS = [
    ("asset/version", "1.0", "malformed_body"),
    ("asset", 7, "malformed_body"),
    ("accessors/0/count", 4, "malformed_file"),
    ("accessors/0/count", 10**12, "malformed_file"),
    ("accessors/0/count", 2**40 * 3, "too_many_triangles"),
    ("accessors/0/count", -3, "malformed_body"),
    ("accessors/0/count", 3.0, "malformed_body"),
    ("accessors/0/count", "3", "malformed_body"),
    ("accessors/0/type", "VEC2", "malformed_body"),
    ("accessors/0/type", ["VEC3"], "malformed_body"),
    ("accessors/0/componentType", 5125, "malformed_body"),
    ("accessors/0/componentType", 5130, "malformed_body"),
    ("accessors/0/componentType", {}, "malformed_body"),
    ("accessors/0/sparse", [], "malformed_body"),
    ("accessors/0/sparse", {}, "malformed_body"),
    ("bufferViews/0/extensions", 5, "malformed_body"),
    ("bufferViews/0/extensions", {"EXT_meshopt_compression": []}, "malformed_body"),
    ("nodes/0/extensions", 5, "malformed_body"),
    ("accessors/0/bufferView", 7, "malformed_body"),
    ("accessors/0/bufferView", -1, "malformed_body"),
    ("accessors/0/byteOffset", 4, "malformed_file"),
    ("bufferViews/0/byteOffset", 10**9, "malformed_file"),
    ("bufferViews/0/byteLength", 35, "malformed_file"),
    ("bufferViews/0/byteStride", 10**9, "malformed_file"),
    ("bufferViews/0/byteStride", 4, "malformed_file"),
    ("bufferViews/0/byteStride", 0, "malformed_file"),
    ("bufferViews/0/buffer", 3, "malformed_body"),
    ("bufferViews/0", None, "malformed_body"),
    ("buffers/0/byteLength", 10**10, "malformed_file"),
    ("meshes/0/primitives/0/attributes/POSITION", 9, "malformed_body"),
    ("meshes/0/primitives/0/attributes", [], "malformed_body"),
    ("meshes/0/primitives/0/indices", 9, "malformed_body"),
    ("meshes/0/primitives/0/indices", [0], "malformed_body"),
    ("meshes/0/primitives/0/indices", 0, "malformed_body"),
    ("meshes/0/primitives/0/mode", 7, "no_geometry"),
    ("meshes/0/primitives", {}, "malformed_body"),
    ("nodes/0/mesh", 1, "malformed_body"),
    ("nodes/0/mesh", "0", "malformed_body"),
    ("nodes/0/children", [0], "malformed_body"),
    ("nodes/0/children", [5], "malformed_body"),
    ("nodes/0/children", 5, "malformed_body"),
    ("nodes/0/matrix", [1.0] * 15, "malformed_body"),
    ("nodes/0/matrix", [[1.0] * 4] * 4, "malformed_body"),
    ("nodes/0/matrix", [10**400] * 16, "malformed_body"),
    ("nodes/0/matrix", [1e308] * 16, "not_finite"),
    ("nodes/0/rotation", [0, 0, 0, 0], "malformed_body"),
    ("nodes/0/rotation", "none", "malformed_body"),
    ("nodes/0/scale", [None] * 3, "malformed_body"),
    ("nodes/0/translation", [1e39, 0, 0], "coordinate_too_large"),
    ("nodes/0/translation", [True, 0, 0], "malformed_body"),
    ("scenes/0/nodes", [0, 0], "malformed_body"),
    ("scenes/0/nodes", [], "no_geometry"),
    ("scene", 2, "malformed_body"),
    ("scenes", 2, "malformed_body"),
    ("extensionsRequired", "KHR", "malformed_body"),
    ("extensionsRequired", [{}], "format_not_read"),
]


@pytest.mark.parametrize(("path", "value", "code"), FAULTS)
def test_a_wrong_value_is_refused(path: str, value: Any, code: str) -> None:
    gltf = build_triangle()
    gltf.write()
    _change(path, value)(gltf.document)
    assert refuse("glb", write_glb(gltf.document, gltf.content)) == code


def test_wrong_indices_are_refused() -> None:
    for indices, code in (([0, 1, 4], "index_out_of_range"), ([0, 1], "malformed_file")):
        gltf = Gltf()
        gltf.node(mesh=gltf.mesh(POSITION=gltf.array(SQUARE), indices=gltf.array(indices, "u2")))
        assert refuse("glb", gltf.write()) == code


def test_counts_beside_positions_are_checked_before_anything_is_allocated() -> None:
    gltf = Gltf()
    normals = gltf.accessor(None, "f4", 10**12, 2)
    gltf.node(mesh=gltf.mesh(POSITION=gltf.array(TRIANGLE), NORMAL=normals))
    assert refuse("glb", gltf.write()) == "malformed_file"
    changes = {"count": 10**12, "indices": {"componentType": CODES["u2"]}, "values": {}}
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(POSITION=gltf.accessor(None, "f4", 3, 2, sparse=changes)))
    assert refuse("glb", gltf.write()) == "malformed_file"


def test_changes_are_changes_of_items() -> None:
    view = np.array([3], "<u2").tobytes()
    gltf = Gltf()
    indices = {"componentType": CODES["u2"], "bufferView": gltf.view(view)}
    changes = {"count": 1, "indices": indices, "values": {}}
    gltf.node(mesh=gltf.mesh(POSITION=gltf.accessor(None, "f4", 3, 2, sparse=changes)))
    assert refuse("glb", gltf.write()) == "malformed_file"


def test_coordinates_are_finite() -> None:
    for value in (np.nan, np.inf):
        gltf = Gltf()
        gltf.node(mesh=gltf.mesh(POSITION=gltf.array([[0, 0, 0], [1, 0, 0], [0, value, 0]])))
        assert refuse("glb", gltf.write()) == "not_finite"


def test_containers_are_checked() -> None:
    content = build_triangle().write()
    assert refuse("glb", content[:-1]) == "malformed_file"
    assert refuse("glb", b"glTG" + content[4:]) == "malformed_body"
    assert refuse("glb", content[:4] + struct.pack("<I", 1) + content[8:]) == "malformed_body"
    assert (
        refuse("glb", content[:12] + struct.pack("<I", 2**32 - 1) + content[16:])
        == "malformed_file"
    )
    assert refuse("glb", content[:20] + b"}" + content[21:]) == "malformed_body"
    assert refuse("glb", b"") == "malformed_body"
    assert refuse("gltf", "[" * 100_000) == "malformed_body"
    assert refuse("gltf", "[]") == "malformed_body"
    # Bytes after the file, and chunks after the two, do not matter.
    assert read("glb", content + b"more").corners.tolist() == [TRIANGLE]


def test_many_instances_are_counted_before_they_are_placed() -> None:
    gltf = Gltf()
    points = np.zeros((300, 3))
    mesh = gltf.mesh(POSITION=gltf.array(points))
    gltf.document["meshes"][mesh]["primitives"] *= 20
    for _ in range(5):
        gltf.node(mesh=mesh)
    assert len(read("glb", gltf.write()).triangles) == 10_000
    gltf.node(mesh=mesh)
    assert refuse("glb", gltf.write()) == "too_many_triangles"
