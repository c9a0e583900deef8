"""glTF 2.0 as one JSON document or one binary file, written by us.

One root node carries the name of the mesh and what turns z-up models upright; below it every part
and every overlay is a named node with a mesh of its own, moved by the local origin. All buffer
views are planar, tightly packed and aligned to four bytes.

Colours are linear, on white. The attribute `flow` of up to four numbers is `_FLOW`; one of more is
cut into `_FLOW_0`, `_FLOW_1` and so on, four numbers each and the rest in the last.

References
----------
Khronos, glTF 2.0 Specification: 3.6.2 accessors, 3.7.2 meshes, 3.9 materials, 4.4 GLB layout.
KHR_materials_unlit.
"""

import base64
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, IndexArray
from service.encoders.colors import translucent
from service.encoders.content import REPORT_PART, drawn, refuse_quads, report_object
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.gltf_buffer import BufferBuilder, JsonObject
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE, json_text
from service.engine.light import linear
from service.engine.mesh import Mesh, MeshPart, Overlay
from service.surface.lowered import Color

GENERATOR = "Surface Service"
"""Without a version: a release changes no bytes that the version of the numbers does not change."""

LINES, TRIANGLES = 1, 4
"""Primitive modes (3.7.2.1)."""

Z_UP_TO_Y_UP = (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)
"""Unit quaternion (x, y, z, w): a quarter turn about x that takes z to y, the axis that is up."""

