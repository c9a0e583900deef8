"""OFF as text, with colours, normals or texture coordinates, of which none are read."""

import re
from itertools import islice

import numpy as np

from service.decoders.format import FileLimits, build_file_error, build_malformed_error
from service.decoders.meshes.content import PlainFile, check_corners, check_size
from service.decoders.meshes.polygons import count_triangles, divide_fan

_HEAD = re.compile(rb"\s*(?:ST)?C?N?OFF\s+(?!BINARY)")
_COMMENT = re.compile(rb"#[^\r\n]*")
_LINE = re.compile(rb"[^\r\n]+")

MAX_DIGITS = 9
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
    faces = []
    for words in islice(lines, face_count):
        if not _is_count(words[0]) or not int(words[0]) < len(words):
            message, got = "A face does not have the corners that it counts.", "another number"
            raise build_file_error(message, got, "their number, and as many indices")
        faces.append(words[1 : int(words[0]) + 1])
    if len(vertices) < vertex_count or len(faces) < face_count:
        got = f"{len(vertices)} vertices and {len(faces)} faces"
        needed = f"{vertex_count} and {face_count}, in lines of their own"
        raise build_file_error("The file ends too early.", got, needed)
    corners = np.fromiter(map(len, faces), np.intp, face_count)
    check_corners(corners)
    count = count_triangles(corners)
    check_size(vertex_count, count, limits)
    rows = [b"3 %b %b %b" % triangle for face in faces for triangle in divide_fan(face)]
    plain = [b"OFF", b"%d %d 0" % (vertex_count, count), *vertices, *rows]
    return PlainFile(b"\n".join(plain), corners, vertex_count)


def _is_count(word: bytes) -> bool:
    return word.isdigit() and len(word) <= MAX_DIGITS
