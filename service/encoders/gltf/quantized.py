"""Vertices in integers: KHR_mesh_quantization.

Positions of a mesh on a grid (`service.engine.grid`) are whole multiples of its step s, so that
they are stored without any rounding: position = t + s k with k of 16 bits and no sign, where the
node has the translation t and the scaling s. All parts and lines of a mesh have the same t and s.

Normals are signed, of 16 bits and divided by 32767: within 0.0015° of what they are. Signed bytes
would be smaller by four bytes a vertex and as far off as 0.35°, a third of the crease angle.
Texture coordinates from 0 to 1, and colours, which are linear and need more than 8 bits in the
dark, are divided by 65535. Other texture coordinates, and attributes, stay float32.

References
----------
Khronos, KHR_mesh_quantization. Khronos, glTF 2.0 Specification: 3.6.2.2 accessor data types.
"""

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import FloatArray, RealArray
from service.encoders.gltf.columns import Column, Columns, plain_columns
from service.engine.mesh.mesh import Mesh

EXTENSION = "KHR_mesh_quantization"

LARGEST, LARGEST_SIGNED = 65535, 32767


def quantized_columns(mesh: Mesh) -> Columns:
    """Every attribute of a mesh on a grid, in as few bits as do it."""
    columns = plain_columns(mesh)
    columns["POSITION"] = grid_positions(mesh.positions, mesh)
    if mesh.normals is not None:
        normals = np.rint(mesh.normals.astype(np.float64) * LARGEST_SIGNED)
        columns["NORMAL"] = Column(normals.astype("<i2"), normalized=True, unit=True)
    for name in ("TEXCOORD_0", "COLOR_0"):
        if name in columns:
            columns[name] = _shares(columns[name])
    return columns


def grid_positions(positions: RealArray, mesh: Mesh) -> Column:
    """Positions of the mesh or of its lines as steps from the corner of all of them."""
    steps = positions.astype(np.float64) / mesh.step - _corner(mesh)
    if len(steps) and not 0 <= steps.min() <= steps.max() <= LARGEST:
        raise ValueError("The grid has fewer steps than the mesh is long.")
    return Column(steps.astype("<u2"))


def grid_place(mesh: Mesh) -> dict[str, list[float]]:
    """What takes the integers of a mesh to where it is."""
    shift = mesh.origin + _corner(mesh) * mesh.step
    place = {"translation": shift.tolist()} if shift.any() else {}
    return place | {"scale": [mesh.step] * 3}


def _corner(mesh: Mesh) -> FloatArray:
    """The least of all positions, lines included, in steps from the origin."""
    every = [mesh.positions, *(overlay.positions for overlay in mesh.overlays)]
    lows = [rows.min(axis=0) for rows in every if len(rows)]
    corner: FloatArray = np.min(lows, axis=0).astype(np.float64) / mesh.step + 0.0
    return corner


def _shares(column: Column) -> Column:
    """Numbers from 0 to 1 as whole numbers; others as they are."""
    values = column.values
    if not len(values) or values.min() < 0 or values.max() > 1:
        return column
    whole: NDArray[np.uint16] = np.rint(values.astype(np.float64) * LARGEST).astype("<u2")
    return Column(whole, normalized=True)
