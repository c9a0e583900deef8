"""From the coordinates of glTF back to those of a surface: metres with y up to its own.

A glTF file that this service writes has a root node with a factor, the metres of a unit, and for a
surface with z up a rotation from z up to y up (`service.encoders.gltf.document`). So does a file
that is to be compared with such a surface.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.checks import Up
from service.surface.given_mesh import GivenMesh


def undo_root(mesh: GivenMesh, up: Up, metres_per_unit: float | None) -> GivenMesh:
    """A mesh in the coordinates of glTF as one in those of a surface.

    Parameters
    ----------
    mesh : GivenMesh
    up : "y" or "z"
        The vertical axis of the surface.
    metres_per_unit : float or None
        The unit of the surface's coordinates; None if it has none.
    """
    positions = _turn_back(mesh.positions, up)
    if metres_per_unit not in (None, 1):
        positions = positions / metres_per_unit
    normals = None if mesh.normals is None else _turn_back(mesh.normals, up)
    return replace(mesh, positions=positions, normals=normals)


def _turn_back(vectors: FloatArray, up: Up) -> FloatArray:
    """Vectors (n, 3) with y up, (x, z, −y), as (x, y, z)."""
    if up == "y":
        return vectors
    turned = vectors[:, [0, 2, 1]]
    np.subtract(0.0, turned[:, 1], out=turned[:, 1])  # never −0.0
    return turned
