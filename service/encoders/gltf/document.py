"""The glTF document around nodes, meshes and arrays, and its form as one JSON text.

References
----------
Khronos, glTF 2.0 Specification: 3.2 asset, 3.5.3 transformations, 3.6.1 buffers, 3.12 extensions.
"""

import base64
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from service.bases.arrays import FloatArray
from service.bases.row_batches import row_runs
from service.encoders.format import EncodeOptions
from service.encoders.gltf import meshopt, quantized
from service.encoders.gltf.buffer import BufferBuilder, JsonObject, Packed
from service.encoders.gltf.materials import LINE_MATERIAL, UNLIT
from service.encoders.text import json_text

GENERATOR = "Surface Service"
"""It has no version: a release changes bytes only if the version of the numbers changes."""

Z_UP_TO_Y_UP = (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)
"""Unit quaternion (x, y, z, w): a quarter turn about x, from z up to y up."""

LINE_STRIP = 3
"""Mode of a primitive (3.7.2.1)."""

DATA_URI = "data:application/gltf-buffer;base64,"
"""A buffer inside the document (3.6.1.1)."""

_QUOTED = b'"uri":"' + DATA_URI.encode() + b'"'
"""Place of the buffer in the text: no name contains it, as JSON escapes quotation marks."""

PIECE = 3 << 16
"""Bytes of a piece that becomes base64."""

REQUIRED = frozenset({quantized.EXTENSION, meshopt.EXTENSION})
"""Extensions without which a file cannot be read."""


File: TypeAlias = tuple[JsonObject, Packed]
"""A document and its buffer."""


def build_whole_document(
    name: str,
    report: Mapping[str, object],
    arrays: JsonObject,
    buffer: BufferBuilder,
    options: EncodeOptions,
) -> File:
    """The document of these nodes, meshes and materials; the first node is the root."""
    packed = meshopt.compress_buffer(buffer) if options.compression == "meshopt" else buffer.pack()
    extensions = [UNLIT] if LINE_MATERIAL in arrays["materials"] else []
    extensions += [quantized.EXTENSION] if buffer.quantized else []
    extensions += packed.extensions
    document: JsonObject = {
        "asset": {
            "version": "2.0",
            "generator": GENERATOR,
            "extras": {"report": report},
        },
        "extensionsUsed": extensions,
        "extensionsRequired": [name for name in extensions if name in REQUIRED],
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]} if arrays["nodes"] else {"name": name}],
        **arrays,
        "accessors": buffer.accessors,
        "bufferViews": packed.views,
    }
    # An array that is present must not be empty (JSON schema of the specification, minItems 1).
    return {key: value for key, value in document.items() if value != []}, packed


def root_placement(origin: FloatArray, up: str) -> JsonObject:
    """Fields of the root node: its translation by the local `origin` (3,), its rotation to y up.

    A reader rotates before it translates (3.5.3), so the translation is the rotated origin.
    """
    x, y, z = origin.tolist()
    placement: JsonObject = {"rotation": Z_UP_TO_Y_UP} if up == "z" else {}
    if origin.any():
        placement["translation"] = [x, z, 0.0 - y] if up == "z" else [x, y, z]
    return placement


def textual(document: JsonObject, buffer: Packed) -> bytes:
    """The file of a document with its buffer inside it."""
    if not buffer.chunks:
        return json_text(document)
    document["buffers"] = [{"byteLength": buffer.length, "uri": DATA_URI}, *buffer.others]
    # A JSON writer would copy the buffer, and reserve 8 times its length.
    before, quoted, after = json_text(document).partition(_QUOTED)
    return b"".join((before, quoted[:-1], *_base64(buffer.chunks), b'"', after))


def _base64(chunks: Iterable[memoryview | bytes]) -> Iterator[bytes]:
    """The base64 of the concatenated chunks."""
    left = b""
    for chunk in chunks:
        for first, last in row_runs(len(chunk), PIECE):
            piece = left + chunk[first:last]
            # 3 bytes are 4 letters; the remaining 1 or 2 bytes go to the next chunk.
            length = len(piece) - len(piece) % 3
            left = piece[length:]
            yield base64.b64encode(piece[:length])
    yield base64.b64encode(left)
