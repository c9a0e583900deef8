"""Responses about areas, volumes, centroids and borders, as JSON."""

from typing import Annotated, Literal

from pydantic import Field

from service.api.models.meshes import Count, Length, Missing, Pair, ResponseModel


class Interval(ResponseModel):
    """An approximate number, and an interval that certainly contains the exact value."""

    value: float
    """An approximation, near the middle of the interval."""
    low: float
    """The exact value is not less than this."""
    high: float
    """The exact value is not greater than this."""


class EdgePlace(ResponseModel):
    """A side of a patch."""

    surface: Count | Missing = None
    """The index of the group's member. Only for groups."""
    patch: Count | Missing = None
    """The index of the patch, or in a `multipatch` the index of the surface, in the order of the
    request. Left out for a surface with one domain."""
    side: Literal["u=0", "u=1", "v=0", "v=1", "s=0", "r=0", "t=0"]
    """The side: u or v for rectangular patches, s, r or t for triangles."""
    uv: Annotated[list[Pair], Field(min_length=2, max_length=2)]
    """Parameters at both ends: (u, v) in the domain of the surface if it has one, else in the
    domain of the patch; (s, t) for triangles."""


class FaultyEdge(EdgePlace):
    """A side that is a reason why the surface encloses no volume."""

    open: bool
    """True if no other side shares the edge. False if the sides on the edge are not pairs of
    opposite directions: a patch has the wrong orientation, or more than two patches meet."""


class Boundary(ResponseModel):
    """An open border: a chain of edges, with the surface on their left."""

    length: Interval
    """Its length."""
    edges: Annotated[int, Field(ge=1)]
    """Number of its edges."""
    closed: bool
    """Whether the border ends where it begins."""
    first_edge: EdgePlace
    """Its first edge."""


class PartMeasures(ResponseModel):
    """A named part, or a member of a group."""

    name: str
    """Its name."""
    area: Interval
    """Its area."""
    volume: Interval | Missing = None
    """The volume that the part encloses. Left out if the part alone is not closed."""
    centroid: Annotated[list[Interval], Field(min_length=3, max_length=3)] | Missing = None
    """The centroid of that volume, x, y, z."""


class SurfaceMeasures(ResponseModel):
    """Measures of a surface, in the units of its control points."""

    area: Interval
    """The area of all patches."""
    volume: Interval | Missing = None
    """The volume that the patches enclose: positive where normals point outwards, and negative
    where they point inwards. Left out of surfaces that are open or not consistently oriented."""
    centroid: Annotated[list[Interval], Field(min_length=3, max_length=3)] | Missing = None
    """The centroid of that volume, x, y, z."""
    closed: bool
    """Whether the surface has no border and a consistent orientation: on every edge, as many sides
    run in one direction as in the other."""
    boundary_length: Interval
    """The length of all open borders."""
    boundary_count: Count
    """Number of open borders."""
    boundaries: list[Boundary]
    """The first 100 open borders."""
    open_edges: Count
    """Number of sides that share their edge with no other side."""
    inconsistent_edges: Count
    """Number of sides on shared edges whose sides are not pairs of opposite directions."""
    faulty_edges: list[FaultyEdge]
    """The first 100 of the open and the inconsistent sides."""
    parts: list[PartMeasures]
    """The parts in their order, or the members of a group. Their intervals are as exact as the
    whole surface needs: for a small part they may be wider than `tolerance`."""
    reached: bool
    """Whether all intervals of the whole surface are at most `tolerance` wide. They are wider where
    rounding or gaps that were closed (`moved`) require it, and for a quantity for which no allowed
    `tolerance` can be reached, such as a volume of zero."""
    moved: Length
    """The largest distance by which control points were moved so that borders meet. The intervals
    include the effect of this."""
