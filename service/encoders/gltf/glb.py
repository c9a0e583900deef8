"""Writes binary glTF files (GLB), with a cached template for meshes whose plan is cached.

The files of two meshes with the same plan, names and attributes differ only in four values: the
vertices, their bounds, the report and the local origin. A template has everything else, that is,
the text of the document around these values, and the bytes of the indices.

References
----------
Khronos, glTF 2.0 Specification: 4.4 GLB layout.
"""

import re
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np

from service.bases.arrays import AnyArray, Ints
from service.bases.cache import derive_once
from service.encoders.content import find_nonempty, is_translucent, report_object
from service.encoders.format import Content, EncodeOptions, pack
from service.encoders.gltf.buffer import JsonObject, PackedBuffer
from service.encoders.gltf.columns import Columns, build_plain_columns
from service.encoders.gltf.document import build_document
from service.encoders.gltf.primitives import split_parts
from service.encoders.text import json_text
from service.engine.extent import is_moved
from service.engine.mesh.mesh import Mesh

GLB_MAGIC, GLB_VERSION, CHUNK_JSON, CHUNK_BIN = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
"""The numbers in the header and in the chunks of a GLB (4.4.2, 4.4.3): "glTF", version 2, "JSON",
and "BIN" with a zero byte."""

PLACEHOLDER = "\ue000{}\ue000"
"""Stands in the text of a template for a value, whose name is inserted at {}. The character is one
of Unicode's private-use characters."""

_PLACEHOLDER = re.compile(f'"{PLACEHOLDER.format("([a-z0-9]+)")}"'.encode())


def encode_glb(mesh: Mesh, options: EncodeOptions) -> Content:
    """The mesh as a binary glTF file.

    A long file is returned in several buffers, some of which may be arrays of the mesh.

    Raises
    ------
    UnsupportedByFormat
        The mesh has quads.
    """
    return _encode_by_template(mesh, options) or write_glb(*build_document(mesh, options))


def write_glb(document: JsonObject, buffer: PackedBuffer) -> Content:
    """Write a document and its buffer as a binary glTF file."""
    length = buffer.length
    if length:
        document["buffers"] = [{"byteLength": length}, *buffer.empty_buffers]
    return _assemble(json_text(document), buffer.chunks, length)


def _assemble(text: bytes, chunks: Iterable[memoryview | bytes], length: int) -> Content:
    """Assemble a binary file (4.4): header, JSON chunk, and the chunk of a buffer.

    The buffer has `length` bytes; without bytes, the file has no such chunk.
    """
    text += b" " * (-len(text) % 4)
    binary_head = struct.pack("<II", length, CHUNK_BIN) if length else b""
    total = 12 + 8 + len(text) + len(binary_head) + length
    head = struct.pack("<5I", GLB_MAGIC, GLB_VERSION, total, len(text), CHUNK_JSON)
    return pack((head + text + binary_head, *chunks))


@dataclass(frozen=True, eq=False, slots=True)
class Template:
    """A binary file in which vertices, bounds, report and origin are missing.

    Attributes
    ----------
    text : tuple of bytes
        The JSON text in parts: text, name of a missing value, text, name, …, text.
    rows : ndarray of int, or None
        The vertices of all primitives, one after another; None for all vertices in order.
    offsets : tuple of int
        The number of vertices before each primitive, and at last the number of all vertices.
    indices : tuple of list of bytes
        For each primitive, the bytes of its triangles and their padding.
    length : int
        Number of bytes of the buffer.
    index_bytes : int
        The memory of `indices` in addition to that of the faces of the mesh, in bytes.
    """

    text: tuple[bytes, ...]
    rows: Ints | None
    offsets: tuple[int, ...]
    indices: tuple[list[bytes | memoryview], ...]
    length: int
    index_bytes: int

    @property
    def nbytes(self) -> int:
        """The memory of the template, in bytes."""
        row_bytes = 0 if self.rows is None else self.rows.nbytes
        return sum(map(len, self.text)) + self.index_bytes + row_bytes

    def fill(self, mesh: Mesh, columns: Columns) -> Content:
        """Insert the values of a mesh with these vertex attributes; returns the file."""
        values = {b"report": json_text(report_object(mesh.report, mesh.parts))}
        values[b"origin"] = json_text(mesh.origin.tolist())
        arrays = [column.values for column in columns.values()]
        if self.rows is not None:
            arrays = [array.take(self.rows, axis=0) for array in arrays]
        for number, bounds in enumerate(self._bounds(mesh, arrays[0])):
            values[b"low%d" % number], values[b"high%d" % number] = map(json_text, bounds)
        chunks: list[memoryview | bytes] = []
        for begin, end, indices in zip(self.offsets, self.offsets[1:], self.indices, strict=False):
            # float32 needs no padding.
            chunks += [array[begin:end].data.cast("B") for array in arrays]
            chunks += indices
        text = list(self.text)
        # Every second part is the name of a value.
        text[1::2] = map(values.__getitem__, text[1::2])
        return _assemble(b"".join(text), chunks, self.length)

    def _bounds(self, mesh: Mesh, positions: AnyArray) -> Iterator[tuple[Any, Any]]:
        """Least and greatest coordinates of the vertices of each primitive."""
        # One primitive with all vertices, in model coordinates: its bounds are in the report.
        if len(self.indices) == 1 and self.rows is None and not is_moved(mesh.origin):
            return iter([(mesh.report.bounds_min, mesh.report.bounds_max)])
        coordinates = positions.T.copy()
        lows, highs = (
            np.array(least_or_greatest.reduceat(coordinates, self.offsets[:-1], axis=1)).T.tolist()
            for least_or_greatest in (np.minimum, np.maximum)
        )
        return zip(lows, highs, strict=True)


