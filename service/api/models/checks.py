"""The response to a check of a mesh, as JSON."""

from math import pi
from typing import Annotated, Literal

from pydantic import Field

from service.api.models.meshes import (
    Count,
    Length,
    Missing,
    Pair,
    ResponseModel,
    Vector,
    schema_of_row,
)
from service.api.models.queries import LeftOutFace

Triangle = Annotated[tuple[int, int, int], schema_of_row({"type": "integer", "minimum": 0}, 3)]


class Deviation(ResponseModel):
    """An interval that contains the largest distance from one shape to the other, and a place.

    `low` and `high` are proved, rounding included, in the units of the control points.
    """

    low: Length
    """The largest distance is at least this."""
    high: Length
    """No point is further away than this."""
    point: Vector
    """A point [x, y, z] of the one shape that is nearly so far from the other: for
    `surface_to_mesh` of the surface, for `mesh_to_surface` of the mesh."""
    patch: Count | Missing = None
    """The patch of the surface, or the face of a brep, on which `point` is, or to which it is
    nearest; in the order of the request. In a group, the Bézier patches and faces of each member
    follow those of the member before. Left out for a surface with one domain."""
    uv: Pair | Missing = None
    """The parameters (u, v) of that place, in the domain of the surface if it has one, else in the
    domain of the patch; for triangles the last two barycentric coordinates, (s, t). Left out for
    ribbons, and tubes that are not exact, which have no parameters."""
    triangle: Count
    """A triangle of the mesh, counted from 0 after faces of four corners were divided: for
    `surface_to_mesh` the one that is nearest to `point`, for `mesh_to_surface` the one that `point`
    is on."""


class CheckedMesh(ResponseModel):
    """A mesh as it was read, in the coordinates of the surface."""

    vertices: list[Vector]
    """Positions [x, y, z]."""
    faces: list[Triangle]
    """For each triangle the numbers of its vertices, from 0."""


class MeshCheck(ResponseModel):
    """How far a mesh and its surface are apart, and the faults of the mesh itself.

    Two vertices at the same position count as one where edges are counted, because many files have
    a vertex for each corner of each triangle.
    """

    surface_to_mesh: Deviation
    """The largest distance from a point of the surface to the mesh: large where the mesh has a hole
    or leaves something out."""
    mesh_to_surface: Deviation
    """The largest distance from a point of the mesh to the surface: large where the mesh has
    something that the surface does not have."""
    open_edges: Count
    """Edges of one triangle only. A mesh of a closed surface has none, unless it has cracks or
    holes."""
    non_manifold_edges: Count
    """Edges of three or more triangles."""
    flipped_edges: Count
    """Edges of two triangles that run along it in the same direction: one of the two is turned
    over."""
    degenerate_faces: Count
    """Triangles without area, up to rounding."""
    max_normal_angle: Annotated[float, Field(ge=0, le=pi)] | Missing = None
    """The largest angle, in radians, between a normal of the mesh and that of the surface nearby:
    of the triangles, at their middles, and there also the mean of the vertex normals that the mesh
    has. Measured, not proved. Left out if all triangles are degenerate."""
    max_normal_angle_triangle: Count | Missing = None
    """The triangle with that angle."""
    reached: bool
    """Whether both intervals are as narrow as `relative_tolerance` says."""
    limit: Literal["work", "rounding", "thin"] | Missing = None
    """Only if `reached` is false, why: narrower intervals would take more `work` than this service
    gives a request; the deviation is so small that `rounding` decides; or the surface has a part so
    `thin` that no closer bound is proved."""
    vertices: Count
    """Number of vertices of the mesh, as it was read."""
    triangles: Count
    """Number of its triangles, after faces of four corners were divided."""
    skipped_faces: list[LeftOutFace] | Missing = None
    """For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
    are none."""
    mesh: CheckedMesh | Missing = None
    """With `distances`: the mesh as it was read."""
    distances: list[Length] | Missing = None
    """With `distances`: for each vertex of `mesh` its distance from the surface, right to the width
    of the interval of `mesh_to_surface`."""
    middle_distances: list[Length] | Missing = None
    """With `distances`: for each triangle of `mesh` the distance of its middle, the mean of its
    corners. Most meshes have their vertices on the surface, and are furthest from it in between."""
