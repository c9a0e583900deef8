"""STL, binary or as text: each triangle has three vertices of its own."""

import re

import numpy as np

from service.decoders.format import FileLimits, build_file_error, build_malformed_error
from service.decoders.meshes.content import PlainFile, check_size

HEADER_BYTES, TRIANGLE_BYTES = 84, 50
"""Bytes of a binary file before its triangles, and of each."""

_SOLID = re.compile(rb"^[ \t]*(?:end)?solid\b[^\r\n]*", re.IGNORECASE | re.MULTILINE)
"""The beginning and the end of a solid, with its name."""

_VERTEX = re.compile(rb"^[ \t]*vertex\b([^\r\n]*)", re.IGNORECASE | re.MULTILINE)
"""A vertex in a line of its own, and its coordinates."""


def write_plain(content: bytes, limits: FileLimits) -> PlainFile:
    """The file; of a text one solid without a name, since a name may have the words of the format.

    Raises
    ------
    MalformedBody, TooLarge
    """
    count = int.from_bytes(content[HEADER_BYTES - 4 : HEADER_BYTES], "little")
    if len(content) != HEADER_BYTES + TRIANGLE_BYTES * count or len(content) < HEADER_BYTES:
        if not _SOLID.match(content.lstrip()):
            got = f"{len(content)} bytes, of which a header counts {count} triangles"
            needed = f"{HEADER_BYTES} bytes and {TRIANGLE_BYTES} for each triangle, or a text"
            message = "The file is not as long as its header says."
            raise build_malformed_error(message, got, needed)
        vertices = _VERTEX.findall(content)
        count, remainder = divmod(len(vertices), 3)
        if remainder:
            message, got = "A triangle lacks a vertex.", f"{len(vertices)} vertices"
            raise build_file_error(message, got, "three for each triangle, in lines of their own")
        if any(len(words.split()) != 3 for words in vertices):
            message, got = "A vertex has three coordinates.", "another number of words"
            raise build_file_error(message, got, "vertex x y z, in a line of its own")
        lines = _SOLID.sub(b"", content).replace(b"\r", b"\n")
        content = b"solid\n%b\nendsolid\n" % lines
    check_size(3 * count, count, limits)
    return PlainFile(content, np.full(count, 3), 3 * count)
