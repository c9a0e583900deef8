"""A curve as glTF 2.0: one node, one LINE_STRIP, an unlit material.

The attributes are POSITION, `_TANGENT`, `_PARAMETER` and `_ARC_LENGTH`. `_TANGENT` is a VEC3; the
attribute TANGENT of glTF is for textures. A closed curve repeats its first point at the end with
another parameter and arc length; so its mode is LINE_STRIP, not LINE_LOOP.

References
----------
Khronos, glTF 2.0 Specification: 3.7.2.1 mesh primitives. KHR_materials_unlit.
"""

from service.encoders.curves.format import CurveSize, in_space, report_object
from service.encoders.format import EncodeOptions
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.columns import Column, to_single
from service.encoders.gltf.document import (
    LINE_STRIP,
    File,
    build_whole_document,
    root_placement,
    write_gltf,
)
from service.encoders.gltf.glb import write_glb
from service.encoders.gltf.primitives import LINE_MATERIAL
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE
from service.engine.curves.polyline import Polyline

POINT_BYTES = 12 + 12 + 4 + 4
"""Bytes of a point: position, tangent, parameter and arc length in float32."""


def encode_glb(line: Polyline) -> bytes:
    """The curve as a binary glTF file."""
    return bytes(write_glb(*_document(line)))


def encode_gltf(line: Polyline) -> bytes:
    """The curve as one glTF JSON document, which contains the buffer as base64."""
    return write_gltf(*_document(line))


def glb_byte_bound(size: CurveSize) -> int:
    """The most bytes of a binary glTF file."""
    return _json_bound(size) + size.points * POINT_BYTES


def gltf_byte_bound(size: CurveSize) -> int:
    """The most bytes of a glTF JSON document; base64 writes 3 bytes as 4 characters."""
    return _json_bound(size) + 4 + size.points * POINT_BYTES // 3 * 4


def _document(line: Polyline) -> File:
    """The glTF document of a curve, and its buffer."""
    columns = {"POSITION": in_space(line.points)}
    if line.tangents is not None:
        columns["_TANGENT"] = in_space(line.tangents)
    columns["_PARAMETER"] = line.parameters[:, None]
    if line.arc_lengths is not None:
        columns["_ARC_LENGTH"] = line.arc_lengths[:, None]
    buffer = BufferBuilder()
    attributes = {
        name: (buffer.add_positions if name == "POSITION" else buffer.add)(
            Column(to_single(values))
        )
        for name, values in columns.items()
    }
    primitive = {"attributes": attributes, "mode": LINE_STRIP, "material": 0}
    placement = root_placement(in_space(line.origin[None])[0], line.up)
    arrays: JsonObject = {
        "nodes": [{"name": line.name, "mesh": 0, **placement}],
        "meshes": [{"name": line.name, "primitives": [primitive]}],
        "materials": [LINE_MATERIAL],
    }
    return build_whole_document(
        line.name, report_object(line.report), arrays, buffer, EncodeOptions()
    )


def _json_bound(size: CurveSize) -> int:
    """The most bytes of headers, JSON and padding, without the buffer."""
    # float64: 8 in the report, 6 in the bounds of POSITION, 3 in the translation.
    # The name of the curve occurs 3 times: in the scene, the node and the mesh.
    return 4096 + 17 * FLOAT64_CHARS + 3 * LONGEST_ESCAPE * size.name_bytes
