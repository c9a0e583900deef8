"""OBJ, PLY, STL and OFF files made by hand: all forms of faces, and values that are wrong."""

import struct

import numpy as np
import pytest

from tests.decoders.meshes.files import read, refuse

SQUARE: list[list[float]] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]]
CORNERS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\n"
NORMALS = "vn 0 0 1\nvn 0 1 0\n"


@pytest.mark.parametrize(
    ("text", "triangles"),
    [
        ("f 1 2 3\nf 1 3 4", [[0, 1, 2], [0, 2, 3]]),
        ("f 1 2 3 4\nf 1 2 3", [[0, 1, 2], [0, 2, 3], [0, 1, 2]]),
        ("f -4 -3 -2\nf 1 -2 -1", [[0, 1, 2], [0, 2, 3]]),
        ("f 1/1 2/1 3/1\nf 1//1 3//2 4//1\nf 1/1/1 2/2/2 3/3/3", [[0, 1, 2], [0, 2, 3], [0, 1, 2]]),
        # Six numbers are a face of six corners, or three corners with normals.
        ("f 1//1 2//1 3//1\nf 1 2 3 4 3 2", [[0, 1, 2], *([0, k, k + 1] for k in (1, 2)),
                                            [0, 3, 2], [0, 2, 1]]),
        ("  f\t1 2 \\\n 3 # a face\ng part\nusemtl b\nf 3 4 1\nusemtl a\nf 1 2 4",
         [[0, 1, 2], [2, 3, 0], [0, 1, 3]]),
        ("o a b\ns off\nl 1 2 3\np 1\nfo 1 2 3\nmtllib x.mtl\nf 2 3 4", [[0, 1, 2], [1, 2, 3]]),
    ],
)  # fmt: skip
def test_faces_of_obj(text: str, triangles: list[list[int]]) -> None:
    mesh = read("obj", "# words\nvt 0 0\nvt 1 1\nvt 2 2\n" + NORMALS + CORNERS + text)
    assert mesh.corners.tolist() == [[SQUARE[k] for k in row] for row in triangles]
    assert mesh.normals is None


def test_negative_indices_of_obj_count_from_their_line() -> None:
    mesh = read("obj", CORNERS + "f -4 -3 -2\nv 7 7 7\nv 8 8 8\nf -1 -2 1\n")
    assert mesh.triangles.tolist() == [[0, 1, 2], [5, 4, 0]]


def test_vertices_of_obj_have_the_normals_of_their_corners() -> None:
    text = CORNERS + NORMALS + "f 1//1 2//1 3//2\nf 1/9/2 3/9/-2 4/9/1\n"
    mesh = read("obj", text)
    assert mesh.normals is not None
    up, across = [0, 0, 1], [0, 1, 0]
    assert mesh.normals[mesh.triangles].tolist() == [[up, up, across], [across, up, up]]
    assert mesh.corners.tolist() == [[SQUARE[k] for k in row] for row in ([0, 1, 2], [0, 2, 3])]


def test_weights_and_colours_of_obj_are_left_out() -> None:
    text = "v 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 0 1e0 +0.0\nf 1 2 3"
    assert read("obj", text).corners.tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "no_geometry"),
        ("f 1 2 0", "index_out_of_range"),
        ("f 1 2 5", "index_out_of_range"),
        ("f 1 2 -5", "index_out_of_range"),
        ("f 1//1 2//1 3//7", "index_out_of_range"),
        ("f 1 2 9999999999", "index_out_of_range"),
        ("f 1 2 99999999999999999999", "malformed_body"),
        ("f 1 2", "malformed_file"),
        ("f", "malformed_file"),
        ("f 1 2 x", "malformed_body"),
        ("f 1 2 3.0", "malformed_body"),
        ("f 1 2 1_0", "malformed_body"),
        ("f /1 /2 /3", "malformed_body"),
        ("v 1 2\nf 1 2 3", "malformed_body"),
        ("v 1 2 x\nf 1 2 3", "malformed_file"),
        ("v nan 0 0\nf 1 2 3", "not_finite"),
        ("v 1e999 0 0\nf 1 2 3", "not_finite"),
        (f"v {'9' * 5000} 0 0\nf 1 2 3", "not_finite"),
        ("v 1e39 0 0\nf 1 2 3", "coordinate_too_large"),
        ("f " + "1 " * 10_003, "too_many_triangles"),
        ("v 0 0 0\n" * 30_001 + "f 1 2 3", "too_many_vertices"),
    ],
)
def test_a_wrong_obj_is_refused(text: str, code: str) -> None:
    assert refuse("obj", CORNERS + NORMALS + text) == code


HEADER = """ply
format ascii 1.0
comment words
element vertex 4
property float x
property double y
property float32 z
element face 2
property list uchar int vertex_indices
end_header
"""
VERTICES = "0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n"


