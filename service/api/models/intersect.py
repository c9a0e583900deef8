"""Responses about rays that hit surfaces, as JSON."""

from typing import Literal

from service.api.models.meshes import Count, Length, Missing, Pair, ResponseModel, Vector
from service.api.models.points import Point


class RayHits(ResponseModel):
    """Hits in columns, float64: rows of the first two belong to rays, of the others to hits.

    Hits are in the order of rays, and along each ray.
    """

    reached: list[bool]
    """Of each ray: whether all of its hits, or its first one, are listed. False where the budget of
    work ended, as where a surface is a line along the ray, or where the ray comes from so far away
    that rounding is larger than the thickness."""
    counts: list[Count]
    """Of each ray: how many hits it has here."""
    ray: list[Count]
    """The number of the ray."""
    t: list[Length]
    """Where the hit is, origin + t · direction: in units of the direction as it was given. Of a
    segment, where it begins."""
    t_bounds: list[Pair]
    """Intervals [low, high] of t that hold all points of the surface on the ray for which this hit
    stands: this is proved, rounding included. Of a segment within the surface, the segment."""
    positions: list[Point]
    """Points of the surface there, nearer to the ray than the thickness."""
    patch: list[Count] | Missing = None
    """The number of the patch, in the order of the request, one of those that meet there; of a
    group, Bézier patches of one member follow those of the other. Left out where there is but one
    surface with parameters of its own."""
    uv: list[Pair]
    """Parameters (u, v) there, of the surface where it has a domain, else of the patch; on
    triangles the last two barycentric coordinates, (s, t)."""
    normals: list[Vector]
    """Unit normals along du × dv, or their limits."""
    kind: list[Literal["crossing", "touching", "along"]]
    """Whether the ray crosses the surface, touches it (it is tangent, or passes through an edge
    from one side of it), or goes along within it for a while."""
    entering: list[bool | None]
    """Of a crossing: whether the ray goes against the normal, into what the normals of a closed
    surface point out of."""
