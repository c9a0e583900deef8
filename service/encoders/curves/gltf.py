"""A curve as glTF 2.0: one node, one LINE_STRIP, an unlit material.

It stores POSITION, `_TANGENT` (VEC3; glTF's own TANGENT belongs to normals and textures),
`_PARAMETER` and `_ARC_LENGTH`. A closed curve repeats its first point at the end, with another
parameter and length: so it is a strip, not a loop.

References
----------
Khronos, glTF 2.0 Specification: 3.7.2.1 mesh primitives. KHR_materials_unlit.
"""

from service.encoders.curves.format import CurveSize, in_space, report_object
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.columns import Column, single
from service.encoders.gltf.document import GENERATOR, Z_UP_TO_Y_UP, File, textual
from service.encoders.gltf.glb import binary
from service.encoders.gltf.materials import LINE_MATERIAL, UNLIT
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE
from service.engine.curves.polyline import Polyline

LINE_STRIP = 3
"""Primitive mode (3.7.2.1)."""

POINT_BYTES = 12 + 12 + 4 + 4


def encode_glb(line: Polyline) -> bytes:
    """The binary form."""
    return bytes(binary(*_document(line)))


def encode_gltf(line: Polyline) -> bytes:
    """The JSON form, its buffer inside it as base64."""
    return textual(*_document(line))


def glb_byte_bound(size: CurveSize) -> int:
    """Most bytes of the binary form."""
    return _json_bound(size) + size.points * POINT_BYTES


def gltf_byte_bound(size: CurveSize) -> int:
    """Most bytes of the JSON form: base64 writes 3 bytes as 4."""
    return _json_bound(size) + 4 + size.points * POINT_BYTES // 3 * 4


def _document(line: Polyline) -> File:
    """The document and its buffer."""
    columns = {"POSITION": in_space(line.points)}
    if line.tangents is not None:
        columns["_TANGENT"] = in_space(line.tangents)
    columns["_PARAMETER"] = line.parameters[:, None]
    if line.arc_lengths is not None:
        columns["_ARC_LENGTH"] = line.arc_lengths[:, None]
    buffer = BufferBuilder()
    attributes = {
        name: (buffer.add_positions if name == "POSITION" else buffer.add)(Column(single(values)))
        for name, values in columns.items()
    }
    packed = buffer.packed()
    document: JsonObject = {
        "asset": {
            "version": "2.0",
            "generator": GENERATOR,
            "extras": {"report": report_object(line.report)},
        },
        "extensionsUsed": [UNLIT],
        "scene": 0,
        "scenes": [{"name": line.name, "nodes": [0]}],
        "nodes": [{"name": line.name, "mesh": 0, **_place(line)}],
        "meshes": [
            {
                "name": line.name,
                "primitives": [{"attributes": attributes, "mode": LINE_STRIP, "material": 0}],
            }
        ],
        "materials": [LINE_MATERIAL],
        "accessors": buffer.accessors,
        "bufferViews": packed.views,
    }
    return document, packed


def _place(line: Polyline) -> JsonObject:
    """The transformation of the node: from the local origin, and to y up."""
    x, y, z = in_space(line.origin[None])[0].tolist()
    place: JsonObject = {}
    if line.up == "z":
        place["rotation"] = Z_UP_TO_Y_UP
    if line.origin.any():
        # glTF rotates first, so the origin is rotated here.
        place["translation"] = [x, z, 0.0 - y] if line.up == "z" else [x, y, z]
    return place


def _json_bound(size: CurveSize) -> int:
    """Most bytes without the buffer, with headers and padding."""
    return 4096 + 17 * FLOAT64_CHARS + 3 * LONGEST_ESCAPE * size.name_bytes
