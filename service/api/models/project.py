"""Responses about the closest points of surfaces and curves, as JSON."""

from service.api.models.meshes import Count, Length, Missing, Pair, ResponseModel, Vector
from service.api.models.points import Point


class ClosestPoints(ResponseModel):
    """Closest points in columns, float64, a row for every point asked for."""

    positions: list[Point]
    """The closest points."""
    distances: list[Length]
    """How far they are."""
    distance_bounds: list[Pair]
    """Intervals [low, high] that hold the least distance of the whole surface or curve: this is
    proved, rounding included."""
    reached: list[bool]
    """Whether the interval is as narrow as asked. It is wider where too many places are almost as
    near, as they are seen from the centre of a sphere."""
    tied: list[bool]
    """Whether another place, farther than about 1/1000 of the diagonal from this one, may be as
    near: within 1/16 of the tolerance, or as far as the interval tells."""
    patch: list[Count] | Missing = None
    """Of a surface: the number of the patch, in the order of the request, of several that meet
    there the first; of a group, Bézier patches of one member follow those of the other. Left out
    where there is but one surface with parameters of its own."""
    uv: list[Pair] | Missing = None
    """Of a surface: parameters (u, v) there, of the surface where it has a domain, else of the
    patch; on triangles the last two barycentric coordinates, (s, t)."""
    normals: list[Vector] | Missing = None
    """Of a surface: unit normals along du × dv, or their limits."""
    on_boundary: list[bool] | Missing = None
    """Of a surface: whether the place is on an edge that belongs to one patch alone."""
    signs: list[float | None] | Missing = None
    """Of a surface, where `sign` asks: -1 inside, 1 outside, so that sign times distance is the
    signed distance. A point is inside where the surface winds round it, whichever way the normals
    point; this is proved, by winding numbers. Null where it is not known: on the surface or almost,
    where the work of a request is used up, as it may be by some 10,000 points close to the surface,
    and everywhere if the surface is open, or its patches do not agree about what is outside."""
    parameters: list[float] | Missing = None
    """Of a curve: parameters in its domain."""
    tangents: list[Point] | Missing = None
    """Of a curve: unit tangents."""
