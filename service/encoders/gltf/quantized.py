"""Stores vertices as integers: KHR_mesh_quantization.

Positions of a quantized mesh (`service.engine.stored_positions`) are integer multiples of a step s,
so they are stored without rounding: position = t + s k, where k are unsigned 16-bit integers, and
the node has the translation t and the scaling s. All parts and lines of a mesh have the same t and
s.

Normals are signed 16-bit integers, which readers divide by 32767; their error is at most 0.0015°.
Signed bytes would save 4 bytes for each vertex, but their error would be up to 0.35°, a third of
the default crease angle. Texture coordinates from 0 to 1, and colours, are stored as multiples of
1/65535: dark linear colours need more than 8 bits. Other texture coordinates, and attributes, stay
float32.

References
----------
Khronos, KHR_mesh_quantization. Khronos, glTF 2.0 Specification: 3.6.2.2 accessor data types.
"""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.encoders.gltf.columns import Column, Columns, build_plain_columns
from service.engine.mesh.mesh_value import Mesh

EXTENSION = "KHR_mesh_quantization"

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


def grid_transform(mesh: Mesh) -> dict[str, list[float]]:
    """The fields `translation` and `scale` of a node: from stored integers to model coordinates."""
    shift = mesh.origin + _corner(mesh) * mesh.step
    translation = {"translation": shift.tolist()} if shift.any() else {}
    return translation | {"scale": [mesh.step] * 3}


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
