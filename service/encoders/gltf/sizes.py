"""Upper bounds of the bytes of a glTF file, computed from counts alone."""

from service.encoders.content import REPORT_PART_CHARS
from service.encoders.format import EncodeOptions, MeshSize
from service.encoders.gltf.buffer import LARGEST_SHORT_COUNT
from service.encoders.gltf.columns import attribute_columns
from service.encoders.gltf.document import DATA_URI
from service.encoders.text import FLOAT64_CHARS, LONGEST_ESCAPE

QUANTIZED_CHARS = (
    len('"scale":[,,],') + 3 * FLOAT64_CHARS + 3 * len('"normalized":true,"byteStride":8,')
)
"""The most additional characters of a quantized node: its `scale`, and fields of the accessors and
views of normals, texture coordinates and colours. The minimum and maximum of its positions are
shorter than those of other nodes."""

COMPRESSED_CHARS = 320
"""The most additional characters of a compressed view, with numbers of ten digits."""


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
    each node, compression to each view.
    """
    keys = [key for name, d in size.attributes for key, _ in attribute_columns(name, d)]
    keys = ["COLOR_0", *keys] if size.colors else keys
    node = 1200 + 9 * (FLOAT64_CHARS + 1) + sum(300 + len(key) for key in keys) + REPORT_PART_CHARS
    if options.quantize:
        node += QUANTIZED_CHARS
    if options.compression == "meshopt":
        # Views of indices, positions, normals and texture coordinates; then the other attributes.
        node += COMPRESSED_CHARS * (4 + len(keys))
    names = 3 * LONGEST_ESCAPE * size.name_bytes
    return 2660 + 13 * FLOAT64_CHARS + size.drawables * node + names


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
