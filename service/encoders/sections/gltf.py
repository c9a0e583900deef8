"""Sections as glTF 2.0: a node and a mesh for each plane, with an unlit material.

A mesh has a primitive of mode LINE_STRIP for each polyline; a closed polyline repeats its first
point at the end. If a plane does not meet the surface, its node has no mesh. The report is in
`extras` of the asset, and each plane is in `extras` of its node.

References
----------
Khronos, glTF 2.0 Specification: 3.7.2.1 mesh primitives. KHR_materials_unlit.
"""

from service.bases.arrays import FloatArray
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
from service.encoders.sections.format import SectionSize, find_stored_origin, report_object
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE
from service.engine.sections.values import Sections

POINT_BYTES = 12
"""Bytes of a point in float32."""

POLYLINE_CHARS = 500 + 6 * FLOAT64_CHARS
"""The most characters of a primitive, its accessor and its buffer view."""


def encode_glb(sections: Sections) -> bytes:
    """The sections as a binary glTF file."""
    return bytes(write_glb(*_document(sections)))


def encode_gltf(sections: Sections) -> bytes:
    """The sections as one glTF JSON document, which contains the buffer as base64."""
    return write_gltf(*_document(sections))


def glb_bound(size: SectionSize) -> int:
    """The most bytes of a binary glTF file."""
    plane = 300 + 4 * FLOAT64_CHARS
    text = 4096 + 2 * LONGEST_ESCAPE * size.name_bytes + plane * size.planes
    return text + POLYLINE_CHARS * size.polylines + size.points * POINT_BYTES


def gltf_bound(size: SectionSize) -> int:
    """The most bytes of a glTF JSON document; base64 writes 3 bytes as 4 characters."""
    return glb_bound(size) + 4 + size.points * POINT_BYTES // 3


def _document(sections: Sections) -> File:
    """The glTF document of some sections, and its buffer."""
    origin, rounding = find_stored_origin(sections)
    buffer = BufferBuilder()
    children = list(range(1, len(sections.sections) + 1))
    root = {"name": sections.name, **root_placement(origin, sections.up), "children": children}
    nodes: list[JsonObject] = [root]
    meshes: list[JsonObject] = []
    for k, section in enumerate(sections.sections):
        normal, offset = sections.planes.normals[k].tolist(), float(sections.planes.offsets[k])
        node: JsonObject = {"name": f"section {k}", "extras": {"normal": normal, "offset": offset}}
        if section.polylines:
            node["mesh"] = len(meshes)
            strips = [_build_strip(line.points - origin, buffer) for line in section.polylines]
            meshes.append({"name": f"section {k}", "primitives": strips})
        nodes.append(node)
    arrays = {"nodes": nodes, "meshes": meshes, "materials": [LINE_MATERIAL] if meshes else []}
    return build_whole_document(
        sections.name, report_object(sections, rounding), arrays, buffer, EncodeOptions()
    )


def _build_strip(points: FloatArray, buffer: BufferBuilder) -> JsonObject:
    """The primitive of one polyline; its points are added to the buffer."""
    attributes = {"POSITION": buffer.add_positions(Column(to_single(points)))}
    return {"attributes": attributes, "mode": LINE_STRIP, "material": 0}
