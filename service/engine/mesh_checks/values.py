"""The result of a comparison of a mesh with a surface."""

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from service.bases.arrays import FloatArray
from service.surface.brep_model import SkippedFace

Limit: TypeAlias = Literal["work", "rounding", "thin"]
"""The reason why an interval is not narrower: the limits of work; rounding; or that the mesher has
proved no bound from its mesh to the surface, as for parts that are thinner than the tolerance."""


@dataclass(frozen=True, eq=False, slots=True)
class Deviation:
    """The largest distance from a point of a surface or mesh to the other of the two.

    Attributes
    ----------
    low, high : float
        Model units: an interval that contains it.
    point : ndarray of float64, shape (3,)
        A point that is nearly as far away, of the surface or mesh from which distances are
        measured.
    triangle : int
        The triangle of the mesh on which the point is, or that is nearest to it.
    place : dict
        The place on the surface of the point, or of the point nearest to it: `uv`, and `patch` if
        the surface has several; empty for surfaces without parameters.
    """

    low: float
    high: float
    point: FloatArray
    triangle: int
    place: dict[str, object] = field(default_factory=dict)

    def is_narrow(self, relative: float, absolute: float) -> bool:
        """Whether the interval is at most as wide as a share of its upper end, or as a length."""
        return self.high - self.low <= max(relative * self.high, absolute)


@dataclass(frozen=True, eq=False, slots=True)
class Comparison:
    """The distances between a surface and a mesh, and the angle between their normals.

    Attributes
    ----------
    surface_to_mesh, mesh_to_surface : Deviation
    limit : str or None
        Why an interval is wider than requested; None if both are narrow.
    angle : float or None
        Radians. The largest angle, at the middles of triangles, between the normal of the surface
        and that of the triangle, or the mean of the normals at its corners. None if all triangles
        are degenerate. It is measured, and not proved.
    angle_triangle : int or None
        The triangle with this angle.
    distances : ndarray of float64, shape (n,), or None
        If requested, the distance of each vertex of the mesh from the last reference mesh.
    middle_distances : ndarray of float64, shape (t,), or None
        Likewise of the middle of each triangle: the mean of its corners.
    skipped_faces : tuple of SkippedFace
        Faces of breps that took no part.
    """

    surface_to_mesh: Deviation
    mesh_to_surface: Deviation
    limit: Limit | None
    angle: float | None
    angle_triangle: int | None
    distances: FloatArray | None
    middle_distances: FloatArray | None
    skipped_faces: tuple[SkippedFace, ...] = ()