def test_faces_of_a_text_of_ply() -> None:
    mesh = read("ply", HEADER + VERTICES + "3 0 1 2\n4 0 1 2 3\n", "13")
    assert mesh.positions.tolist() == SQUARE
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 1, 3], [1, 2, 3]]
    polygon = (
        HEADER.replace("vertex 4", "vertex 5") + VERTICES + "0 0 9\n" + "5 0 1 2 3 4\n3 4 1 0\n"
    )
    assert read("ply", polygon).triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [4, 1, 0]]
    lines = polygon.replace("\n", "\r\n")
    assert read("ply", lines).triangles.tolist() == read("ply", polygon).triangles.tolist()


@pytest.mark.parametrize("order", ["<", ">"])
def test_faces_of_a_binary_ply(order: str) -> None:
    """Elements and properties that are not needed are before, between and after those that are."""
    header = f"""ply
format binary_{"little" if order == "<" else "big"}_endian 1.0
element camera 2
property list ushort double view
property char k
element vertex 4
property uchar red
property double x
property float nx
property float y
property float z
property float ny
property float nz
property float s
property float t
element edge 1
property int vertex1
element face 3
property float quality
property list uchar float texcoord
property list uint short vertex_index
property uchar flag
element last 1
property int last
end_header
"""
    content = header.encode()
    for values in ([1.0], [2.0, 3.0]):
        content += struct.pack(f"{order}H{len(values)}db", len(values), *values, -1)
    for k, (x, y, z) in enumerate(SQUARE):
        content += struct.pack(order + "Bdfffffff", 9, x, 0, y, z, k, 1, 0.5, 0.25)
    content += struct.pack(order + "i", 5)
    for row in ([0, 1, 2], [0, 1, 2, 3], [3, 2, 0]):
        content += struct.pack(f"{order}fB2f", 0.5, 2, 7, 8)
        content += struct.pack(f"{order}I{len(row)}hB", len(row), *row, 1)
    content += struct.pack(order + "i", 6)
    mesh = read("ply", content)
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [3, 2, 0]]
    assert mesh.positions.tolist() == SQUARE
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[0, k, 1] for k in range(4)]
    for end in range(len(header), len(content) - 4):
        assert refuse("ply", content[:end]) == "malformed_file"


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("ply\n", "plx\n", "malformed_body"),
        ("end_header", "end", "malformed_body"),
        ("ascii 1.0", "unary 1.0", "malformed_body"),
        ("format ascii 1.0\n", "", "malformed_body"),
        ("element vertex 4", "element vertex -4", "malformed_body"),
        ("element vertex 4", "element vertex 99999999999", "malformed_body"),
        ("element vertex 4", "element vertex 9999999999", "too_many_vertices"),
        ("element vertex 4", "element vertex 5", "malformed_file"),
        ("element face 2", "element face 2000000000", "too_many_triangles"),
        ("element face 2", "element face 3", "malformed_file"),
        ("element face 2", "element face 0", "no_geometry"),
        ("element face 2", "element tristrips 2", "malformed_body"),
        ("element face 2", "element other 4000000000\nelement face 2", "malformed_file"),
        ("element face", "element vertex 1\nelement face", "malformed_body"),
        ("property float x", "property float w", "malformed_body"),
        ("property float x", "property float y", "malformed_body"),
        ("property float x", "property text x", "malformed_body"),
        ("property float x", "property list uchar float x", "malformed_body"),
        ("uchar int vertex_indices", "uchar float vertex_indices", "malformed_body"),
        ("property list uchar int vertex_indices\n", "property int a\n", "malformed_body"),
        ("1 1 0\n", "1 1\n", "malformed_file"),
        ("1 1 0\n", "1 1 one\n", "malformed_file"),
        ("1 1 0\n", "1 1 nan\n", "not_finite"),
        ("1 1 0\n", "1 1 1e400\n", "not_finite"),
        ("3 0 1 2", "3 0 1", "malformed_file"),
        ("3 0 1 2", "2 0 1", "malformed_file"),
        ("3 0 1 2", "-3 0 1 2", "malformed_file"),
        ("3 0 1 2", "3 0 1 4", "index_out_of_range"),
        ("3 0 1 2", "3 0 1 -1", "index_out_of_range"),
        ("3 0 1 2", "3 0 1 2.5", "malformed_file"),
        ("3 0 1 2", "x 0 1 2", "malformed_file"),
    ],
)
def test_a_wrong_ply_is_refused(old: str, new: str, code: str) -> None:
    text = HEADER + VERTICES + "3 0 1 2\n4 0 1 2 3\n"
    assert old in text
    assert refuse("ply", text.replace(old, new, 1)) == code


def test_a_header_of_ply_has_an_end() -> None:
    for content in (b"", b"ply", b"ply\n", b"ply\n" * 100_000, b"\0" * 100):
        assert refuse("ply", content) == "malformed_body"


