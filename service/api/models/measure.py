"""Answers about areas, volumes, centroids and borders as JSON."""

from typing import Annotated, Literal

from pydantic import Field

from service.api.models.meshes import Answer, Count, Length, Missing, Pair


class Interval(Answer):
    """A number, and an interval that provably holds the truth, rounding included."""

    value: float
    """About in the middle of the interval."""
    low: float
    """The truth is not less."""
    high: float
    """The truth is not greater."""


class EdgePlace(Answer):
    """A side of a patch."""

    surface: Count | Missing = None
    """Of a group: the number of the member."""
    patch: Count | Missing = None
    """The number of the patch, of a `multipatch` of the surface, in the order of the request. Left
    out of one surface with parameters of its own."""
    side: Literal["u=0", "u=1", "v=0", "v=1", "s=0", "r=0", "t=0"]
    """Which side it is; s, r, t are those of triangles."""
    uv: Annotated[list[Pair], Field(min_length=2, max_length=2)]
    """Parameters (u, v) at both ends, of the surface where it has a domain; of triangles (s, t)."""


class FaultyEdge(EdgePlace):
    """A side on an edge that keeps the surface from having a volume."""

    open: bool
    """Whether the side is alone on its edge. Else the patches that meet there do not pass along the
    edge as often in one direction as in the other: one of them is turned round, or there are too
    many."""


class Boundary(Answer):
    """An open border: edges one after another, with the surface on their left."""

    length: Interval
    """Its length."""
    edges: Annotated[int, Field(ge=1)]
    """How many edges it has."""
    closed: bool
    """Whether it returns to where it begins."""
    first_edge: EdgePlace
    """Its first edge."""


class PartMeasures(Answer):
    """A named part, or a member of a group."""

    name: str
    """Its name."""
    area: Interval
    """Its area."""
    volume: Interval | Missing = None
    """The volume that it encloses by itself, if it does."""
    centroid: Annotated[list[Interval], Field(min_length=3, max_length=3)] | Missing = None
    """The centroid of that volume, x, y, z."""


class SurfaceMeasures(Answer):
    """Measures of a surface, in the units of its control points."""

    area: Interval
    """The area of all patches."""
    volume: Interval | Missing = None
    """The volume that the patches enclose: positive where normals point outwards, and negative
    where they point inwards. Left out of surfaces that are open or not consistently oriented."""
    centroid: Annotated[list[Interval], Field(min_length=3, max_length=3)] | Missing = None
    """The centroid of that volume, x, y, z."""
    closed: bool
    """Whether every edge is passed as often in one direction as in the other."""
    boundary_length: Interval
    """The length of all open borders."""
    boundary_count: Count
    """How many open borders there are."""
    boundaries: list[Boundary]
    """The first 100 of them."""
    open_edges: Count
    """Sides that are alone on their edge."""
    inconsistent_edges: Count
    """Sides on other edges that keep the surface from having a volume."""
    faulty_edges: list[FaultyEdge]
    """The first 100 of both kinds."""
    parts: list[PartMeasures]
    """The parts, in their order, or the members of a group. No interval is wider than those of the
    whole may be."""
    reached: bool
    """Whether all intervals of the whole are at most `tolerance` wide. They are wider where
    rounding or the gaps that joining closed (`moved`) require it, and for quantities that reach no
    `tolerance` that a request may have, as a volume of zero."""
    moved: Length
    """The largest distance by which control points were moved so that borders meet; intervals have
    room for it."""
