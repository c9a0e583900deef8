"""Compresses buffer views with EXT_meshopt_compression; only 16-bit normals lose digits.

Triangles are put in an order that suits graphics cards, and vertices in the order of their first
use; both compress well. A compressed view stores the differences of consecutive elements. A view
that would not become shorter is stored without compression. Normals of 16 bits are encoded by the
octahedral filter with 12 bits for each coordinate on the unfolded octahedron. Their errors are up
to 0.1°, and they take half the bytes of normals without loss. As the extension requires, a
compressed view also has a position in a second buffer, which has a length but no bytes. Readers
must support the extension.

The optional library `meshopt` compresses.

References
----------
Khronos, EXT_meshopt_compression: fallback buffers, modes ATTRIBUTES, TRIANGLES and INDICES, the
octahedral filter. A. Kapoulkine, meshoptimizer.
"""

from functools import cache
from importlib import import_module
from importlib.metadata import version
from typing import Any

import numpy as np

from service.bases.arrays import Bytes, IndexArray, Ints
from service.cancellation import checkpoint
from service.encoders.gltf.buffer import (
    BufferBuilder,
    BufferView,
    JsonObject,
    PackedBuffer,
    describe_view,
    pad,
)

EXTENSION = "EXT_meshopt_compression"

MODES = {0: "ATTRIBUTES", 2: "INDICES", 3: "TRIANGLES"}
"""The mode of a view, by `BufferView.corners`."""

OCTAHEDRAL = {"filter": "OCTAHEDRAL"}
"""The field of a view whose normals are encoded by the octahedral filter."""

NORMAL_BITS = 12
"""Bits of each of the two octahedral coordinates of a normal, including the sign."""

FALLBACK: JsonObject = {EXTENSION: {"fallback": True}}
"""The `extensions` of the buffer without bytes."""


@cache
def is_available() -> bool:
    """Whether the library is installed."""
    try:
        _library()
    except ImportError:
        return False
    return True


@cache
def library_version() -> str:
    """The version of the library, or "none".

    Another version may compress the same numbers to other bytes.
    """
    return version("meshopt") if is_available() else "none"


def order_faces(faces: IndexArray, vertices: int) -> tuple[IndexArray, Ints]:
    """Reorder triangles (T, 3) or lines (L, 2), and their vertices, so that they compress well.

    Lines keep their order, but their vertices get new numbers. Unused vertices come last.

    Returns
    -------
    faces : ndarray of uint32
        Triangles or lines, with the new numbers of vertices.
    order : ndarray of int, shape (vertices,)
        The old number of each vertex.
    """
    corners = faces.shape[1]
    is_triangles, optimizes_size = corners == 3, False
    indices, new_number, used_count = _library().reorder_mesh(
        np.ascontiguousarray(faces, dtype=np.uint32).reshape(-1), is_triangles, optimizes_size
    )
    # `new_number` may be shorter than `vertices`, if the last vertices are unused, or longer. The
    # number of an unused vertex is at least `used_count`.
    order = np.empty(vertices, dtype=np.intp)
    used = np.flatnonzero(new_number[:vertices] < used_count)
    order[new_number[used]] = used
    is_unused = np.ones(vertices, dtype=bool)
    is_unused[used] = False
    order[used_count:] = np.flatnonzero(is_unused)
    return indices.reshape(-1, corners), order


def compress_buffer(buffer: BufferBuilder) -> PackedBuffer:
    """Put all arrays into one buffer, each with or without compression, whichever is shorter."""
    views: list[JsonObject] = []
    chunks: list[memoryview | bytes] = []
    # Bytes of the first buffer, and of the second buffer, which has no content.
    length = fallback_length = 0
    for view in buffer.views:
        checkpoint()
        content, filter_field = _encode_view(view)
        entry = describe_view(view)
        if len(content) >= view.rows.nbytes:
            content = view.rows.data.cast("B")
            entry = {"buffer": 0, "byteOffset": length} | entry
        else:
            compressed_view = {
                "buffer": 0,
                "byteOffset": length,
                "byteLength": len(content),
                "byteStride": view.rows.shape[1],
                "count": view.rows.shape[0],
                "mode": MODES[view.corners],
                **filter_field,
            }
            entry = {
                "buffer": 1,
                "byteOffset": fallback_length,
                **entry,
                "extensions": {EXTENSION: compressed_view},
            }
            fallback_length += view.rows.nbytes + -view.rows.nbytes % 4
        views.append(entry)
        chunks.extend(pad(content))
        length += len(content) + -len(content) % 4
    if not fallback_length:
        return PackedBuffer(views, chunks)
    return PackedBuffer(
        views, chunks, [{"byteLength": fallback_length, "extensions": FALLBACK}], (EXTENSION,)
    )


def _encode_view(view: BufferView) -> tuple[memoryview | bytes, JsonObject]:
    """The compressed bytes of a view, and the JSON field of its filter, if it has one."""
    library = _library()
    if view.corners:
        indices = view.rows.view("<u2" if view.rows.shape[1] == 2 else "<u4")
        return library.encode_gltf_buffer(indices, MODES[view.corners]), {}
    if view.is_unit:
        return library.encode_gltf_buffer(_octahedral(view.rows), "ATTRIBUTES"), OCTAHEDRAL
    return library.encode_gltf_buffer(view.rows, "ATTRIBUTES"), {}


def _octahedral(rows: Bytes) -> Bytes:
    """Normals of 16 bits, (N, 8) bytes, encoded by the octahedral filter."""
    vectors = rows.view("<i2").astype(np.float32)
    vectors /= 32767.0
    return np.asarray(_library().encode_filter_oct(vectors, rows.shape[1], NORMAL_BITS))


def _library() -> Any:
    """The module `meshopt`, which is imported at its first use."""
    return import_module("meshopt")