SURFACE_MATERIAL: JsonObject = {
    "name": "surface",
    "doubleSided": True,
    "pbrMetallicRoughness": {
        "baseColorFactor": [0.6, 0.62, 0.66, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.5,
    },
}
COLORED_MATERIAL: JsonObject = {
    "name": "surface",
    "doubleSided": True,
    "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5},
}
"""White (the default base colour), so that the colours of the vertices are what is seen."""
LINE_MATERIAL: JsonObject = {
    "name": "lines",
    "extensions": {"KHR_materials_unlit": {}},
    "pbrMetallicRoughness": {
        "baseColorFactor": [0.85, 0.25, 0.05, 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.9,
    },
}

GLB_MAGIC, GLB_VERSION, CHUNK_JSON, CHUNK_BIN = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
"""Header and chunk types of a GLB (4.4.2, 4.4.3): "glTF", 2, "JSON", "BIN" and a zero byte."""

DATA_URI = "data:application/gltf-buffer;base64,"
"""A buffer inside the document (3.6.1.1)."""


def encode_glb(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The binary form.

    Raises
    ------
    UnsupportedByFormat
        If the mesh holds quads.
    """
    buffer = BufferBuilder()
    return binary(_document(mesh, buffer), buffer)


def binary(document: JsonObject, buffer: BufferBuilder) -> bytes:
    """The file of a document and its buffer, as header and chunks."""
    if buffer.length:
        document["buffers"] = [{"byteLength": buffer.length}]
    text = json_text(document)
    text += b" " * (-len(text) % 4)
    binary_head = struct.pack("<II", buffer.length, CHUNK_BIN) if buffer.length else b""
    length = 12 + 8 + len(text) + len(binary_head) + buffer.length
    head = struct.pack("<5I", GLB_MAGIC, GLB_VERSION, length, len(text), CHUNK_JSON)
    return b"".join((head, text, binary_head, *buffer.chunks))


def encode_gltf(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The JSON form, its buffer inside it as base64.

    Raises
    ------
    UnsupportedByFormat
        If the mesh holds quads.
    """
    buffer = BufferBuilder()
    return textual(_document(mesh, buffer), buffer)


def textual(document: JsonObject, buffer: BufferBuilder) -> bytes:
    """The file of a document with its buffer inside it."""
    if buffer.length:
        uri = DATA_URI + base64.b64encode(b"".join(buffer.chunks)).decode("ascii")
        document["buffers"] = [{"byteLength": buffer.length, "uri": uri}]
    return json_text(document)


def glb_byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """Bytes at most of the binary form: its header, those of its two chunks, and padding."""
    return 12 + 2 * 8 + 3 + _json_bound(size) + _buffer_bound(size)


def gltf_byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """Bytes at most of the JSON form: base64 writes 3 bytes as 4."""
    return _json_bound(size) + len(DATA_URI) + -(-_buffer_bound(size) // 3) * 4


def _document(mesh: Mesh, buffer: BufferBuilder) -> JsonObject:
    """Everything but the buffer itself, whose chunks are left in `buffer`."""
    found = [(piece, piece.material()) for piece in pieces(mesh, buffer)]
    materials: list[JsonObject] = []
    for _, material in found:
        if material not in materials:
            materials.append(material)
    meshes: list[JsonObject] = [
        {
            "name": piece.name,
            "primitives": [piece.primitive | {"material": materials.index(material)}],
        }
        for piece, material in found
    ]
    place: JsonObject = {"translation": mesh.origin.tolist()} if mesh.origin.any() else {}
    nodes = [{"name": m["name"], "mesh": k, **place} for k, m in enumerate(meshes)]

    root: JsonObject = {"name": mesh.name, "children": list(range(1, len(nodes) + 1))}
    if mesh.up == "z":
        root["rotation"] = Z_UP_TO_Y_UP
    arrays: JsonObject = {
        "nodes": [root, *nodes] if nodes else [],
        "meshes": meshes,
        "materials": materials,
    }
    return whole(mesh.name, report_object(mesh.report, mesh.parts), arrays, buffer)


def whole(
    name: str, report: Mapping[str, object], arrays: JsonObject, buffer: BufferBuilder
) -> JsonObject:
    """The document of these nodes, meshes and materials; the first node is the root."""
    document: JsonObject = {
        "asset": {
            "version": "2.0",
            "generator": GENERATOR,
            "extras": {"report": report},
        },
        "extensionsUsed": ["KHR_materials_unlit"] if LINE_MATERIAL in arrays["materials"] else [],
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]} if arrays["nodes"] else {"name": name}],
        **arrays,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
    }
    # An array that is present must not be empty (JSON schema of the specification, minItems 1).
    return {key: value for key, value in document.items() if value != []}


@dataclass(frozen=True, slots=True)
class Piece:
    """What becomes a glTF mesh: a part, or an overlay, in which case `mesh` is None.

    `color` is the base colour of a part.
    """

    name: str
    primitive: JsonObject
    mesh: Mesh | None = None
    color: Color | None = None

    def material(self, color: Color | None = None) -> JsonObject:
        """Its material; `color` is its base colour where it has none of its own."""
        if self.mesh is None:
            return LINE_MATERIAL
        colors = self.mesh.colors
        blended = colors is not None and translucent(colors)
        color = self.color or color
        return surface_material(color, colored=colors is not None, blended=blended)


def pieces(mesh: Mesh, buffer: BufferBuilder) -> Iterator[Piece]:
    """Every part that has faces and every overlay that has lines."""
    refuse_quads(mesh, "glTF")
    for part, primitive in _part_primitives(mesh, buffer):
        yield Piece(part.name, primitive, mesh, part.color)
    for overlay in drawn(mesh.overlays):
        yield Piece(overlay.name, _line_primitive(overlay, buffer))


def surface_material(color: Color | None, *, colored: bool, blended: bool = False) -> JsonObject:
    """The material of faces: glaze, or white where vertices are coloured, or the base colour.

    A base colour multiplies the colours of the vertices; the material is named after it.
    """
    material = COLORED_MATERIAL if colored else SURFACE_MATERIAL
    if color is not None:
        code = "".join(f"{round(255 * value):02x}" for value in color[: 4 if color[3] < 1 else 3])
        (factor,) = linear(np.array([color])).tolist()
        shade = material["pbrMetallicRoughness"] | {"baseColorFactor": factor}
        name = f"{material['name']} #{code}"
        material = material | {"name": name, "pbrMetallicRoughness": shade}
        blended = blended or color[3] < 1
    return material | ({"alphaMode": "BLEND"} if blended else {})


def _part_primitives(mesh: Mesh, buffer: BufferBuilder) -> Iterator[tuple[MeshPart, JsonObject]]:
    """Primitive of every part that has faces, with no vertices but its own."""
    alone = len(mesh.parts) == 1
    used = np.zeros(0 if alone else len(mesh.positions), dtype=np.bool_)
    lookup = np.empty(len(used), dtype=np.uint32)
    for part in mesh.parts:
        triangles = mesh.triangles[slice(*part.triangles)]
        if not len(triangles):
            continue
        own: IndexArray | slice = slice(None)
        if not alone:
            own, triangles = _own_vertices(triangles, used, lookup)
        attributes = {"POSITION": buffer.add_positions(mesh.positions[own])}
        if mesh.normals is not None:
            attributes["NORMAL"] = buffer.add_attribute(mesh.normals[own])
        if mesh.uvs is not None:
            attributes["TEXCOORD_0"] = buffer.add_attribute(mesh.uvs[own])
        if mesh.colors is not None:
            attributes["COLOR_0"] = buffer.add_attribute(linear(mesh.colors[own]))
        for name, values in mesh.attributes:
            for key, columns in attribute_columns(name, values.shape[1]):
                attributes[key] = buffer.add_attribute(values[own, columns])
        vertices = len(mesh.positions[own])
        yield (
            part,
            {
                "attributes": attributes,
                "indices": buffer.add_indices(triangles, vertices),
                "mode": TRIANGLES,
            },
        )


def attribute_columns(name: str, dimension: int) -> Iterator[tuple[str, slice]]:
    """Names under which an attribute is stored, and the columns of each: four at most."""
    if dimension <= 4:
        yield f"_{name.upper()}", slice(0, dimension)
        return
    for piece, first in enumerate(range(0, dimension, 4)):
        yield f"_{name.upper()}_{piece}", slice(first, first + 4)


def _line_primitive(overlay: Overlay, buffer: BufferBuilder) -> JsonObject:
    """The segments of an overlay as LINES."""
    return {
        "attributes": {"POSITION": buffer.add_positions(overlay.positions)},
        "indices": buffer.add_indices(overlay.segments, len(overlay.positions)),
        "mode": LINES,
    }


def _own_vertices(
    triangles: IndexArray, used: Bools, lookup: IndexArray
) -> tuple[IndexArray | slice, IndexArray]:
    """The vertices that these triangles use, and the triangles counted among those.

    `used`, all False, and `lookup`, both of shape (V,), are room to work in. Only the range of
    the indices is visited, so that many small parts cost no more than one large one.
    """
    low, high = int(triangles.min()), int(triangles.max()) + 1
    used[triangles] = True
    own = np.flatnonzero(used[low:high]).astype(np.uint32) + np.uint32(low)
    used[low:high] = False
    if len(own) == high - low:
        return slice(low, high), triangles - np.uint32(low)
    lookup[own] = np.arange(len(own), dtype=np.uint32)
    return own, lookup[triangles]


def _json_bound(size: MeshSize) -> int:
    """Bytes at most of the JSON without the buffer.

    A node with its mesh, accessors and buffer views is below 1200 characters of keys and small
    numbers, nine float64 (translation, minimum, maximum) and its name twice; the name of the
    whole is written twice, too, and the report names every part. Another vertex attribute adds its
    name, an accessor and a view. The constant part holds the asset with the report, two materials,
    the root and the scene.
    """
    keys = [key for name, d in size.attributes for key, _ in attribute_columns(name, d)]
    more = ["COLOR_0", *keys] if size.colors else keys
    node = 1200 + 9 * (FLOAT64_CHARS + 1) + sum(300 + len(key) for key in more) + REPORT_PART
    names = 3 * LONGEST_ESCAPE * size.name_bytes
    return 2112 + 13 * FLOAT64_CHARS + size.named * node + names


def _buffer_bound(size: MeshSize) -> int:
    """Bytes at most of the buffer: normals and parameters counted, padding included."""
    vertex = 12 + 12 + 8 + 4 * (size.colors + sum(d for _, d in size.attributes))
    index = 2 if max(size.vertices, size.overlay_points) <= 65535 else 4
    corners = 3 * (size.triangles + 2 * size.quads) + 2 * size.overlay_segments
    return size.vertices * vertex + size.overlay_points * 12 + corners * index + 3 * size.named
