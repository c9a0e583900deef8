"""Compressed views: EXT_meshopt_compression, lossless except for some normals.

Triangles are put in an order that suits graphics cards and vertices in the order of their first
use, which compresses well; each view then stores differences of consecutive elements. A view that
would not become shorter is stored without compression. Normals of 16 bits go through the octahedral
filter, 12 bits for each coordinate on the unfolded octahedron: with errors up to 0.1°, and half as
long as the lossless form. A compressed view has its place in a second buffer, which has a length
but no bytes. Readers must support the extension.

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
from service.encoders.gltf.buffer import BufferBuilder, JsonObject, Packed, View, describe_view, pad

EXTENSION = "EXT_meshopt_compression"

MODES = {0: "ATTRIBUTES", 2: "INDICES", 3: "TRIANGLES"}
"""Modes by the number of a face's corners."""

OCTAHEDRAL = {"filter": "OCTAHEDRAL"}

NORMAL_BITS = 12
"""Bits of each of the two octahedral coordinates of a normal, with the sign."""

FALLBACK: JsonObject = {EXTENSION: {"fallback": True}}


@cache
def available() -> bool:
    """Whether the library is installed."""
    try:
        _library()
    except ImportError:
        return False
    return True


@cache
def library_version() -> str:
    """Version of the library: another version may compress the same numbers to other bytes."""
    return version("meshopt") if available() else "none"


def order_faces(faces: IndexArray, vertices: int) -> tuple[IndexArray, Ints]:
    """Triangles (T, 3) or lines (L, 2) in a better order, and the old index of each vertex.

    Unused vertices come last. Lines keep their order, but their vertices do not.

    Returns
    -------
    faces : ndarray of uint32
    order : ndarray of int, shape (vertices,)
    """
    corners = faces.shape[1]
    indices, place, used = _library().reorder_mesh(
        np.ascontiguousarray(faces, dtype=np.uint32).reshape(-1), corners == 3, False
    )
    place = place[:vertices]
    # There may be unused vertices after the last index; they get places after all others.
    order = np.empty(vertices, dtype=np.intp)
    first_uses = np.flatnonzero(place < used)
    order[place[first_uses]] = first_uses
    unseen = np.ones(vertices, dtype=bool)
    unseen[first_uses] = False
    order[used:] = np.flatnonzero(unseen)
    return indices.reshape(-1, corners), order


def compress_buffer(buffer: BufferBuilder) -> Packed:
    """All arrays, each with or without compression, whichever is shorter."""
    views: list[JsonObject] = []
    chunks: list[memoryview | bytes] = []
    length = promised = 0
    for view in buffer.views:
        checkpoint()
        content, more = _encode_view(view)
        entry = describe_view(view)
        if len(content) >= view.rows.nbytes:
            content = view.rows.data.cast("B")
            entry = {"buffer": 0, "byteOffset": length} | entry
        else:
            hidden = {
                "buffer": 0,
                "byteOffset": length,
                "byteLength": len(content),
                "byteStride": view.rows.shape[1],
                "count": view.rows.shape[0],
                "mode": MODES[view.corners],
                **more,
            }
            entry = {
                "buffer": 1,
                "byteOffset": promised,
                **entry,
                "extensions": {EXTENSION: hidden},
            }
            promised += view.rows.nbytes + -view.rows.nbytes % 4
        views.append(entry)
        chunks.extend(pad(content))
        length += len(content) + -len(content) % 4
    if not promised:
        return Packed(views, chunks)
    return Packed(views, chunks, [{"byteLength": promised, "extensions": FALLBACK}], (EXTENSION,))


def _encode_view(view: View) -> tuple[memoryview | bytes, JsonObject]:
    """A compressed view, and the filter that decodes it."""
    library = _library()
    if view.corners:
        indices = view.rows.view("<u2" if view.rows.shape[1] == 2 else "<u4")
        return library.encode_gltf_buffer(indices, MODES[view.corners]), {}
    if view.unit:
        return library.encode_gltf_buffer(_octahedral(view.rows), "ATTRIBUTES"), OCTAHEDRAL
    return library.encode_gltf_buffer(view.rows, "ATTRIBUTES"), {}


def _octahedral(rows: Bytes) -> Bytes:
    """Normals of 16 bits, (N, 8) bytes, filtered."""
    vectors = rows.view("<i2").astype(np.float32)
    vectors /= 32767.0
    filtered: Bytes = _library().encode_filter_oct(vectors, 8, NORMAL_BITS)
    return filtered


def _library() -> Any:
    """The module, imported at its first use."""
    return import_module("meshopt")
