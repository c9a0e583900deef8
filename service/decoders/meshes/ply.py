"""PLY, as text and in both binary forms, with normals of vertices.

trimesh reads a binary file only if all faces have the same number of corners. So a plain file has
triangles. It keeps the vertices as they are, but all properties other than positions and normals
get names that mean nothing.
"""

from array import array
from itertools import islice
from typing import Literal

import numpy as np

from service.bases.arrays import AnyArray, Ints
from service.decoders.format import FileLimits, build_file_error, build_malformed_error
from service.decoders.meshes.content import PlainFile, check_corners, check_indices, check_size
from service.decoders.meshes.ply_header import Element, Header, parse_header
from service.decoders.meshes.polygons import count_triangles, divide_fans, write_rows
from service.errors import InvalidRequest

POSITION, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")

INDEX_NAMES = ("vertex_indices", "vertex_index")
"""The names of the list of a face's corners."""

_NAMES = {"f4": "float", "f8": "double", "i1": "char", "u1": "uchar", "i2": "short"} | {
    **{"u2": "ushort", "i4": "int", "u4": "uint"}
}


def write_plain(content: bytes, limits: FileLimits) -> PlainFile:
    """A file of the same form with the vertices, and of triangles.

    Raises
    ------
    MalformedBody, InvalidRequest, TooLarge
    """
    header = parse_header(content)
    found = {element.name: element for element in header.elements}
    vertex, face = found.get("vertex"), found.get("face")
    if vertex is None or face is None or len(found) < len(header.elements):
        needed = "one element vertex, and one element face"
        raise build_malformed_error("The header lacks an element.", "other elements", needed)
    names = [each.name for each in vertex.properties]
    if not set(POSITION) <= set(names) or len(set(names)) < len(names) or vertex.has_lists:
        needed = "x, y and z, each name once, and no lists"
        raise build_malformed_error("Vertices have other properties.", "others", needed)
    check_size(vertex.length, face.length, limits)
    read = _read_text if header.form == "ascii" else _read_binary
    vertices, corners, indices = read(content, header)
    check_corners(corners)
    check_size(vertex.length, count_triangles(corners), limits)
    check_indices(indices, vertex.length)
    triangles = indices[divide_fans(corners)]
    body = vertices + _write_triangles(triangles, header.form)
    plain = _write_header(header.form, vertex, len(triangles)) + body
    return PlainFile(plain, corners, vertex.length)


def _read_text(content: bytes, header: Header) -> tuple[bytes, Ints, Ints]:
    """The lines of the vertices, the number of corners of each face, and the indices of them all.

    Each element is a line.
    """
    lines = (line for line in content[header.end :].splitlines() if line.strip())
    vertices, counts, indices = b"", array("q"), array("q")
    for element in header.elements:
        rows = list(islice(lines, element.length))
        if len(rows) < element.length:
            raise _too_short()
        if element.name == "vertex":
            vertices = b"".join(row + b"\n" for row in rows)
        elif element.name == "face":
            for row in rows:
                corners = _parse_corners(row.split(), element)
                counts.append(len(corners))
                indices.extend(corners)
    return vertices, np.array(counts, np.intp), np.array(indices, np.intp)


def _parse_corners(words: list[bytes], face: Element) -> list[int]:
    """The corners of a face in a line of a text."""
    chosen, place = _choose_list(face), 0
    for number, each in enumerate(face.properties):
        try:
            count = int(words[place]) if each.count else 1
            place += bool(each.count)
            values = words[place : place + count]
            if number == chosen:
                corners = [*map(int, values)]
                if len(corners) == count:
                    return corners
                break
        except (ValueError, IndexError):
            break
        place += count
    message, needed = (
        "A face does not have the corners that it counts.",
        "indices after their number",
    )
    raise build_file_error(message, "another line", needed)


def _choose_list(face: Element) -> int:
    """The number of the property that has the corners of a face."""
    lists = [number for number, each in enumerate(face.properties) if each.count]
    named = [number for number in lists if face.properties[number].name in INDEX_NAMES]
    chosen = named or lists
    if len(chosen) != 1 or face.properties[chosen[0]].number[-2] == "f":
        needed = "one list vertex_indices of whole numbers"
        raise build_malformed_error("Faces have no list of their corners.", "other lists", needed)
    return chosen[0]


