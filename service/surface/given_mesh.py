"""A mesh that a client gives to be compared with a surface: triangles that anyone has made."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.surface.checks import MAX_COORDINATE


@dataclass(frozen=True, eq=False, slots=True)
class GivenMesh:
    """Triangles in the coordinates of the surface. Nothing is known of how they are connected.

    Attributes
    ----------
    positions : ndarray of float64, shape (n, 3)
        Finite, and within `MAX_COORDINATE`; the same position may occur several times.
    triangles : ndarray of int, shape (t, 3)
        Rows of `positions`; at least one triangle.
    normals : ndarray of float64, shape (n, 3), or None
        Finite vectors along the normals at the vertices, of any length; those that are 0 say
        nothing.

    Raises
    ------
    ValueError
        An array has another shape, or a value outside of these ranges: readers of meshes check
        what they read, and report it in the terms of their format.
    """

    positions: FloatArray
    triangles: Ints
    normals: FloatArray | None = None

    def __post_init__(self) -> None:
        count = len(self.positions)
        if self.positions.shape != (count, 3) or self.triangles.shape[1:] != (3,):
            raise ValueError("positions and triangles must have three columns")
        if not len(self.triangles) or not (np.abs(self.positions) <= MAX_COORDINATE).all():
            raise ValueError("a mesh needs triangles, and finite coordinates within float32")
        if self.triangles.min() < 0 or self.triangles.max() >= count:
            raise ValueError("each corner of a triangle must be a row of positions")
        if self.normals is not None:
            if self.normals.shape != (count, 3) or not np.isfinite(self.normals).all():
                raise ValueError("normals must be as many finite vectors as positions")
            self.normals.flags.writeable = False
        self.positions.flags.writeable = False
        self.triangles.flags.writeable = False

    @property
    def corners(self) -> FloatArray:
        """The corners (t, 3, 3) of the triangles."""
        return self.positions[self.triangles]
