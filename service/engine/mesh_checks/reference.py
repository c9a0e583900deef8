"""The reference mesh: one of the service's own, with proved bounds, in place of the surface.

The distances of other meshes from the surface follow from those from the reference mesh, which are
distances between triangles: so all kinds of surfaces are compared in one way.
"""

from dataclasses import dataclass
from math import sqrt
from typing import Protocol

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.mesh.mesh import Mesh
from service.engine.mesh_checks.values import Limit
from service.engine.vectors import NEXT, UNIT, dot
from service.surface.brep_model import SkippedFace


class OutOfReach(Exception):
    """There is no reference mesh as fine; `limit` says why."""

    def __init__(self, limit: Limit) -> None:
        super().__init__(limit)
        self.limit = limit


@dataclass(frozen=True, eq=False, slots=True)
class ReferenceMesh:
    """A mesh R of a surface S.

    Attributes
    ----------
    positions : ndarray of float64, shape (V, 3)
        In the coordinates of the surface.
    triangles : ndarray of int, shape (T, 3)
    normals : ndarray of float64, shape (V, 3)
        Unit normals of the surface.
    deviation : float
        No point of S is further than this from R.
    mesh_deviation : float
        No point of R is further than this from S.
    is_coarse : bool
        Whether the mesher has not proved a bound, so that a coarse one is in its place.
    skipped_faces : tuple of SkippedFace
        Faces of breps that are not in the mesh: they do not count as part of S.
    """

    positions: FloatArray
    triangles: Ints
    normals: FloatArray
    deviation: float
    mesh_deviation: float
    is_coarse: bool
    skipped_faces: tuple[SkippedFace, ...] = ()

    @property
    def corners(self) -> FloatArray:
        """The corners (T, 3, 3) of the triangles."""
        return self.positions[self.triangles]


@dataclass(frozen=True, eq=False, slots=True)
class SurfacePlace:
    """The point of a surface that is nearest to a point.

    Attributes
    ----------
    position : ndarray of float64, shape (3,)
    error : float
        The surface has a point that is at most this far from `position`.
    low : float
        The surface is at least this far from the point.
    place : dict
        Where it is on the surface (`Deviation.place`).
    """

    position: FloatArray
    error: float
    low: float
    place: dict[str, object]


class ComparedSurface(Protocol):
    """A surface, as far as comparisons need it."""

    @property
    def diagonal(self) -> float:
        """The diagonal of a box that contains the surface."""
        ...

    @property
    def max_triangles(self) -> int:
        """The most triangles of a reference mesh."""
        ...

    def build_reference(self, tolerance: float) -> ReferenceMesh:
        """A reference mesh with this tolerance, in model units; raises `OutOfReach`."""
        ...

    def find_place(self, point: FloatArray) -> SurfacePlace | None:
        """The point of the surface nearest to a point; None for surfaces without parameters."""
        ...


def take_reference(mesh: Mesh, diagonal: float) -> ReferenceMesh:
    """A mesh by tolerance as a reference mesh.

    Where the mesher has no finite bound, the bounds are coarse: the surface and its mesh are in one
    box with this diagonal; and no point of a triangle is further than 1/√3 of its longest side from
    its nearest corner, which is a point of the surface, or of an edge of a brep.

    Proof in docs/proofs.md: "Distances from anyone's mesh".
    """
    report, triangles = mesh.report, mesh.triangles.astype(np.intp)
    positions = mesh.positions.astype(np.float64)
    assert mesh.normals is not None  # the options of reference meshes ask for them
    sides = positions[triangles][:, NEXT] - positions[triangles]
    from_corner = sqrt(float(dot(sides, sides, -1).max(initial=0.0)) / 3) * (1 + 16 * UNIT)
    if report.brep is not None:
        from_corner += report.brep.gap_bound + report.brep.longest_chain
    deviation, reverse = report.deviation_bound, report.mesh_deviation_bound
    return ReferenceMesh(
        positions,
        triangles,
        mesh.normals.astype(np.float64),
        diagonal if deviation is None else deviation,
        from_corner + report.moved if reverse is None else reverse,
        is_coarse=deviation is None or reverse is None,
        skipped_faces=() if report.brep is None else report.brep.skipped_faces,
    )
