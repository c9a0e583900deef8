"""Polygons of Wavefront OBJ, of all its objects and groups, with their normals.

trimesh sorts faces by their materials, counts negative indices from the end of the file, and takes
the index 0 for the first vertex: so a plain file has positive indices, and no materials.
"""

from array import array
from collections.abc import Sequence

import numpy as np

from service.bases.arrays import Ints
from service.decoders.format import FileLimits
from service.decoders.meshes.content import PlainFile, check_corners, check_size
from service.decoders.meshes.polygons import count_triangles, divide_fans, write_rows
from service.decoders.obj_text import ObjText
from service.errors import InvalidRequest, Issue

_NEEDED = "v, v/vt, v//vn or v/vt/vn, each a whole number"


class _Corners:
    """The corners of faces, one after another: the numbers, from 1, of vertices and of normals."""

    def __init__(self, *, has_underscores: bool) -> None:
        self._has_underscores = has_underscores
        self.counts, self.vertices, self.normals = array("q"), array("q"), array("q")

    def add(self, words: Sequence[bytes], vertices: int, normals: int) -> None:
        """Adds a face; so far the file has this many vertices and normals.

        Negative numbers count back from there. The number of the normal is 0 if there is none.

        Raises
        ------
        ValueError, OverflowError
            A word is no corner.
        """
        # Python reads `_` in numbers.
        if self._has_underscores and any(b"_" in word for word in words):
            raise ValueError("no whole number")
        parts = [word.split(b"/") for word in words]
        numbers = [int(each[0]) for each in parts]
        others = [int(each[2]) if len(each) > 2 and each[2] else 0 for each in parts]
        if numbers and min(*numbers, *others) < 0:
            numbers = [each if each >= 0 else each + vertices + 1 for each in numbers]
            others = [each if each >= 0 else each + normals + 1 for each in others]
        self.counts.append(len(words))
        self.vertices.extend(numbers)
        self.normals.extend(others)


def write_plain(content: bytes, limits: FileLimits) -> PlainFile:
    """A file of positions, of normals if all corners have one, and of triangles.

    Raises
    ------
    MalformedBody, InvalidRequest, TooLarge
        Errors of form name the line.
    """
    text = ObjText(content)
    vertices, normals, found = (
        list[bytes](),
        list[bytes](),
        _Corners(has_underscores=b"_" in content),
    )
    for key, *words in text.read_statements():
        if key == b"v":
            if len(words) < 3:
                raise text.build_error("A vertex has three coordinates", "fewer", "v x y z")
            vertices.append(b"v %b %b %b\n" % (*words[:3],))
        elif key == b"vn":
            normals.append(b"vn %b\n" % b" ".join(words[:3]))
        elif key in {b"f", b"fo"}:
            try:
                found.add(words, len(vertices), len(normals))
            except (ValueError, OverflowError):
                message = "A corner of a face is a whole number"
                raise text.build_error(message, "something else", _NEEDED) from None
    counts = np.array(found.counts, np.intp)
    check_corners(counts)
    check_size(len(vertices), count_triangles(counts), limits)
    triangles, numbers = divide_fans(counts), np.array(found.vertices)
    _check_numbers(numbers, len(vertices), "vertices")
    if not all(found.normals):
        rows = write_rows(b"f %d %d %d\n", numbers[triangles])
        return PlainFile(b"".join(vertices) + rows, counts, len(vertices))
    normal_numbers = np.array(found.normals)
    _check_numbers(normal_numbers, len(normals), "normals")
    pairs = np.stack([numbers, normal_numbers], axis=1)[triangles].reshape(-1, 6)
    rows = write_rows(b"f %d//%d %d//%d %d//%d\n", pairs)
    return PlainFile(b"".join(vertices + normals) + rows, counts, None)


def _check_numbers(numbers: Ints, count: int, nouns: str) -> None:
    """Refuse numbers that are not from 1 to `count`."""
    if numbers.min() < 1 or numbers.max() > count:
        message = f"Faces index the {nouns} of the file from 1, or from -1 backwards."
        wrong = int(numbers[(numbers < 1) | (numbers > count)][0])
        needed = f"1 to {count}" if count else f"{nouns} in the file"
        raise InvalidRequest(Issue("index_out_of_range", message, "", str(wrong), needed))
