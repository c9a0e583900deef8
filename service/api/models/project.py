"""Responses about the closest points of surfaces and curves, as JSON."""

from service.api.models.meshes import Count, Length, Missing, Pair, ResponseModel, Vector
from service.api.models.points import Point


class ClosestPoints(ResponseModel):
    """Closest points in columns, float64: row k belongs to point k of the request."""

    positions: list[Point]
    """The closest points."""
    distances: list[Length]
    """Distances from the points of the request."""
    distance_bounds: list[Pair]
    """Intervals [low, high] that contain the exact least distance to the surface or curve. Proved,
    rounding included."""
    reached: list[bool]
    """Whether the interval of distance meets `relative_tolerance`. The interval is wider if too
    many places are almost equally near, as for the centre of a sphere."""
    tied: list[bool]
    """Whether another place may be as near as this place, or further by at most 1/16 of
    `relative_tolerance`; if `reached` is false, the search could not rule out all such places.
    Places nearer to this place than about 1/1000 of the bounding box's diagonal do not count."""
    patch: list[Count] | Missing = None
    """For a surface: the index of the patch, in the order of the request; where several patches
    meet, the first of them. In a group, the Bézier patches of each member follow those of the
    member before. Left out for a surface with one domain."""
    uv: list[Pair] | Missing = None
    """For a surface: parameters (u, v), in the domain of the surface if it has one, else in the
    domain of the patch; for triangles the last two barycentric coordinates, (s, t)."""
    normals: list[Vector] | Missing = None
    """For a surface: unit normals in the direction of du × dv, or their limits at poles."""
    on_boundary: list[bool] | Missing = None
    """For a surface: whether the closest point is on an edge of only one patch."""
    signs: list[float | None] | Missing = None
    """For a surface, with `sign`; proved: -1 inside, 1 outside, so that sign times distance is the
    signed distance. A point is inside if the winding number of the surface about the point is not
    0; the direction of the normals does not matter. Null if the sign is unknown: on the surface or
    very close to it; after the limit of work, which some 10,000 points close to the surface may
    reach; and for all points if the surface is open or inconsistently oriented."""
    parameters: list[float] | Missing = None
    """For a curve: parameters in its domain."""
    tangents: list[Point] | Missing = None
    """For a curve: unit tangents."""
