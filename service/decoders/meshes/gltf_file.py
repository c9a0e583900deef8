"""The document of a glTF file and its bytes: of GLB, or of JSON whose buffers are in it as base64.

References
----------
Khronos, glTF 2.0 Specification: 3.6.1 buffers, 4 GLB.
"""

import base64
import binascii
import json
from typing import Any, TypeAlias

from service.decoders.format import build_file_error, build_malformed_error
from service.errors import InvalidRequest, Issue

JsonObject: TypeAlias = dict[str, Any]

MAGIC, JSON_CHUNK, BINARY_CHUNK = b"glTF", b"JSON", b"BIN\0"
HEAD_BYTES, CHUNK_HEAD_BYTES = 12, 8

DATA = "data:"
"""The beginning of the address of a buffer that is inside the document."""

MESHOPT = "EXT_meshopt_compression"

READ_EXTENSIONS = ("KHR_mesh_quantization", MESHOPT)
"""The extensions that change where vertices are, and are read."""

IGNORED_EXTENSIONS = (
    *("KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_animation_", "KHR_xmp", "EXT_texture_"),
    *("MSFT_texture_", "EXT_lights_", "EXT_mesh_features", "EXT_structural_metadata"),
)
"""Beginnings of the extensions that do not change where vertices are."""


def parse_file(name: str, content: bytes) -> tuple[JsonObject, list[bytes]]:
    """The document of a `glb` or `gltf` file, and its buffers.

    Raises
    ------
    MalformedBody, InvalidRequest
    """
    text, chunk = _split(content) if name == "glb" else (content, None)
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        message, needed = "The file has no JSON that can be read.", "one JSON document"
        raise build_malformed_error(message, "another text", needed) from None
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise build_malformed_error("The file is not glTF.", "other JSON", "a document with asset")
    if not str(document["asset"].get("version")).startswith("2."):
        raise build_malformed_error("The file is not glTF 2.", "another version", "2.0")
    check_extensions(document)
    buffers = list_objects(document, "buffers")
    return document, [
        _read_buffer(each, chunk if k == 0 else None) for k, each in enumerate(buffers)
    ]


def _split(content: bytes) -> tuple[bytes, bytes | None]:
    """The JSON of a GLB file, and its bytes if it has some."""
    if content[:4] != MAGIC or content[4:8] != b"\2\0\0\0":
        raise build_malformed_error("The file is not GLB.", "another beginning", "glTF, version 2")
    length = int.from_bytes(content[8:12], "little")
    if length > len(content):
        raise build_file_error("The file ends too early.", f"{len(content)} bytes", f"{length}")
    chunks, start = list[tuple[bytes, bytes]](), HEAD_BYTES
    while start < length and len(chunks) < 2:  # others are extensions
        begin = start + CHUNK_HEAD_BYTES
        end = begin + int.from_bytes(content[start : start + 4], "little")
        if end > length:
            raise build_file_error(
                "A chunk of the file is too long.", f"to byte {end}", f"{length}"
            )
        chunks.append((content[start + 4 : begin], content[begin:end]))
        start = end
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise build_malformed_error("The file has no document.", "another chunk", "JSON first")
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BINARY_CHUNK else None
    return chunks[0][1], binary


def _read_buffer(buffer: JsonObject, chunk: bytes | None) -> bytes:
    """The bytes of a buffer; none of one that only an extension fills."""
    uri, length = buffer.get("uri"), whole(buffer.get("byteLength"))
    if isinstance(uri, str):
        if uri[: len(DATA)].lower() != DATA:
            message, needed = "The service reads no other file.", "GLB, or buffers as base64"
            raise build_file_error(message, "the address of a buffer", needed)
        try:
            content = base64.b64decode(uri.partition(",")[2], validate=True)
        except (ValueError, binascii.Error):
            message = "A buffer of the file is not base64."
            raise build_file_error(message, "other characters", "base64") from None
    else:
        content = chunk or b""
        if chunk is None and not buffer.get("extensions"):
            raise build_file_error("A buffer of the file has no bytes.", "nothing", f"{length}")
        if chunk is None:
            return content
    if len(content) < length:
        raise build_file_error("A buffer is too short.", f"{len(content)} bytes", f"{length}")
    return content


def check_extensions(document: JsonObject) -> None:
    """Refuse a file that cannot be read without an extension which the service does not know."""
    required = document.get("extensionsRequired", [])
    if not isinstance(required, list):
        raise build_malformed_error("A list of the document is none.", "another value", "a list")
    for each in required:
        if each not in READ_EXTENSIONS and not str(each).startswith(IGNORED_EXTENSIONS):
            raise extension_error()


def extension_error() -> InvalidRequest:
    """The error of a file whose vertices only an extension can find."""
    message = "The file needs an extension of glTF that the service does not read."
    needed = "the file without compression by Draco, and without instances on the GPU"
    return InvalidRequest(Issue("format_not_read", message, "", "another extension", needed))


def list_objects(document: JsonObject, name: str) -> list[JsonObject]:
    """The objects of a list of the document; none if it does not have the list."""
    items = document.get(name, [])
    if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        raise build_malformed_error("A list of the document is none.", "another value", "objects")
    return items


def find_object(item: JsonObject, name: str) -> JsonObject:
    """The object that a field of the document has; an empty one if the field is left out."""
    value = item.get(name, {})
    if not isinstance(value, dict):
        raise build_malformed_error(
            "A field of the document is none.", "another value", "an object"
        )
    return value


def whole(value: object, default: int | None = None) -> int:
    """A whole number of the document that is not negative."""
    value = default if value is None else value
    if type(value) is not int or value < 0:
        needed = "a whole number, 0 or more"
        raise build_malformed_error("A number of the document is wrong.", "another value", needed)
    return value


def pick(items: list[JsonObject], number: object) -> JsonObject:
    """The item of a list that has this number."""
    index = whole(number)
    if index >= len(items):
        needed = f"less than {len(items)}"
        raise build_malformed_error("A number names no item.", str(index), needed)
    return items[index]
