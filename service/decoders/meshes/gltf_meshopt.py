"""Views of glTF files that EXT_meshopt_compression has compressed, as this service writes them.

The optional library `meshopt`, which compresses them, unpacks them too.

References
----------
Khronos, EXT_meshopt_compression.
"""

from collections.abc import Sequence
from importlib import import_module
from typing import Any

from service.decoders.format import build_file_error, build_malformed_error
from service.decoders.meshes.gltf_file import (
    MESHOPT,
    JsonObject,
    extension_error,
    find_object,
    whole,
)

MODES = frozenset({"ATTRIBUTES", "TRIANGLES", "INDICES"})
FILTERS = frozenset({"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"})

MAX_STRIDE = 256
"""The most bytes of an item, which the extension allows."""


def find_library() -> Any:
    """The module `meshopt`, or None if it is not installed."""
    try:
        return import_module("meshopt")
    except ImportError:
        return None


def unpack_view(view: JsonObject, buffers: Sequence[bytes]) -> bytes | None:
    """The bytes of a view that is compressed; None if it is not."""
    extensions = find_object(view, "extensions")
    if MESHOPT not in extensions:
        return None
    fields = find_object(extensions, MESHOPT)
    library = find_library()
    if library is None:
        raise extension_error()
    number, start = whole(fields.get("buffer")), whole(fields.get("byteOffset"), 0)
    count, stride = whole(fields.get("count")), whole(fields.get("byteStride"))
    mode, applied = str(fields.get("mode")), str(fields.get("filter", "NONE"))
    end = start + whole(fields.get("byteLength"))
    is_inside = number < len(buffers) and end <= len(buffers[number])
    if mode not in MODES or applied not in FILTERS or not 0 < stride <= MAX_STRIDE:
        needed = "a mode, a filter and a stride of EXT_meshopt_compression"
        raise build_malformed_error("A compressed view is wrong.", "other fields", needed)
    if not is_inside or count * stride != view.get("byteLength"):
        message, needed = "A compressed view is outside of its bytes.", "all of it inside"
        raise build_file_error(message, "a count, a length or an offset", needed)
    filter_name = None if applied == "NONE" else applied
    try:
        unpacked = library.decode_gltf_buffer(
            buffers[number][start:end], count, stride, mode, filter_name
        )
        content: bytes = unpacked.tobytes()
    except ValueError:
        message, needed = (
            "A compressed view cannot be unpacked.",
            "bytes as meshoptimizer packs them",
        )
        raise build_file_error(message, "other bytes", needed) from None
    if len(content) != count * stride:
        raise build_file_error("A compressed view has another length.", "other bytes", "its length")
    return content
