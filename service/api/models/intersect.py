"""Responses about rays that hit surfaces, as JSON."""

from typing import Literal

from service.api.models.meshes import Count, Length, Missing, Pair, ResponseModel, Vector
from service.api.models.points import Point


class RayHits(ResponseModel):
    """Hits in columns; the real numbers are float64.

    `reached` and `counts` have a row for each ray; the other columns have a row for each hit.

    Hits are sorted by ray, and for each ray by t. The thickness is the `relative_thickness` of the
    request times the diagonal of the bounding box of the control points.
    """

    reached: list[bool]
    """For each ray, whether its first hit is listed; with `hits` "all", whether all its hits are
    listed. False if the search reached its limit of work, for example because the surface is a line
    along the ray; or if the ray begins so far away that rounding is larger than the thickness."""
    counts: list[Count]
    """For each ray, the number of its hits in this response."""
    ray: list[Count]
    """The index of the ray."""
    t: list[Length]
    """The hit is at origin + t · direction, with the direction of the request. For a hit that is a
    segment, its beginning."""
    t_bounds: list[Pair]
    """Intervals [low, high] of t. Proved, rounding included: they contain all common points of the
    ray and the surface at this hit. For a segment within the surface, its ends."""
    positions: list[Point]
    """The points of the surface. They are closer to the ray than the thickness."""
    patch: list[Count] | Missing = None
    """The index of the patch, in the order of the request; where several patches meet, one of them.
    In a group, the Bézier patches of each member follow those of the member before. Left out for
    a surface with one domain."""
    uv: list[Pair]
    """Parameters (u, v), in the domain of the surface if it has one, else in the domain of the
    patch; for triangles the last two barycentric coordinates, (s, t)."""
    normals: list[Vector]
    """Unit normals in the direction of du × dv, or their limits at poles."""
    kind: list[Literal["crossing", "touching", "along"]]
    """Whether the ray crosses the surface, touches it (it is tangent, or meets an edge without
    crossing), or runs within it along a segment."""
    entering: list[bool | None]
    """For a crossing, whether the ray runs against the normal: into a closed surface whose normals
    point outwards. Null for the other kinds."""
