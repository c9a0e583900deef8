"""The binary half of a glTF: arrays laid one after another, with their views and accessors.

References
----------
Khronos, glTF 2.0 Specification, 3.6: buffers, buffer views, accessors, data alignment.
"""

from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import IndexArray, RealArray
from service.engine.extent import extent

JsonObject: TypeAlias = dict[str, Any]

FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125
"""Component types (3.6.2.2)."""

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
"""Targets of buffer views (3.6.1.3): vertex attributes, vertex indices."""

LARGEST_SHORT_COUNT = 65535
"""Vertices that 16-bit indices can name: index 65535 itself restarts a primitive (3.7.2.1)."""

ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
"""Type of an accessor by its number of components (3.6.2.3)."""


@dataclass(slots=True)
class BufferBuilder:
    """One buffer under construction.

    Every array is a tightly packed view of its own with one accessor; `chunks`, joined, are the
    buffer, `length` bytes long, in which every view begins at a multiple of four (3.6.2.4).
    """

    accessors: list[JsonObject] = field(default_factory=list)
    views: list[JsonObject] = field(default_factory=list)
    chunks: list[memoryview | bytes] = field(default_factory=list)
    length: int = 0

    def add_positions(self, positions: RealArray) -> int:
        """Accessor of positions, shape (V, 3), with the bounds that POSITION must have."""
        stored = np.ascontiguousarray(positions, dtype="<f4")
        low, high = extent(stored)
        # As float64 the very float32 values: equal for readers that round and that do not.
        bounds = {"min": low.tolist(), "max": high.tolist()}
        return self._add(stored, FLOAT, ARRAY_BUFFER, bounds)

    def add_attribute(self, values: RealArray) -> int:
        """Accessor of a vertex attribute, shape (V, 1…4), as float32."""
        stored = np.ascontiguousarray(values, dtype="<f4")
        return self._add(stored, FLOAT, ARRAY_BUFFER, {})

    def add_indices(self, indices: IndexArray, vertices: int) -> int:
        """Accessor of indices of any shape, in 16 bits where `vertices` allow."""
        short = vertices <= LARGEST_SHORT_COUNT
        stored = np.ascontiguousarray(indices.reshape(-1, 1), dtype="<u2" if short else "<u4")
        component = UNSIGNED_SHORT if short else UNSIGNED_INT
        return self._add(stored, component, ELEMENT_ARRAY_BUFFER, {})

    def _add(
        self, stored: NDArray[np.generic], component: int, target: int, bounds: JsonObject
    ) -> int:
        """Accessor of an array of elements, shape (N, 1…4), whose bytes join the buffer."""
        self.views.append(
            {
                "buffer": 0,
                "byteOffset": self.length,
                "byteLength": stored.nbytes,
                "target": target,
            }
        )
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": component,
                "count": stored.shape[0],
                "type": ELEMENT_TYPES[stored.shape[1]],
                **bounds,
            }
        )
        padding = bytes(-stored.nbytes % 4)
        self.chunks += (stored.data, padding)
        self.length += stored.nbytes + len(padding)
        return len(self.accessors) - 1