def _read_binary(content: bytes, header: Header) -> tuple[bytes, Ints, Ints]:
    """As `_read_text`, with the bytes of the vertices."""
    vertices, corners, indices = b"", np.empty(0, np.intp), np.empty(0, np.intp)
    start = header.end
    for element in header.elements:
        if element.has_lists:
            chosen = _choose_list(element) if element.name == "face" else 0
            places, counts, end = _find_lists(content, start, element, chosen)
            if element.name == "face":
                corners = counts
                indices = _gather(content, places, counts, element.properties[chosen].number)
        else:
            end = start + element.length * element.dtype.itemsize
            if end > len(content):
                raise _too_short()
            if element.name == "vertex":
                vertices = content[start:end]
        start = end
    return vertices, corners, indices


def _find_lists(
    content: bytes, start: int, element: Element, chosen: int
) -> tuple[Ints, Ints, int]:
    """Where the numbers of the chosen list of each element begin, how many there are, and the end.

    Elements may have lists of different lengths, so one follows from another.
    """
    # For each property: bytes of its count, whether that is signed, bytes of a number, and whether
    # it is the chosen one.
    steps = [
        (int((each.count or "0")[-1]), each.count[-2:-1] == "i", int(each.number[-1]), k == chosen)
        for k, each in enumerate(element.properties)
    ]
    if any(each.count[-2:-1] == "f" for each in element.properties):
        raise build_malformed_error("A list has no whole number of items.", "float", "uchar or int")
    order: Literal["big", "little"] = "big" if element.properties[0].number[0] == ">" else "little"
    if element.length > len(content):  # each has a byte at least
        raise _too_short()
    places, counts = np.empty(element.length, np.intp), np.empty(element.length, np.intp)
    for row in range(element.length):
        if start >= len(content):
            raise _too_short()
        for count_bytes, is_signed, number_bytes, is_chosen in steps:
            count = 1
            if count_bytes:
                head = content[start : start + count_bytes]
                count = int.from_bytes(head, order, signed=is_signed)
                start += count_bytes
                if count < 0:
                    raise build_file_error(
                        "A list has fewer than no items.", str(count), "0 or more"
                    )
            if is_chosen:
                places[row], counts[row] = start, count
            start += count * number_bytes
    if start > len(content):
        raise _too_short()
    return places, counts, start


def _gather(content: bytes, places: Ints, counts: Ints, number: str) -> Ints:
    """The numbers of lists that begin at these places, one list after another."""
    size = np.dtype(number).itemsize
    # The place of each number: those of a list follow each other.
    firsts = np.cumsum(counts) - counts
    starts = np.repeat(places - size * firsts, counts) + size * np.arange(int(counts.sum()))
    data, digits = np.frombuffer(content, np.uint8), np.empty((len(starts), size), np.uint8)
    for k in range(size):
        digits[:, k] = data[starts + k]
    numbers: Ints = digits.view(number)[:, 0].astype(np.intp)
    return numbers


def _write_header(form: str, vertex: Element, triangles: int) -> bytes:
    """The header of a plain file with the properties of the vertices."""
    kept = {*POSITION, *NORMAL}
    names = [
        each.name if each.name in kept else f"_{k}" for k, each in enumerate(vertex.properties)
    ]
    lines = [
        "ply",
        f"format {form} 1.0",
        f"element vertex {vertex.length}",
        *(
            f"property {_NAMES[each.number[-2:]]} {name}"
            for each, name in zip(vertex.properties, names, strict=True)
        ),
        f"element face {triangles}",
        "property list uchar int vertex_indices",
        "end_header",
        "",
    ]
    return "\n".join(lines).encode()


def _write_triangles(triangles: Ints, form: str) -> bytes:
    """The triangles of a plain file."""
    if form == "ascii":
        return write_rows(b"3 %d %d %d\n", triangles)
    order = ">" if form == "binary_big_endian" else "<"
    records: AnyArray = np.empty(len(triangles), [("count", "u1"), ("corners", order + "i4", (3,))])
    records["count"], records["corners"] = 3, triangles
    return records.tobytes()


def _too_short() -> InvalidRequest:
    needed = "all elements that the header counts"
    return build_file_error("The file ends too early.", "fewer bytes or lines", needed)
