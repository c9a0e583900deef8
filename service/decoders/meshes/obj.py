"""Polygons of Wavefront OBJ, of all its objects and groups, with their normals.

trimesh sorts faces by their materials, counts negative indices from the end of the file, and takes
the index 0 for the first vertex: so a plain file has positive indices, and no materials.
"""

import numpy as np

from service.decoders.format import FileLimits
from service.decoders.meshes.content import PlainFile, check_corners, check_size
from service.decoders.meshes.polygons import count_triangles, divide_fan
from service.decoders.obj_text import ObjText
from service.errors import InvalidRequest, Issue

MAX_DIGITS = 10
"""The most characters of an index."""


def write_plain(content: bytes, limits: FileLimits) -> PlainFile:
    """A file of positions, of normals if all faces have them, and of triangles.

    Raises
    ------
    MalformedBody, InvalidRequest, TooLarge
        Errors name the line.
    """
    text = ObjText(content)
    vertices, normals = list[bytes](), list[bytes]()
    faces: list[list[tuple[int, int]]] = []
    for key, *words in text.read_statements():
        if key == b"v":
            if len(words) < 3:
                raise text.build_error("A vertex has three coordinates", "fewer", "v x y z")
            vertices.append(b"v " + b" ".join(words[:3]))
        elif key == b"vn":
            normals.append(b"vn " + b" ".join(words[:3]))
        elif key in {b"f", b"fo"}:
            try:
                faces.append([_parse_corner(word, len(vertices), len(normals)) for word in words])
            except ValueError:
                message, needed = "A corner of a face is a whole number", "v, v/vt, v//vn, v/vt/vn"
                raise text.build_error(message, "something else", needed) from None
    corners = np.fromiter(map(len, faces), np.intp, len(faces))
    check_corners(corners)
    check_size(len(vertices), count_triangles(corners), limits)
    pairs = np.array([pair for face in faces for pair in face])
    _check_indices(pairs[:, 0], len(vertices), "vertices")
    has_normals = bool((pairs[:, 1] != 0).all())
    if has_normals:
        _check_indices(pairs[:, 1], len(normals), "normals")
    form = b"f %d//%d %d//%d %d//%d" if has_normals else b"f %d %d %d"
    width = 2 if has_normals else 1
    rows = [
        form % tuple(number for corner in triangle for number in corner[:width])
        for face in faces
        for triangle in divide_fan(face)
    ]
    plain = [*vertices, *(normals if has_normals else ()), *rows, b""]
    return PlainFile(b"\n".join(plain), corners, None if has_normals else len(vertices))


def _parse_corner(word: bytes, vertices: int, normals: int) -> tuple[int, int]:
    """The numbers, from 1, of the vertex and of the normal of a corner; 0 for no normal.

    `vertices` and `normals` are how many there are so far: negative numbers count back from there.
    """
    position, *others = word.split(b"/")
    normal = others[1] if len(others) > 1 else b""
    return _parse_number(position, vertices), _parse_number(normal, normals) if normal else 0


def _parse_number(word: bytes, count: int) -> int:
    if len(word) > MAX_DIGITS or b"_" in word:
        raise ValueError("no index")
    number = int(word)
    return number if number >= 0 else number + count + 1


def _check_indices(numbers: np.ndarray, count: int, nouns: str) -> None:
    """Refuse numbers that are not from 1 to `count`."""
    if numbers.min() < 1 or numbers.max() > count:
        message = f"Faces index the {nouns} of the file from 1, or from -1 backwards."
        wrong = int(numbers[(numbers < 1) | (numbers > count)][0])
        needed = f"1 to {count}" if count else f"{nouns} in the file"
        raise InvalidRequest(Issue("index_out_of_range", message, "", str(wrong), needed))
