"""glTF files made by hand, array by array."""

import json
import struct
from typing import Any

import numpy as np

TRIANGLE: list[list[float]] = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]
SQUARE: list[list[float]] = [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]]
CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


def write_glb(document: dict[str, Any], content: bytes | None = None) -> bytes:
    """A GLB file of a document, and of the bytes of its first buffer."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I", len(text)) + b"JSON" + text
    if content is not None:
        content += bytes(-len(content) % 4)
        chunks += struct.pack("<I", len(content)) + b"BIN\0" + content
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


class Gltf:
    """A document that grows: each array gets a view and an accessor of its own."""

    def __init__(self) -> None:
        self.content = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
            "meshes": [],
            "nodes": [],
            "scenes": [{"nodes": []}],
        }

    def view(self, content: bytes, **fields: Any) -> int:
        """The number of a view of these bytes."""
        self.content += bytes(-len(self.content) % 4)
        place = {"buffer": 0, "byteOffset": len(self.content), "byteLength": len(content)}
        self.document["bufferViews"].append(place | fields)
        self.content += content
        return len(self.document["bufferViews"]) - 1

    def array(self, values: Any, kind: str = "f4", **fields: Any) -> int:
        """The number of an accessor with these numbers."""
        numbers = np.array(values, "<" + kind)
        if numbers.ndim == 2 and numbers.shape[1] * numbers.itemsize % 4:
            padded = np.zeros((len(numbers), 4), numbers.dtype)
            padded[:, :3] = numbers
            view = self.view(padded.tobytes(), byteStride=4 * numbers.itemsize)
        else:
            view = self.view(numbers.tobytes())
        return self.accessor(view, kind, len(numbers), numbers.ndim, **fields)

    def accessor(self, view: int | None, kind: str, count: int, axes: int, **fields: Any) -> int:
        place = {} if view is None else {"bufferView": view}
        entry = {"componentType": CODES[kind], "type": ("SCALAR", "VEC3")[axes - 1], "count": count}
        self.document["accessors"].append(place | entry | fields)
        return len(self.document["accessors"]) - 1

    def mesh(self, **primitive: Any) -> int:
        """The number of a mesh of one primitive: `POSITION`, `NORMAL`, `indices` and others."""
        attributes = {name: primitive.pop(name) for name in list(primitive) if name.isupper()}
        self.document["meshes"].append({"primitives": [{"attributes": attributes} | primitive]})
        return len(self.document["meshes"]) - 1

    def node(self, *, is_root: bool = True, **fields: Any) -> int:
        self.document["nodes"].append(fields)
        number = len(self.document["nodes"]) - 1
        if is_root:
            self.document["scenes"][0]["nodes"].append(number)
        return number

    def write(self) -> bytes:
        self.document["buffers"] = [{"byteLength": len(self.content)}]
        return write_glb(self.document, self.content)


def build_triangle(**fields: Any) -> Gltf:
    """A file with one triangle, and the fields of its primitive."""
    gltf = Gltf()
    gltf.node(mesh=gltf.mesh(POSITION=gltf.array(TRIANGLE), **fields))
    return gltf
