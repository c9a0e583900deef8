"""OFF as text, with colours, normals or texture coordinates, of which none are read."""

import re
from array import array
from collections.abc import Iterator
from itertools import islice

import numpy as np

from service.bases.arrays import Ints
from service.decoders.format import FileLimits, build_file_error, build_malformed_error
from service.decoders.meshes.content import PlainFile, check_corners, check_indices, check_size
from service.decoders.meshes.polygons import count_triangles, divide_fans, write_rows

_HEAD = re.compile(rb"\s*(?:ST)?C?N?OFF(?!\s+BINARY)\s")
_COMMENT = re.compile(rb"#[^\r\n]*")
_LINE = re.compile(rb"[^\r\n]+")

MAX_DIGITS = 12
"""The most digits of a count or an index."""


def write_plain(content: bytes, limits: FileLimits) -> PlainFile:
    """A file of the positions, and of triangles.

    Raises
    ------
    MalformedBody, InvalidRequest, TooLarge
    """
    text = _COMMENT.sub(b"", content)
    head = _HEAD.match(text)
    if head is None:
        needed = "OFF, COFF, NOFF or CNOFF, as text, in three dimensions"
        raise build_malformed_error("The file is not OFF.", "another beginning", needed)
    lines = (words for line in _LINE.finditer(text, head.end()) if (words := line[0].split()))
    counts = next(lines, [])[:2]
    if len(counts) < 2 or not all(map(_is_count, counts)):
        needed = "the numbers of vertices and of faces"
        raise build_malformed_error("The file has no counts.", "another line", needed)
    vertex_count, face_count = map(int, counts)
    check_size(vertex_count, face_count, limits)
    vertices = [b" ".join(words[:3]) for words in islice(lines, vertex_count)]
    corners, indices = _read_faces(lines, face_count)
    if len(vertices) < vertex_count or len(corners) < face_count:
        got = f"{len(vertices)} vertices and {len(corners)} faces"
        needed = f"{vertex_count} and {face_count}, in lines of their own"
        raise build_file_error("The file ends too early.", got, needed)
    check_corners(corners)
    check_size(vertex_count, count_triangles(corners), limits)
    check_indices(indices, vertex_count)
    triangles = indices[divide_fans(corners)]
    start = b"OFF\n%d %d 0\n" % (vertex_count, len(triangles))
    plain = start + b"\n".join(vertices) + b"\n" + write_rows(b"3 %d %d %d\n", triangles)
    return PlainFile(plain, corners, vertex_count)


def _read_faces(lines: Iterator[list[bytes]], face_count: int) -> tuple[Ints, Ints]:
    """The number of corners of each face, and their indices, one face after another."""
    counts, indices = array("q"), array("q")
    for words in islice(lines, face_count):
        count = int(words[0]) if _is_count(words[0]) else len(words)
        corners = words[1 : count + 1]
        if len(corners) < count or not all(map(_is_count, corners)):
            message, got = "A face does not have the corners that it counts.", "another line"
            raise build_file_error(message, got, "their number, and as many whole numbers")
        counts.append(count)
        indices.extend(map(int, corners))
    return np.array(counts, np.intp), np.array(indices, np.intp)


def _is_count(word: bytes) -> bool:
    return word.isdigit() and len(word) <= MAX_DIGITS