STL = """solid a facet vertex
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  VERTEX 1 0 0
  vertex 1e0 1 0
 endloop
endfacet
endsolid a facet vertex
"""


def test_texts_of_stl() -> None:
    assert read("stl", STL).corners.tolist() == [SQUARE[:3]]
    assert len(read("stl", STL * 3).triangles) == 3
    assert read("stl", STL.replace("\n", "\r\n")).corners.tolist() == [SQUARE[:3]]


def test_a_binary_stl_may_begin_as_a_text() -> None:
    numbers = np.arange(24, dtype="<f4").reshape(2, 12)
    records = b"".join(row.tobytes() + b"\0\0" for row in numbers)
    content = b"solid of a program".ljust(80) + struct.pack("<I", 2) + records
    mesh = read("stl", content)
    assert mesh.corners.reshape(2, 9).tolist() == numbers[:, 3:].tolist()
    assert mesh.normals is None
    for end in (0, 5, 80, 83, 84, 90, len(content) - 1):
        assert refuse("stl", content[:end]) in {"malformed_body", "no_geometry"}
    assert refuse("stl", content[:80] + b"\xff" * 4 + content[84:]) == "no_geometry"
    assert refuse("stl", bytes(80) + b"\xff" * 4 + content[84:]) == "malformed_body"
    assert refuse("stl", bytes(84)) == "no_geometry"
    many = bytes(80) + struct.pack("<I", 10_001) + bytes(50 * 10_001)
    assert refuse("stl", many) == "too_many_triangles"


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("  VERTEX 1 0 0\n", "", "malformed_file"),
        ("1 0 0", "1 0", "malformed_file"),
        ("1 0 0", "1 0 0 0", "malformed_file"),
        ("1 0 0\n  vertex 1e0 1 0", "1 0\n  vertex 1e0 1 0 0", "malformed_file"),
        ("1 0 0", "1 0 zero", "malformed_file"),
        ("1 0 0", "1 0 \udcff", "malformed_file"),
        ("1 0 0", "1 0 inf", "not_finite"),
        ("1 0 0", "1 0 1e39", "coordinate_too_large"),
        ("solid a", "body a", "malformed_body"),
    ],
)
def test_a_wrong_text_of_stl_is_refused(old: str, new: str, code: str) -> None:
    assert old in STL
    assert refuse("stl", STL.replace(old, new, 1)) == code


OFF = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n3 0 1 2\n4 0 1 2 3\n"


def test_forms_of_off() -> None:
    triangles = [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    assert read("off", OFF).triangles.tolist() == triangles
    assert read("off", OFF).positions.tolist() == SQUARE
    colored = OFF.replace("OFF", "COFF").replace("0 0 0\n", "0 0 0 1 0 0 1\n")
    normals = OFF.replace("OFF", "NOFF").replace("1 1 0\n", "1 1 0 0 0 1 # a normal\n")
    others = (
        OFF.replace("OFF\n", "OFF "),
        "# words\n\n" + OFF.replace("\n", "\r\n\r\n"),
        OFF.replace("3 0 1 2", "3 0 1 2 255 0 0"),
        colored,
        normals,
        OFF.replace("OFF", "STCNOFF"),
    )
    for text in others:
        assert read("off", text).triangles.tolist() == triangles
        assert read("off", text).positions.tolist() == SQUARE


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("OFF", "4OFF", "malformed_body"),
        ("OFF", "nOFF", "malformed_body"),
        ("OFF", "OFF BINARY", "malformed_body"),
        ("OFF", "", "malformed_body"),
        ("4 2 0", "4", "malformed_body"),
        ("4 2 0", "4.0 2 0", "malformed_body"),
        ("4 2 0", "-4 2 0", "malformed_body"),
        ("4 2 0", "5 2 0", "malformed_file"),
        ("4 2 0", "4 3 0", "malformed_file"),
        ("4 2 0", "4 0 0", "no_geometry"),
        ("4 2 0", "999999999 2 0", "too_many_vertices"),
        ("4 2 0", "4 999999999 0", "too_many_triangles"),
        ("4 2 0", "4 99999999999999999999 0", "malformed_body"),
        ("1 1 0", "1 1", "malformed_file"),
        ("1 1 0", "1 1 x", "malformed_file"),
        ("1 1 0", "1 1 nan", "not_finite"),
        ("3 0 1 2", "3 0 1", "malformed_file"),
        ("3 0 1 2", "2 0 1", "malformed_file"),
        ("3 0 1 2", "x 0 1 2", "malformed_file"),
        ("3 0 1 2", "3 0 1 4", "index_out_of_range"),
        ("3 0 1 2", "3 0 1 -1", "malformed_file"),
        ("3 0 1 2", "3 0 1 2.5", "malformed_file"),
    ],
)
def test_a_wrong_off_is_refused(old: str, new: str, code: str) -> None:
    assert old in OFF
    assert refuse("off", OFF.replace(old, new, 1)) == code
