"""From the coordinates of glTF back to those of a surface: metres with y up to its own.

A glTF file that this service writes has a root node with a factor, the metres of a unit, and for a
surface with z up a rotation from z up to y up (`service.encoders.gltf.document`). So does a file
that is to be compared with such a surface.
"""

from dataclasses import replace

import numpy as np

from service.bases.arrays import FloatArray
from service.errors import InvalidRequest, Issue, format_number
from service.surface.checks import MAX_COORDINATE, Up
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

    Raises
    ------
    InvalidRequest
        `coordinate_too_large` in the unit of the surface.
    """
    positions = _turn_back(mesh.positions, up)
    if metres_per_unit not in (None, 1):
        positions = positions / metres_per_unit
        check_range(positions)
    normals = None if mesh.normals is None else _turn_back(mesh.normals, up)
    return replace(mesh, positions=positions, normals=normals)


def _turn_back(vectors: FloatArray, up: Up) -> FloatArray:
    """Vectors (n, 3) with y up, (x, z, −y), as (x, y, z)."""
    if up == "y":
        return vectors
    turned = vectors[:, [0, 2, 1]]
    np.subtract(0.0, turned[:, 1], out=turned[:, 1])  # never −0.0
    return turned


def check_range(positions: FloatArray) -> None:
    """Refuse positions that are not finite, or beyond single precision."""
    message = "Every coordinate must be finite, and within single precision."
    if not np.isfinite(positions).all():
        got = "NaN, Infinity or a number beyond double precision"
        raise InvalidRequest(Issue("not_finite", message, "", got, "a finite number"))
    largest = float(np.abs(positions).max(initial=0.0))
    if largest > MAX_COORDINATE:
        got, needed = format_number(largest), f"at most {MAX_COORDINATE:.7g}"
        raise InvalidRequest(Issue("coordinate_too_large", message, "", got, needed))
