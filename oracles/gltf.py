"""A short glTF reader, written from the specification and independent of the encoders.

Numbers such as 3.6.2.2 are sections of the glTF 2.0 specification.
"""

import base64
import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""dtypes of NumPy by the `componentType` of an accessor (3.6.2.2)."""

COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
"""Numbers of one element by the `type` of an accessor."""

CORNERS = {1: 2, 4: 3}
"""Corners of a line and of a triangle, by the `mode` of a primitive."""

ELEMENT_ARRAY_BUFFER = 34963
"""Target of a buffer view of indices."""


def import_meshopt() -> Any:
    """The package `meshopt`, which decompresses views; if it is missing, the test is skipped."""
    return pytest.importorskip("meshopt")


@dataclass(frozen=True)
class Gltf:
    """The JSON document of a glTF file, and the only buffer whose bytes the file contains."""

    document: dict[str, Any]
    buffer: bytes

    def array(self, accessor: int) -> NDArray[Any]:
        """The stored elements of an accessor, shape (N, columns)."""
        entry = self.document["accessors"][accessor]
        view = self.document["bufferViews"][entry["bufferView"]]
        kind, columns = np.dtype(COMPONENTS[entry["componentType"]]), COLUMNS[entry["type"]]
        size = kind.itemsize * columns
        stride = view.get("byteStride", size)
        assert view["byteLength"] == stride * entry["count"]
        # Vertex attributes are aligned to 4 bytes, indices are not (3.6.2.4).
        assert stride % 4 == 0 or view["target"] == ELEMENT_ARRAY_BUFFER
        rows = self._bytes(view).reshape(entry["count"], stride)[:, :size]
        return np.ascontiguousarray(rows).view(kind)

    def values(self, accessor: int) -> NDArray[Any]:
        """The values of an accessor; integers that are normalized become fractions (3.6.2.2)."""
        stored = self.array(accessor)
        if not self.document["accessors"][accessor].get("normalized"):
            return stored
        fractions: NDArray[Any] = stored / np.iinfo(stored.dtype).max
        return fractions.clip(min=-1.0)

    def _bytes(self, view: dict[str, Any]) -> NDArray[np.uint8]:
        """The bytes of a view, decompressed if the view is compressed."""
        compressed = view.get("extensions", {}).get("EXT_meshopt_compression")
        source = compressed or view
        assert source["buffer"] == 0
        start = source["byteOffset"]
        assert start % 4 == 0
        content = self.buffer[start : start + source["byteLength"]]
        assert len(content) == source["byteLength"]
        if compressed is None:
            return np.frombuffer(content, np.uint8)
        # The view itself refers to a fallback buffer, which the file does not contain.
        fallback = self.document["buffers"][view["buffer"]]
        assert fallback["extensions"] == {"EXT_meshopt_compression": {"fallback": True}}
        assert "uri" not in fallback
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= fallback["byteLength"]
        count, stride = compressed["count"], compressed["byteStride"]
        assert count * stride == view["byteLength"]
        elements = import_meshopt().decode_gltf_buffer(
            content, count, stride, compressed["mode"], compressed.get("filter")
        )
        decompressed: NDArray[np.uint8] = np.ascontiguousarray(elements).view(np.uint8).ravel()
        return decompressed

    def node(self, name: str) -> dict[str, Any]:
        """The only node of this name below the root."""
        (node,) = (node for node in self.document["nodes"][1:] if node["name"] == name)
        return dict(node)

    def primitive(self, name: str) -> dict[str, Any]:
        """The only primitive of the mesh at the node of this name."""
        (primitive,) = self.document["meshes"][self.node(name)["mesh"]]["primitives"]
        return dict(primitive)

    def attribute(self, name: str, attribute: str) -> NDArray[Any]:
        """A vertex attribute of the primitive at a node."""
        return self.array(self.primitive(name)["attributes"][attribute])

    def corners(self, name: str) -> NDArray[Any]:
        """Positions at the corners of every triangle or line at a node, shape (N, 3 or 2, 3)."""
        primitive = self.primitive(name)
        indices = self.array(primitive["indices"]).ravel()
        shape = -1, CORNERS[primitive["mode"]], 3
        corners: NDArray[Any] = self.attribute(name, "POSITION")[indices].reshape(shape)
        return corners


def read_glb(content: bytes) -> Gltf:
    """The document and the buffer of a GLB file."""
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    chunks: dict[bytes, bytes] = {}
    offset = 12
    while offset < len(content):
        size, kind = struct.unpack_from("<I4s", content, offset)
        assert size % 4 == 0
        chunks[kind] = content[offset + 8 : offset + 8 + size]
        offset += 8 + size
    assert list(chunks) in ([b"JSON"], [b"JSON", b"BIN\0"])
    return Gltf(json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b""))


def read_gltf(content: bytes) -> Gltf:
    """The document and the buffer of a `.gltf` file, whose buffer is a data URL."""
    document = json.loads(content)
    # Other buffers are fallback buffers of compressed views.
    buffer, *_ = document["buffers"]
    head, data = buffer["uri"].split(",")
    assert head == "data:application/gltf-buffer;base64"
    decoded = base64.b64decode(data, validate=True)
    assert len(decoded) == buffer["byteLength"]
    return Gltf(document, decoded)
