"""Accessors of glTF: checked against their bytes, and written again in a plain form.

trimesh reads strides and all types of numbers; it leaves out the changes of sparse accessors, and
does not divide normalized integers. So a plain file has the bytes of dense accessors, and what it
should divide by is kept.

References
----------
Khronos, glTF 2.0 Specification: 3.6.2 accessors, 3.11 animations (normalized integers).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import AnyArray
from service.decoders.format import build_file_error, build_malformed_error
from service.decoders.meshes.gltf_file import JsonObject, find_object, list_objects, pick, whole
from service.decoders.meshes.gltf_meshopt import unpack_view
from service.errors import InvalidRequest

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""The types of numbers, by their codes in a document."""

WIDTHS = {"SCALAR": 1, "VEC3": 3}

MAX_STRIDE = 252

INDICES, VECTORS = (5121, 5123, 5125), (5120, 5121, 5122, 5123, 5126)
"""The types of indices, and those of positions and normals, with KHR_mesh_quantization."""


@dataclass(frozen=True, eq=False, slots=True)
class Accessor:
    """Numbers of a buffer, all of whose bytes are there.

    Attributes
    ----------
    source : JsonObject
        The accessor of the document.
    count, width : int
    code : int
        The type of the numbers.
    stride : int
        Bytes from one item to the next.
    content : bytes
        From the first byte to the last; empty if all numbers are 0.
    """

    source: JsonObject
    count: int
    width: int
    code: int
    stride: int
    content: bytes

    @property
    def is_packed(self) -> bool:
        """Whether its items follow each other without a gap."""
        return self.stride == self.width * np.dtype(TYPES[self.code]).itemsize

    @property
    def divisor(self) -> int:
        """By what the numbers are to be divided: the largest of their type if `normalized`."""
        is_normalized = self.source.get("normalized") is True and self.code != 5126
        return int(np.iinfo(TYPES[self.code]).max) if is_normalized else 1

    def read(self) -> AnyArray:
        """A copy of the numbers (count, width) of the accessor itself."""
        shape, dtype = (self.count, self.width), np.dtype(TYPES[self.code])
        if not self.content:
            return np.zeros(shape, dtype)
        strides = (self.stride, dtype.itemsize)
        return np.ndarray(shape, dtype, self.content, 0, strides).copy()


class Accessors:
    """The accessors of a document, with its bytes."""

    def __init__(self, document: JsonObject, buffers: Sequence[bytes]) -> None:
        self._accessors = list_objects(document, "accessors")
        self._views = list_objects(document, "bufferViews")
        self._buffers = buffers
        self._contents: dict[int, memoryview] = {}

    def count(self, number: object) -> int:
        """How many items an accessor has."""
        return whole(pick(self._accessors, number).get("count"))

    def has_bytes(self, number: object) -> bool:
        """Whether an accessor has numbers of a buffer, or changes."""
        return not {"bufferView", "sparse"}.isdisjoint(pick(self._accessors, number))

    def find(self, number: object, kind: str) -> Accessor:
        """An accessor of the type SCALAR or VEC3, with all changes that it has if it is sparse."""
        source = pick(self._accessors, number)
        codes = INDICES if kind == "SCALAR" else VECTORS
        if source.get("type") != kind or source.get("componentType") not in codes:
            needed = "indices as whole numbers, and vectors of three numbers"
            raise build_malformed_error("An accessor has another type.", "another type", needed)
        accessor = self._find_dense(source, source, whole(source.get("count")), kind)
        return self._apply_changes(accessor) if "sparse" in source else accessor

    def _find_dense(self, source: JsonObject, place: JsonObject, count: int, kind: str) -> Accessor:
        """The numbers that begin at the `bufferView` and `byteOffset` of `place`."""
        code, width = source["componentType"], WIDTHS[kind]
        size = width * np.dtype(TYPES[code]).itemsize
        if "bufferView" not in place:
            return Accessor(source, count, width, code, size, b"")
        number = whole(place["bufferView"])
        view = pick(self._views, number)
        content = self._find_content(number, view)
        stride, offset = whole(view.get("byteStride"), size), whole(place.get("byteOffset"), 0)
        span = (count - 1) * stride + size if count else 0
        if offset + span > len(content) or not size <= stride <= MAX_STRIDE:
            raise _outside_error("a count, a stride or an offset")
        return Accessor(source, count, width, code, stride, bytes(content[offset : offset + span]))

    def _find_content(self, number: int, view: JsonObject) -> memoryview:
        """The bytes of a view, which is unpacked once if it is compressed."""
        if number not in self._contents:
            unpacked = unpack_view(view, self._buffers)
            self._contents[number] = memoryview(unpacked) if unpacked else self._cut(view)
        return self._contents[number]

    def _cut(self, view: JsonObject) -> memoryview:
        """The bytes of a view in its buffer."""
        number = whole(view.get("buffer"))
        if number >= len(self._buffers):
            raise build_malformed_error("A view has no buffer.", str(number), "its number")
        start, length = whole(view.get("byteOffset"), 0), whole(view.get("byteLength"))
        if start + length > len(self._buffers[number]):
            raise _outside_error("a length or an offset")
        return memoryview(self._buffers[number])[start : start + length]

    def _apply_changes(self, accessor: Accessor) -> Accessor:
        """A sparse accessor as a dense one."""
        sparse = find_object(accessor.source, "sparse")
        places, values_place = find_object(sparse, "indices"), find_object(sparse, "values")
        if places.get("componentType") not in INDICES:
            raise build_malformed_error("Indices have another type.", "numbers", "whole numbers")
        kind = "SCALAR" if accessor.width == 1 else "VEC3"
        count = whole(sparse.get("count"))
        if count > accessor.count:
            message, needed = (
                "An accessor has more changes than items.",
                f"at most {accessor.count}",
            )
            raise build_file_error(message, str(count), needed)
        rows = self._find_dense(places, places, count, "SCALAR").read()[:, 0]
        values = self._find_dense(accessor.source, values_place, count, kind).read()
        numbers = accessor.read()
        if count and rows.max() >= accessor.count:
            needed = f"less than {accessor.count}"
            raise build_file_error("A change has no item.", "an index beyond the items", needed)
        numbers[rows] = values
        stride = numbers.dtype.itemsize * accessor.width
        content = numbers.tobytes()
        source = accessor.source
        return Accessor(source, accessor.count, accessor.width, accessor.code, stride, content)


def _outside_error(got: str) -> InvalidRequest:
    message, needed = "Numbers of the file are outside of its bytes.", "all of them inside"
    return build_file_error(message, got, needed)
