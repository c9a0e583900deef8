"""The vertex attributes of a mesh: their names in glTF, and the numbers that a file stores.

Colours are stored as linear RGB. An attribute `flow` with up to 4 components has the name `_FLOW`.
If it has more components, it is split into `_FLOW_0`, `_FLOW_1` and so on, each with at most 4.

References
----------
Khronos, glTF 2.0 Specification: 3.7.2.1 mesh primitives.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import IndexArray, Ints, RealArray
from service.engine.mesh.mesh_value import Mesh
from service.engine.scenes.colors import to_linear


@dataclass(frozen=True, eq=False, slots=True)
class Column:
    """The values of one vertex attribute.

    Attributes
    ----------
    values : ndarray, shape (V, 1…4)
        float32, or integers of 8 or 16 bits.
    is_normalized : bool
        Whether readers must divide the integers by the largest value of their type.
    is_unit : bool
        Whether the values are unit vectors of 16-bit integers, which compression may round.
    """

    values: NDArray[Any]
    is_normalized: bool = False
    is_unit: bool = False

    def take(self, rows: IndexArray | Ints | slice) -> "Column":
        """The attribute for these vertices only."""
        all_values = self.values
        values = all_values[rows] if isinstance(rows, slice) else all_values.take(rows, axis=0)
        return Column(values, self.is_normalized, self.is_unit)


Columns: TypeAlias = dict[str, Column]
"""Vertex attributes by their names in glTF."""


def build_plain_columns(mesh: Mesh) -> Columns:
    """All vertex attributes of a mesh, in float32."""
    columns = {"POSITION": mesh.positions}
    if mesh.normals is not None:
        columns["NORMAL"] = mesh.normals
    if mesh.uvs is not None:
        columns["TEXCOORD_0"] = mesh.uvs
    if mesh.colors is not None:
        columns["COLOR_0"] = to_linear(mesh.colors)
    for name, values in mesh.attributes:
        for key, components in attribute_columns(name, values.shape[1]):
            columns[key] = values[:, components]
    return {key: Column(to_single(values)) for key, values in columns.items()}


def attribute_columns(name: str, dimension: int) -> Iterator[tuple[str, slice]]:
    """The names under which an attribute is stored, each with its components, at most 4."""
    if dimension <= 4:
        yield f"_{name.upper()}", slice(0, dimension)
        return
    for k, first in enumerate(range(0, dimension, 4)):
        yield f"_{name.upper()}_{k}", slice(first, first + 4)


def to_single(values: RealArray) -> NDArray[np.float32]:
    """The numbers as contiguous little-endian float32."""
    return np.ascontiguousarray(values, dtype="<f4")
