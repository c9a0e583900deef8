"""The vertex attributes of a mesh: their names in glTF, and the numbers that a file stores.

Colours are stored as linear RGB. An attribute `flow` with up to 4 components has the name `_FLOW`.
If it has more components, it is split into `_FLOW_0`, `_FLOW_1` and so on, each with at most 4.

Vertices of a quantized mesh are stored as integers (KHR_mesh_quantization). Their positions
(`service.engine.stored_positions`) are integer multiples of a step s, so they are stored without
rounding: position = t + s k, where k are unsigned 16-bit integers, and the node has the translation
t and the scaling s. All parts and lines of a mesh have the same t and s. Normals are signed 16-bit
integers, which readers divide by 32767; their error is at most 0.0015°. Signed bytes would save 4
bytes for each vertex, but their error would be up to 0.35°, a third of the default crease angle.
Texture coordinates from 0 to 1, and colours, are stored as multiples of 1/65535: dark linear
colours need more than 8 bits. Other texture coordinates, and attributes, stay float32.

References
----------
Khronos, glTF 2.0 Specification: 3.6.2.2 accessor data types, 3.7.2.1 mesh primitives. Khronos,
KHR_mesh_quantization.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import AnyArray, FloatArray, IndexArray, Ints, RealArray
from service.engine.mesh.mesh import Mesh
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

    values: AnyArray
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


QUANTIZATION = "KHR_mesh_quantization"
"""The extension for integers as positions."""

MAX_UNSIGNED, MAX_SIGNED = 65535, 32767
"""The largest unsigned and the largest signed 16-bit integer."""


def build_quantized_columns(mesh: Mesh) -> Columns:
    """All vertex attributes of a quantized mesh, in 16-bit integers where these suffice."""
    columns = build_plain_columns(mesh)
    columns["POSITION"] = grid_positions(mesh.positions, mesh)
    if mesh.normals is not None:
        normals = np.rint(mesh.normals.astype(np.float64) * MAX_SIGNED)
        columns["NORMAL"] = Column(normals.astype("<i2"), is_normalized=True, is_unit=True)
    for name in ("TEXCOORD_0", "COLOR_0"):
        if name in columns:
            columns[name] = _quantize_shares(columns[name])
    return columns


def grid_positions(positions: RealArray, mesh: Mesh) -> Column:
    """Positions of the mesh, or of its lines, as numbers of steps from `_corner(mesh)`."""
    steps = positions.astype(np.float64) / mesh.step - _corner(mesh)
    if len(steps) and not 0 <= steps.min() <= steps.max() <= MAX_UNSIGNED:
        raise ValueError(f"The mesh is longer than {MAX_UNSIGNED} steps of its grid.")
    # The steps are integers already: the positions are multiples of `mesh.step`.
    return Column(steps.astype("<u2"))


def node_transform(mesh: Mesh) -> dict[str, list[float]]:
    """The fields `translation` and `scale` of a node: from stored to model coordinates."""
    shift = mesh.origin + _corner(mesh) * mesh.step if mesh.step else mesh.origin
    translation = {"translation": shift.tolist()} if shift.any() else {}
    return translation | ({"scale": [mesh.step] * 3} if mesh.step else {})


def _corner(mesh: Mesh) -> FloatArray:
    """The least corner of the box of all positions and lines, in steps from the origin.

    It is 0 if the mesh has no positions and no lines.
    """
    arrays = [mesh.positions, *(overlay.positions for overlay in mesh.overlays)]
    lows = [rows.min(axis=0) for rows in arrays if len(rows)]
    if not lows:
        return np.zeros(3)
    corner: FloatArray = np.min(lows, axis=0).astype(np.float64) / mesh.step
    return corner + 0.0  # turns -0.0 into 0.0


def _quantize_shares(column: Column) -> Column:
    """An attribute as 16-bit integers if all its numbers are from 0 to 1; else unchanged."""
    values = column.values
    if not len(values) or values.min() < 0 or values.max() > 1:
        return column
    integers: NDArray[np.uint16] = np.rint(values.astype(np.float64) * MAX_UNSIGNED).astype("<u2")
    return Column(integers, is_normalized=True)
