"""Writes a GLB file in the plain form that trimesh reads right: triangles, and no node.

The bytes of accessors are copied as they are. Fans, which trimesh does not read, become triangles.
"""

import json
import struct
from typing import NamedTuple

import numpy as np

from service.decoders.meshes.gltf_accessors import Accessor, Accessors
from service.decoders.meshes.gltf_file import BINARY_CHUNK, JSON_CHUNK, MAGIC, JsonObject

TRIANGLES, STRIP, FAN = 4, 5, 6
"""The modes of primitives with triangles."""

INDEX_TYPE = 5125
"""The type of the indices of former fans: 32 bits without a sign."""


class Primitive(NamedTuple):
    """Triangles of a mesh: the numbers of their accessors, or None, and their mode."""

    position: int
    normal: int | None
    indices: int | None
    mode: int


class PlainGlb:
    """A GLB file that gets one mesh after another, each of one primitive."""

    def __init__(self, accessors: Accessors) -> None:
        self._source = accessors
        self._chunks, self._length = list[bytes](), 0
        self._views, self._accessors = list[JsonObject](), list[JsonObject]()
        self._meshes = list[JsonObject]()
        self._numbers: dict[object, tuple[int, Accessor]] = {}

    def add(self, primitive: Primitive) -> tuple[int, int]:
        """Adds a mesh; returns by what its positions and its normals are to be divided."""
        position, found = self._add(primitive.position, "VEC3")
        entry: JsonObject = {"attributes": {"POSITION": position}, "mode": primitive.mode}
        normal_divisor = 1
        if primitive.normal is not None:
            entry["attributes"]["NORMAL"], normals = self._add(primitive.normal, "VEC3")
            normal_divisor = normals.divisor
        if primitive.mode == FAN:
            entry |= {"indices": self._add_fan(primitive, found.count), "mode": TRIANGLES}
        elif primitive.indices is not None:
            entry["indices"], _ = self._add(primitive.indices, "SCALAR")
        self._meshes.append({"name": str(len(self._meshes)), "primitives": [entry]})
        return found.divisor, normal_divisor

    def write(self) -> bytes:
        """The file."""
        document = {
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": self._length}],
            "bufferViews": self._views,
            "accessors": self._accessors,
            "meshes": self._meshes,
        }
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + self._length
        return b"".join(
            (
                MAGIC + struct.pack("<II", 2, length),
                struct.pack("<I", len(text)) + JSON_CHUNK + text,
                struct.pack("<I", self._length) + BINARY_CHUNK,
                *self._chunks,
            )
        )

    def _add(self, number: object, kind: str) -> tuple[int, Accessor]:
        """The number of an accessor in the file, which has it once."""
        key = (number, kind)
        if key not in self._numbers:
            accessor = self._source.find(number, kind)
            content = accessor.content or bytes(accessor.count * accessor.stride)
            stride = {} if accessor.is_packed else {"byteStride": accessor.stride}
            self._numbers[key] = (
                self._append(content, accessor.code, accessor.count, kind, stride),
                accessor,
            )
        return self._numbers[key]

    def _add_fan(self, primitive: Primitive, vertices: int) -> int:
        """The number of an accessor with the corners of the triangles of a fan."""
        corners = np.arange(vertices)
        if primitive.indices is not None:
            corners = self._source.find(primitive.indices, "SCALAR").read()[:, 0]
        middle = np.full(len(corners) - 2, corners[0])
        triangles = np.stack([middle, corners[1:-1], corners[2:]], axis=1)
        content = triangles.astype("<u4").tobytes()
        return self._append(content, INDEX_TYPE, triangles.size, "SCALAR", {})

    def _append(self, content: bytes, code: int, count: int, kind: str, stride: JsonObject) -> int:
        """Appends bytes, with their view and accessor; returns the number of the accessor."""
        place = {"buffer": 0, "byteOffset": self._length, "byteLength": len(content)}
        padded = content + bytes(-len(content) % 4)
        self._chunks.append(padded)
        self._length += len(padded)
        self._views.append(place | stride)
        view = len(self._views) - 1
        self._accessors.append(
            {"bufferView": view, "componentType": code, "count": count, "type": kind}
        )
        return len(self._accessors) - 1
