"""Sections as glTF 2.0: a node and a mesh for each plane, an unlit material.

A mesh has a primitive of mode LINE_STRIP for each polyline; a closed one repeats its first point at
the end. A plane that cuts nothing has a node without a mesh. The report is in the asset's extras,
the plane in those of its node.

References
----------
Khronos, glTF 2.0 Specification: 3.7.2.1 mesh primitives. KHR_materials_unlit.
"""

from service.bases.arrays import FloatArray
from service.encoders.gltf.buffer import BufferBuilder, JsonObject
from service.encoders.gltf.columns import Column, single
from service.encoders.gltf.document import GENERATOR, Z_UP_TO_Y_UP, File, textual
from service.encoders.gltf.glb import binary
from service.encoders.gltf.materials import LINE_MATERIAL, UNLIT
from service.encoders.sections.format import SectionSize, report_object, stored
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE
from service.engine.sections.section import Sections

LINE_STRIP = 3
"""Primitive mode (3.7.2.1)."""

POINT_BYTES = 12

POLYLINE = 500 + 6 * FLOAT64_CHARS
"""Characters of a primitive, its accessor and its view."""


def encode_glb(sections: Sections) -> bytes:
    """The binary form."""
    return bytes(binary(*_document(sections)))


def encode_gltf(sections: Sections) -> bytes:
    """The JSON form, its buffer inside it as base64."""
    return textual(*_document(sections))


def glb_bound(size: SectionSize) -> int:
    """Most bytes of the binary form."""
    plane = 300 + 4 * FLOAT64_CHARS
    text = 4096 + 2 * LONGEST_ESCAPE * size.name_bytes + plane * size.planes
    return text + POLYLINE * size.polylines + size.points * POINT_BYTES


def gltf_bound(size: SectionSize) -> int:
    """Most bytes of the JSON form: base64 writes 3 bytes as 4."""
    return glb_bound(size) + 4 + size.points * POINT_BYTES // 3


def _document(sections: Sections) -> File:
    origin, moved = stored(sections)
    buffer = BufferBuilder()
    nodes: list[JsonObject] = [{"name": sections.name}]
    meshes: list[JsonObject] = []
    x, y, z = origin.tolist()
    if sections.up == "z":
        nodes[0]["rotation"] = Z_UP_TO_Y_UP
    if origin.any():
        # glTF rotates first, so the origin is rotated here.
        nodes[0]["translation"] = [x, z, 0.0 - y] if sections.up == "z" else [x, y, z]
    nodes[0]["children"] = list(range(1, len(sections.sections) + 1))
    for k, section in enumerate(sections.sections):
        normal, offset = sections.planes.normals[k].tolist(), float(sections.planes.offsets[k])
        node: JsonObject = {"name": f"section {k}", "extras": {"normal": normal, "offset": offset}}
        if section.polylines:
            node["mesh"] = len(meshes)
            strips = [_strip(line.points - origin, buffer) for line in section.polylines]
            meshes.append({"name": f"section {k}", "primitives": strips})
        nodes.append(node)
    packed = buffer.packed()
    document: JsonObject = {
        "asset": {
            "version": "2.0",
            "generator": GENERATOR,
            "extras": {"report": report_object(sections, moved)},
        },
        "scene": 0,
        "scenes": [{"name": sections.name, "nodes": [0]}],
        "nodes": nodes,
    }
    if meshes:
        document |= {
            "extensionsUsed": [UNLIT],
            "meshes": meshes,
            "materials": [LINE_MATERIAL],
            "accessors": buffer.accessors,
            "bufferViews": packed.views,
        }
    return document, packed


def _strip(points: FloatArray, buffer: BufferBuilder) -> JsonObject:
    """The primitive of one polyline."""
    attributes = {"POSITION": buffer.add_positions(Column(single(points)))}
    return {"attributes": attributes, "mode": LINE_STRIP, "material": 0}
