"""The arrays of a glTF document: builds their accessors, buffer views and the buffer.

References
----------
Khronos, glTF 2.0 Specification, 3.6: buffers, buffer views, accessors, data alignment.
"""

from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import AnyArray, Bytes, IndexArray
from service.encoders.gltf.columns import Column
from service.engine.extent import find_extent

JsonObject: TypeAlias = dict[str, Any]

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
"""For each NumPy type, the glTF number of the component type (3.6.2.2)."""

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
"""The `target` of a buffer view: of vertex attributes, and of vertex indices (3.6.1.3)."""

LARGEST_SHORT_COUNT = 65535
"""The most vertices that 16-bit indices can name: 0 … 65534, because index 65535 restarts a
primitive (3.7.2.1)."""

ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
"""The type of an accessor, by the number of components (3.6.2.3)."""


@dataclass(frozen=True, eq=False, slots=True)
class BufferView:
    """The array of one buffer view, as bytes.

    Attributes
    ----------
    rows : ndarray of uint8, shape (N, stride)
        The bytes of each element.
    corners : int
        3 for indices of triangles, 2 for indices of lines, 0 for a vertex attribute.
    is_padded : bool
        Whether bytes were added to each element, because the elements of vertex attributes must
        begin at multiples of 4 bytes (3.6.2.4).
    is_unit : bool
        Whether the elements are unit vectors of 16-bit integers, which compression may round.
    """

    rows: Bytes
    corners: int = 0
    is_padded: bool = False
    is_unit: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class PackedBuffer:
    """The buffer views of a document, and its buffers.

    Attributes
    ----------
    views : list of JSON objects
    chunks : list of buffers
        The bytes of the first buffer, in order.
    empty_buffers : list of JSON objects
        More buffers, which have a length but no bytes: compressed views name them.
    extensions : tuple of str
        The extensions that the views need.
    """

    views: list[JsonObject] = field(default_factory=list)
    chunks: list[memoryview | bytes] = field(default_factory=list)
    empty_buffers: list[JsonObject] = field(default_factory=list)
    extensions: tuple[str, ...] = ()

    @property
    def length(self) -> int:
        """Number of bytes of the first buffer."""
        return sum(len(chunk) for chunk in self.chunks)


@dataclass(slots=True)
class BufferBuilder:
    """Collects arrays; each becomes one buffer view with one accessor.

    `is_quantized` says whether any positions are integers, which only an extension allows.
    """

    accessors: list[JsonObject] = field(default_factory=list)
    views: list[BufferView] = field(default_factory=list)
    is_quantized: bool = False

    def add_positions(self, column: Column) -> int:
        """Add positions (V, 3), with the bounds that POSITION requires (3.7.2.1).

        Returns the number of the accessor.
        """
        low, high = find_extent(column.values)
        self.is_quantized |= column.values.dtype.kind == "u"
        # Single precision represents these bounds, so all readers get the same numbers.
        return self.add(column, {"min": low.tolist(), "max": high.tolist()})

    def add(self, column: Column, bounds: JsonObject | None = None) -> int:
        """Add a vertex attribute (V, 1…4); returns the number of the accessor."""
        fields = {"normalized": True} if column.is_normalized else {}
        rows = _rows(column.values)
        is_padded = rows.shape[1] > column.values.dtype.itemsize * column.values.shape[1]
        return self._add(
            column.values, BufferView(rows, 0, is_padded, column.is_unit), fields | (bounds or {})
        )

    def add_indices(self, faces: IndexArray, vertices: int) -> int:
        """Add the indices of triangles (N, 3) or lines (N, 2); returns the number of the accessor.

        The indices have 16 bits if that suffices for the number of vertices.
        """
        indices = index_rows(faces, vertices).reshape(-1, 1)
        return self._add(indices, BufferView(indices.view(np.uint8), faces.shape[1]), {})

    def pack(self) -> PackedBuffer:
        """Put all arrays into one buffer, each at a multiple of 4 bytes."""
        result = PackedBuffer()
        length = 0
        for view in self.views:
            result.views.append({"buffer": 0, "byteOffset": length} | describe_view(view))
            result.chunks.extend(pad(view.rows.data.cast("B")))
            length += view.rows.nbytes + -view.rows.nbytes % 4
        return result

    def _add(self, values: NDArray[np.generic], view: BufferView, fields: JsonObject) -> int:
        """Add a view and its accessor, which also gets these fields."""
        self.views.append(view)
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": COMPONENTS[values.dtype.str[1:]],
                "count": values.shape[0],
                "type": ELEMENT_TYPES[values.shape[1]],
                **fields,
            }
        )
        return len(self.accessors) - 1


def index_rows(faces: IndexArray, vertices: int) -> IndexArray:
    """Indices as a file stores them: in 16 bits if this suffices for the vertices, else in 32."""
    return np.ascontiguousarray(faces, "<u2" if vertices <= LARGEST_SHORT_COUNT else "<u4")


def describe_view(view: BufferView) -> JsonObject:
    """The JSON object of a buffer view, without its position in the buffer."""
    stride = {"byteStride": view.rows.shape[1]} if view.is_padded else {}
    target = ELEMENT_ARRAY_BUFFER if view.corners else ARRAY_BUFFER
    return {"byteLength": view.rows.nbytes, **stride, "target": target}


def pad(content: memoryview | bytes) -> tuple[memoryview | bytes, bytes]:
    """The content, and the zero bytes that make its length a multiple of 4."""
    return content, bytes(-len(content) % 4)


def _rows(values: AnyArray) -> Bytes:
    """The bytes of each element, padded to a multiple of 4: shape (N, stride)."""
    elements = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    size = elements.itemsize * elements.shape[1]
    row_bytes = elements.view(np.uint8).reshape(len(elements), size)
    if size % 4 == 0:
        return row_bytes
    rows = np.zeros((len(elements), size + -size % 4), dtype=np.uint8)
    rows[:, :size] = row_bytes
    return rows
