"""Builds the glTF document of a mesh, and writes a document as one JSON text.

The root node has the name of the mesh and, if z is up, the rotation from z up to y up. Below the
root, every part with faces and every overlay is a named node with one mesh and with the local
origin as its translation; all faces of a brep are one such node. Every attribute has a buffer view
of its own, aligned to 4 bytes.

References
----------
Khronos, glTF 2.0 Specification: 3.2 asset, 3.5 nodes and transformations, 3.6.1 buffers, 3.12
extensions.
"""

import base64
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from service.bases.arrays import FloatArray
from service.bases.row_batches import row_runs
from service.encoders.content import (
    REPORT_PART_CHARS,
    bound_brep_chars,
    bound_orientation_chars,
    report_object,
)
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.gltf import meshopt
from service.encoders.gltf.buffer import (
    LARGEST_SHORT_COUNT,
    BufferBuilder,
    JsonObject,
    PackedBuffer,
)
from service.encoders.gltf.columns import QUANTIZATION, attribute_columns, node_transform
from service.encoders.gltf.primitives import LINE_MATERIAL, UNLIT, build_drawables
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE, json_text
from service.engine.mesh.mesh import Mesh

GENERATOR = "Surface Service"
"""The name of this program in a file. It has no version, because the bytes of a file may change
only if the version of its numbers (`ENGINE`, in the report) changes, not with each release."""

Z_UP_TO_Y_UP = (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)
"""Unit quaternion (x, y, z, w): a quarter turn about x, from z up to y up."""

LINE_STRIP = 3
"""The mode of a primitive of connected lines (3.7.2.1)."""

DATA_URI = "data:application/gltf-buffer;base64,"
"""The beginning of the URI of a buffer that is inside the document (3.6.1.1)."""

_URI_FIELD = b'"uri":"' + DATA_URI.encode() + b'"'
"""The field of the buffer before its base64 is inserted. It occurs once in a document: names cannot
contain it, because JSON escapes quotation marks."""

BASE64_STEP = 3 << 16
"""The number of bytes that are converted to base64 at once; a multiple of 3."""

REQUIRED = frozenset({QUANTIZATION, meshopt.EXTENSION})
"""The extensions without which a reader cannot read the file."""


File: TypeAlias = tuple[JsonObject, PackedBuffer]
"""A glTF document and its buffer."""


def build_whole_document(
    name: str,
    report: Mapping[str, object],
    arrays: JsonObject,
    buffer: BufferBuilder,
    options: EncodeOptions,
) -> File:
    """Build the document around `arrays`: the nodes, meshes and materials; node 0 is the root."""
    packed_buffer = (
        meshopt.compress_buffer(buffer) if options.compression == "meshopt" else buffer.pack()
    )
    extensions = [UNLIT] if LINE_MATERIAL in arrays["materials"] else []
    extensions += [QUANTIZATION] if buffer.is_quantized else []
    extensions += packed_buffer.extensions
    document: JsonObject = {
        "asset": {
            "version": "2.0",
            "generator": GENERATOR,
            "extras": {"report": report},
        },
        "extensionsUsed": extensions,
        "extensionsRequired": [each for each in extensions if each in REQUIRED],
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]} if arrays["nodes"] else {"name": name}],
        **arrays,
        "accessors": buffer.accessors,
        "bufferViews": packed_buffer.views,
    }
    # Omit empty arrays: the JSON schema of the specification requires at least one item.
    return {key: value for key, value in document.items() if value != []}, packed_buffer


def turn_and_scale(up: str, metres_per_unit: float | None) -> JsonObject:
    """The fields of the root node that turn a mesh or scene to y up, and scale it to metres.

    Both are the axes and the unit of glTF (3.4).
    """
    transform: JsonObject = {"rotation": Z_UP_TO_Y_UP} if up == "z" else {}
    if metres_per_unit not in (None, 1):
        transform["scale"] = [metres_per_unit] * 3
    return transform


def root_placement(origin: FloatArray, up: str, metres_per_unit: float | None = None) -> JsonObject:
    """The fields `rotation`, `scale` and `translation` of the root node.

    The rotation turns z up to y up, and the scale is that to metres, which glTF requires. The
    translation is the local `origin` (3,). A reader rotates and scales before it translates
    (3.5.3), so the origin is rotated and scaled, too.
    """
    x, y, z = (origin * (metres_per_unit or 1.0)).tolist()
    placement = turn_and_scale(up, metres_per_unit)
    if origin.any():
        # 0.0 - y is never -0.0.
        placement["translation"] = [x, z, 0.0 - y] if up == "z" else [x, y, z]
    return placement


def write_gltf(document: JsonObject, buffer: PackedBuffer) -> bytes:
    """Write a document as one JSON text, which contains the buffer as base64."""
    if not buffer.chunks:
        return json_text(document)
    document["buffers"] = [{"byteLength": buffer.length, "uri": DATA_URI}, *buffer.empty_buffers]
    # Insert the buffer after writing the JSON: orjson would copy it and reserve 8 times its length.
    text_before, uri_field, text_after = json_text(document).partition(_URI_FIELD)
    # The base64 comes before the closing quotation mark of the URI.
    return b"".join((text_before, uri_field[:-1], *_base64(buffer.chunks), b'"', text_after))