def _encode_by_template(mesh: Mesh, options: EncodeOptions) -> Content | None:
    """The mesh as a binary file, made from a cached template.

    None if the faces of the mesh are not those of a cached plan, or if a template cannot be used.
    """
    is_plain = options.compression == "none" and not mesh.step and not find_nonempty(mesh.overlays)
    # Faces of a cached plan are read-only.
    if mesh.triangles.flags.writeable or not is_plain or len(mesh.quads):
        return None
    columns = build_plain_columns(mesh)
    key = (
        "glTF template",
        mesh.name,
        len(mesh.positions),
        mesh.up,
        mesh.report.metres_per_unit,
        is_moved(mesh.origin),
        mesh.colors is not None and is_translucent(mesh.colors),
        tuple((part.name, part.triangles, part.color) for part in mesh.parts),
        tuple((name, column.values.shape[1]) for name, column in columns.items()),
    )
    template = derive_once(
        (mesh.triangles,), key, lambda: _build_template(mesh, options, len(columns))
    )
    return template.fill(mesh, columns) if template.indices else None


def _build_template(mesh: Mesh, options: EncodeOptions, column_count: int) -> Template:
    """The template of a mesh's file; empty if a name of the mesh looks like a placeholder."""
    document, buffer = build_document(mesh, options)
    document["asset"]["extras"]["report"] = PLACEHOLDER.format("report")
    for node in document.get("nodes", ()):
        if "translation" in node:
            node["translation"] = PLACEHOLDER.format("origin")
    bounded_accessors = [
        accessor for accessor in document.get("accessors", ()) if "min" in accessor
    ]
    for number, accessor in enumerate(bounded_accessors):
        accessor["min"], accessor["max"] = (
            PLACEHOLDER.format(f"{end}{number}") for end in ("low", "high")
        )
    if buffer.length:
        document["buffers"] = [{"byteLength": buffer.length}]
    text = _PLACEHOLDER.split(json_text(document))
    primitives = [rows for _, rows, _ in split_parts(mesh)]
    # In the buffer, a primitive has `column_count` attributes and then its indices; each of these
    # arrays is two chunks, its content and its padding.
    stride = 2 * (column_count + 1)
    index_ends = range(stride, len(primitives) * stride + 1, stride)
    indices = [buffer.chunks[end - 2 : end] for end in index_ends]
    # The report; for each primitive its two bounds; and for each its origin, if it is not 0.
    placeholder_count = 1 + 2 * len(primitives) + (len(primitives) if is_moved(mesh.origin) else 0)
    if len(text) != 2 * placeholder_count + 1:
        return Template((), None, (), (), 0, 0)
    vertices = range(len(mesh.positions))
    rows = [vertices[each] if isinstance(each, slice) else each for each in primitives]
    # Indices of 32 bits are the faces of the mesh themselves.
    index_bytes = sum(
        len(chunk)
        for chunks in indices
        for chunk in chunks
        if not np.may_share_memory(np.frombuffer(chunk, np.uint8), mesh.triangles)
    )
    return Template(
        tuple(text),
        _join_rows(rows, len(vertices)),
        tuple(accumulate(map(len, rows), initial=0)),
        tuple(indices),
        buffer.length,
        index_bytes,
    )


def _join_rows(rows: Sequence[range | Ints], vertices: int) -> Ints | None:
    """The vertices of all primitives, one after another; None if they are all, in order."""
    if len(rows) == 1 and isinstance(rows[0], range) and len(rows[0]) == vertices:
        return None
    joined = np.concatenate([np.empty(0, np.intp), *map(np.asarray, rows)])
    return None if np.array_equal(joined, np.arange(vertices)) else joined
