"""A mesh that a client gives to be compared with a surface: triangles that anyone has made."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.surface.checks import MAX_COORDINATE

QuadDiagonal: TypeAlias = Literal["02", "13"]
"""The corners that are joined where a face of the corners 0, 1, 2, 3 becomes two triangles."""

NO_CORNER = int(np.iinfo(np.int64).min)
"""The fourth corner of a triangle in an array of faces of which some have four corners: no index
of a request is as small."""

VERTICES_PER_TRIANGLE = 3
"""A mesh may have as many triangles as a surface has control points, and this many vertices for
each: in files such as STL no two triangles share a vertex."""

_HALVES: dict[QuadDiagonal, tuple[list[int], list[int]]] = {
    "02": ([0, 1, 2], [0, 2, 3]),
    "13": ([0, 1, 3], [1, 2, 3]),
}


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
                raise ValueError("normals must be one finite vector for each position")
            self.normals.flags.writeable = False
        self.positions.flags.writeable = False
        self.triangles.flags.writeable = False

    @property
    def corners(self) -> FloatArray:
        """The corners (t, 3, 3) of the triangles."""
        return self.positions[self.triangles]


def divide_faces(faces: Ints, diagonal: QuadDiagonal) -> Ints:
    """The triangles (t, 3) of faces with three or four corners, in the order of the faces.

    With the diagonal "02" a face a, b, c, d becomes a, b, c and a, c, d; with "13" it becomes
    a, b, d and b, c, d.

    Parameters
    ----------
    faces : ndarray of int, shape (f, 3) or (f, 4)
        If there are four columns, the last corner of a triangle is `NO_CORNER`.
    diagonal : "02" or "13"
    """
    if faces.shape[1] == 3:
        return faces
    is_quad = faces[:, 3] != NO_CORNER
    counts = 1 + is_quad.astype(np.intp)
    ends = np.cumsum(counts)
    triangles = np.empty((len(faces) + int(is_quad.sum()), 3), np.intp)
    triangles[(ends - counts)[~is_quad]] = faces[~is_quad, :3]
    quads, firsts = faces[is_quad], (ends - counts)[is_quad]
    for place, corners in enumerate(_HALVES[diagonal]):
        triangles[firsts + place] = quads[:, corners]
    return triangles