def _base64(chunks: Iterable[memoryview | bytes]) -> Iterator[bytes]:
    """The base64 of the concatenated chunks."""
    remainder = b""
    for chunk in chunks:
        for begin, end in row_runs(len(chunk), BASE64_STEP):
            content = remainder + chunk[begin:end]
            # 3 bytes become 4 letters; the remaining 1 or 2 bytes are encoded in the next step.
            length = len(content) - len(content) % 3
            remainder = content[length:]
            yield base64.b64encode(content[:length])
    yield base64.b64encode(remainder)


def encode_gltf(mesh: Mesh, options: EncodeOptions) -> bytes:
    """The mesh as one glTF JSON document, which contains the buffer as base64.

    Raises
    ------
    UnsupportedByFormat
        The mesh has quads.
    """
    return write_gltf(*build_document(mesh, options))


def build_document(mesh: Mesh, options: EncodeOptions) -> File:
    """The glTF document of a mesh, and its buffer."""
    buffer = BufferBuilder()
    meshes: list[JsonObject] = []
    materials: list[JsonObject] = []
    for drawable in build_drawables(mesh, buffer, options):
        primitives = []
        for primitive, material in drawable.paint():
            if material not in materials:
                materials.append(material)
            primitives.append(primitive | {"material": materials.index(material)})
        meshes.append({"name": drawable.name, "primitives": primitives})
    transform = node_transform(mesh)
    nodes = [{"name": m["name"], "mesh": k, **transform} for k, m in enumerate(meshes)]

    root: JsonObject = {"name": mesh.name, "children": list(range(1, len(nodes) + 1))}
    root |= turn_and_scale(mesh.up, mesh.report.metres_per_unit)
    arrays: JsonObject = {
        "nodes": [root, *nodes] if nodes else [],
        "meshes": meshes,
        "materials": materials,
    }
    return build_whole_document(
        mesh.name, report_object(mesh.report, mesh.parts), arrays, buffer, options
    )


QUANTIZED_CHARS = (
    len('"scale":[,,],') + 3 * FLOAT64_CHARS + 3 * len('"normalized":true,"byteStride":8,')
)
"""The most additional characters of a quantized node: its `scale`, and fields of the accessors and
views of normals, texture coordinates and colours. The minimum and maximum of its positions are
shorter than those of other nodes."""

COMPRESSED_CHARS = 320
"""The most additional characters of a compressed view, with numbers of ten digits."""

FACE_CHARS = 2 * len("4294967295,") + len('"extras":{"faces":{"first_triangle":[],"face":[]}},')
"""The most characters of the number and the first triangle of a face, and of their keys."""


def glb_byte_bound(size: MeshSize, options: EncodeOptions) -> int:
    """The most bytes of a binary file: header, two chunk headers, padding, JSON and buffer."""
    return 12 + 2 * 8 + 3 + _json_bound(size, options) + _buffer_bound(size, options)


def gltf_byte_bound(size: MeshSize, options: EncodeOptions) -> int:
    """The most bytes of a JSON document with its buffer; base64 writes 3 bytes as 4 characters."""
    return _json_bound(size, options) + len(DATA_URI) + -(-_buffer_bound(size, options) // 3) * 4


def _json_bound(size: MeshSize, options: EncodeOptions) -> int:
    """The most bytes of the JSON without the buffer.

    Each part and each overlay is a node. A node with its mesh, accessors, buffer views and material
    has less than 1200 characters of keys and small numbers; nine float64 (translation, minimum,
    maximum); and its name twice. The name of the surface occurs twice, too, and the report names
    every part. Each additional vertex attribute has its name, an accessor and a view. The constant
    covers the asset with the report, the root node and the scene. Quantizing adds characters to
    each node, compression to each view. A colour of the faces of a brep counts as a node.
    """
    keys = [key for name, d in size.attributes for key, _ in attribute_columns(name, d)]
    keys = ["COLOR_0", *keys] if size.colors else keys
    node = 1200 + 9 * (FLOAT64_CHARS + 1) + sum(300 + len(key) for key in keys) + REPORT_PART_CHARS
    if options.quantize:
        node += QUANTIZED_CHARS
    if options.compression == "meshopt":
        # Views of indices, positions, normals and texture coordinates; then the other attributes.
        node += COMPRESSED_CHARS * (4 + len(keys))
    faces = (
        bound_brep_chars(size.defined_faces, size.placed_faces, size.face_name_bytes)
        + size.faces * FACE_CHARS
    )
    names = 3 * LONGEST_ESCAPE * size.name_bytes
    faces += bound_orientation_chars(size.listed_patches)
    return 2720 + 17 * FLOAT64_CHARS + size.drawables * node + names + faces


def _buffer_bound(size: MeshSize, options: EncodeOptions) -> int:
    """The most bytes of the buffer, with normals, parameters and padding.

    Compression never makes a view longer.
    """
    attributes = 4 * sum(d for _, d in size.attributes)
    if options.quantize:
        # Texture coordinates outside of 0 to 1 stay float32.
        point, vertex = 8, 8 + 8 + 8 + (8 if size.colors else 0) + attributes
    else:
        point, vertex = 12, 12 + 12 + 8 + 4 * size.colors + attributes
    index = 2 if max(size.vertices, size.overlay_points) <= LARGEST_SHORT_COUNT else 4
    corners = 3 * (size.triangles + 2 * size.quads) + 2 * size.overlay_segments
    return (
        size.vertices * vertex + size.overlay_points * point + corners * index + 3 * size.drawables
    )
