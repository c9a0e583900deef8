"""Arrays of a glTF document: their accessors and their places in the buffer.

References
----------
Khronos, glTF 2.0 Specification, 3.6: buffers, buffer views, accessors, data alignment.
"""

from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bytes, IndexArray
from service.encoders.gltf.columns import Column
from service.engine.extent import find_extent

JsonObject: TypeAlias = dict[str, Any]

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
"""Component types (3.6.2.2)."""

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
"""Targets of buffer views (3.6.1.3): vertex attributes, vertex indices."""

LARGEST_SHORT_COUNT = 65535
"""Vertices that 16-bit indices can name: index 65535 itself restarts a primitive (3.7.2.1)."""

ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
"""Type of an accessor by its number of components (3.6.2.3)."""


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """An array as the bytes of its elements, shape (N, stride).

    `corners` is 3 for indices of triangles, 2 for those of lines, 0 for a vertex attribute, whose
    elements begin at multiples of 4 bytes (3.6.2.4). `padded` says whether elements are longer than
    their components, `unit` whether they are unit vectors.
    """

    rows: Bytes
    corners: int = 0
    padded: bool = False
    unit: bool = False

    @property
    def target(self) -> int:
        """The use of the array, as a buffer view's target."""
        return ELEMENT_ARRAY_BUFFER if self.corners else ARRAY_BUFFER


@dataclass(frozen=True, eq=False, slots=True)
class Packed:
    """All views: their JSON, and the bytes of the first buffer.

    `others` are the buffers without bytes.
    """

    views: list[JsonObject] = field(default_factory=list)
    chunks: list[memoryview | bytes] = field(default_factory=list)
    others: list[JsonObject] = field(default_factory=list)
    extensions: tuple[str, ...] = ()

    @property
    def length(self) -> int:
        """Number of bytes of the first buffer."""
        return sum(len(chunk) for chunk in self.chunks)


@dataclass(slots=True)
class BufferBuilder:
    """Collects arrays; each becomes one view with one accessor.

    `quantized` says whether positions are integers, which only an extension allows.
    """

    accessors: list[JsonObject] = field(default_factory=list)
    views: list[View] = field(default_factory=list)
    quantized: bool = False

    def add_positions(self, column: Column) -> int:
        """Accessor of positions, (V, 3), with the bounds that POSITION must have (3.7.2.1)."""
        low, high = find_extent(column.values)
        self.quantized |= column.values.dtype.kind == "u"
        # The bounds are float32 values, exact as float64: equal for readers of either precision.
        return self.add(column, {"min": low.tolist(), "max": high.tolist()})

    def add(self, column: Column, bounds: JsonObject | None = None) -> int:
        """Accessor of a vertex attribute, (V, 1…4)."""
        more = {"normalized": True} if column.normalized else {}
        rows = _rows(column.values)
        padded = rows.shape[1] > column.values.dtype.itemsize * column.values.shape[1]
        return self._add(column.values, View(rows, 0, padded, column.unit), more | (bounds or {}))

    def add_indices(self, faces: IndexArray, vertices: int) -> int:
        """Accessor of indices of triangles or lines, (N, 3 or 2); in 16 bits if they fit."""
        stored = index_rows(faces, vertices).reshape(-1, 1)
        view = View(stored.view(np.uint8), corners=faces.shape[1])
        return self._add(stored, view, {})

    def pack(self) -> Packed:
        """All arrays one after another, each at a multiple of 4 bytes."""
        laid = Packed()
        length = 0
        for view in self.views:
            entry = {"buffer": 0, "byteOffset": length} | describe_view(view)
            laid.views.append(entry)
            laid.chunks.extend(pad(view.rows.data.cast("B")))
            length += view.rows.nbytes + -view.rows.nbytes % 4
        return laid

    def _add(self, values: NDArray[np.generic], view: View, more: JsonObject) -> int:
        self.views.append(view)
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": COMPONENTS[values.dtype.str[1:]],
                "count": values.shape[0],
                "type": ELEMENT_TYPES[values.shape[1]],
                **more,
            }
        )
        return len(self.accessors) - 1


def index_rows(faces: IndexArray, vertices: int) -> IndexArray:
    """Indices in the type of the file: 16 bits for few vertices, else 32 bits."""
    kind = "<u2" if vertices <= LARGEST_SHORT_COUNT else "<u4"
    return np.ascontiguousarray(faces, dtype=kind)


def describe_view(view: View) -> JsonObject:
    """The JSON of a view, without its place in the buffer."""
    stride = {"byteStride": view.rows.shape[1]} if view.padded else {}
    return {"byteLength": view.rows.nbytes, **stride, "target": view.target}


def pad(content: memoryview | bytes) -> tuple[memoryview | bytes, bytes]:
    """Bytes, padded to a multiple of 4."""
    return content, bytes(-len(content) % 4)


def _rows(values: NDArray[Any]) -> Bytes:
    """The bytes of elements, (N, stride), each padded to a multiple of 4."""
    stored = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    size = stored.itemsize * stored.shape[1]
    row_bytes = stored.view(np.uint8).reshape(len(stored), size)
    if size % 4 == 0:
        return row_bytes
    rows = np.zeros((len(stored), size + -size % 4), dtype=np.uint8)
    rows[:, :size] = row_bytes
    return rows
