"""Responses to queries, as JSON: closest points, hits of rays, sections, and measures."""

from typing import Annotated, Literal

from pydantic import Field, RootModel

from service.api.models.meshes import Count, Length, Missing, Pair, ResponseModel, Vector
from service.api.models.points import Point


class LeftOutFace(ResponseModel):
    """A face of a brep that took no part in the answer, because it is invalid."""

    patch: Count
    """Number of the face in the request, as `patch`; in a group, in the first copy of its brep."""
    code: str
    """The code of the error that would refuse the brep."""
    got: str
    """A description of the face, with figures."""
    needed: str
    """A description of a valid face."""


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
    """For a surface: the index of the patch, or of the face of a brep, in the order of the request;
    where several patches meet, the first of them. In a group, the Bézier patches and faces of each
    member follow those of the member before. Left out for a surface with one domain."""
    uv: list[Pair] | Missing = None
    """For a surface: parameters (u, v), in the domain of the surface if it has one, else in the
    domain of the patch; for triangles the last two barycentric coordinates, (s, t). For a brep:
    parameters of the surface of the face."""
    normals: list[Vector] | Missing = None
    """For a surface: unit normals in the direction of du × dv, or their limits at poles; on a face
    of a brep that is `reversed`, in the opposite direction."""
    on_boundary: list[bool] | Missing = None
    """For a surface: whether the closest point is on an edge of only one patch or face."""
    near_edge: list[bool] | Missing = None
    """For a brep, or a group with one: whether the closest point is on an edge of a face, or nearer
    to one than the proved gap between this edge and the surface of the face."""
    signs: list[float | None] | Missing = None
    """For a surface, with `sign`; proved: -1 inside, 1 outside, so that sign times distance is the
    signed distance. A point is inside if the winding number of the surface about the point is not
    0; the direction of the normals does not matter. Null if the sign is unknown: on the surface or
    very close to it; after the limit of work, which some 10,000 points close to the surface may
    reach; and for all points if the surface is open or inconsistently oriented. Breps are closed if
    all their shells are, and no face is left out. A point is then inside if it is in a solid and
    not in a void; outside only if all members of a group are closed. Null nearer to an edge than
    its gap."""
    parameters: list[float] | Missing = None
    """For a curve: parameters in its domain."""
    tangents: list[Point] | Missing = None
    """For a curve: unit tangents."""
    skipped_faces: list[LeftOutFace] | Missing = None
    """For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
    are none."""


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
    """The index of the patch, or of the face of a brep, in the order of the request; where several
    patches meet, one of them. In a group, the Bézier patches and faces of each member follow those
    of the member before. Left out for a surface with one domain."""
    uv: list[Pair]
    """Parameters (u, v), in the domain of the surface if it has one, else in the domain of the
    patch; for triangles the last two barycentric coordinates, (s, t). For a brep: parameters of the
    surface of the face."""
    normals: list[Vector]
    """Unit normals in the direction of du × dv, or their limits at poles; on a face of a brep that
    is `reversed`, in the opposite direction."""
    kind: list[Literal["crossing", "touching", "along"]]
    """Whether the ray crosses the surface, touches it (it is tangent, or meets an edge without
    crossing), or runs within it along a segment."""
    entering: list[bool | None]
    """For a crossing, whether the ray runs against the normal: into a closed surface whose normals
    point outwards. Null for the other kinds."""
    near_edge: list[bool] | Missing = None
    """For a brep, or a group with one: whether the ray is nearer to an edge of a face than the
    thickness and the proved gap between this edge and the surface, together. Such a hit counts once
    for all faces that meet there, and a ray through a gap between two faces has one, too."""
    skipped_faces: list[LeftOutFace] | Missing = None
    """For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
    are none."""


class SectionLine(ResponseModel):
    """A polyline of a section."""

    closed: bool
    """Whether the polyline is closed; its last point is then equal to its first."""
    points: list[Vector]
    """Points of the surface and of the plane, in model units. Seen from the tip of the plane's
    normal, the normals of the surface point to the right of the polyline."""


class Section(ResponseModel):
    """The section of a surface by one plane."""

    normal: Vector
    """Unit normal of the plane."""
    offset: float
    """Signed distance of the plane from the origin, along the normal."""
    x_axis: Vector
    """Unit vector along x in the coordinates of the plane, which the SVG format uses."""
    y_axis: Vector
    """Unit vector along y in the coordinates of the plane: x × y is the normal."""
    polylines: list[SectionLine]
    """The polylines; empty where the plane does not cut the surface."""
    touching: list[Vector]
    """Points where the surface touches the plane, or is closer to it than rounding can resolve."""
    coplanar: list[Count]
    """Indices of the patches that lie in the plane, or of faces of a brep, in the order of the
    request; their border is part of the polylines."""


class SectionReport(ResponseModel):
    """Facts about all sections."""

    planes: Count
    """Number of planes."""
    polylines: Count
    """Number of polylines."""
    points: Count
    """Number of points of all polylines."""
    deviation_bound: Length
    """Proved, in model units: no point of a section is further than this from its polylines."""
    skipped_faces: list[LeftOutFace] | Missing = None
    """For a brep with `"invalid_faces": "skip"`: invalid faces that took no part; left out if there
    are none."""
    engine: int
    """Version of the engine: equal requests give equal numbers while it is the same."""


class Sections(ResponseModel):
    """Sections of a surface by planes, in their order."""

    sections: list[Section]
    """The section by each plane."""
    report: SectionReport


class Intersections(RootModel[RayHits | Sections]):
    """Hits of rays, or sections by planes."""


class Interval(ResponseModel):
    """An approximate number, and an interval that certainly contains the exact value."""

    value: float
    """An approximation, near the middle of the interval."""
    low: float
    """The exact value is not less than this."""
    high: float
    """The exact value is not greater than this."""


class EdgePlace(ResponseModel):
    """A side of a patch; or an edge, as a face of a brep uses it."""

    surface: Count | Missing = None
    """The index of the group's member. Only for sides of patches in groups."""
    patch: Count | Missing = None
    """The index of the patch, or in a `multipatch` the index of the surface, in the order of the
    request; left out for a surface with one domain. With `edge` it is the index of the face, and in
    groups the faces and patches of all members are counted one after the other."""
    side: Literal["u=0", "u=1", "v=0", "v=1", "s=0", "r=0", "t=0"] | Missing = None
    """The side: u or v for rectangular patches, s, r or t for triangles."""
    uv: Annotated[list[Pair], Field(min_length=2, max_length=2)] | Missing = None
    """Parameters at both ends of a side: (u, v) in the domain of the surface if it has one, else in
    the domain of the patch; (s, t) for triangles."""
    edge: Count | Missing = None
    """The index of an edge in `edge_lengths`. Left out for borders that are given by parameter
    curves alone."""


class FaultyEdge(EdgePlace):
    """A side that is a reason why the surface encloses no volume."""

    open: bool
    """True if no other side shares the edge. False if the sides on the edge are not pairs of
    opposite directions: a patch has the wrong orientation, or more than two patches meet."""


class Boundary(ResponseModel):
    """An open border: a chain of edges, with the surface on their left.

    Where neighbouring patches do not agree about their sides, the chain goes on all the same.
    """

    length: Interval
    """Its length."""
    edges: Annotated[int, Field(ge=1)]
    """Number of its edges."""
    closed: bool
    """Whether the border ends where it begins."""
    first_edge: EdgePlace
    """Its first edge."""


class PartMeasures(ResponseModel):
    """A named part, a member of a group, or a shell of a brep with several shells."""

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
    rounding or gaps that were closed (`moved`) require it, where a quantity takes more work than
    one request may take, and for a volume of zero."""
    moved: Length
    """The largest distance by which control points were moved so that borders meet. The intervals
    include the effect of this."""
    edge_lengths: list[Interval] | Missing = None
    """The lengths of the edges of breps, member after member: the first 100,000. This and the next
    fields are only for breps, and groups with breps, whose areas are those of faces as parameter
    curves trim them."""
    gap_bound: Length | Missing = None
    """Proved: no point of an edge is further than this from the border of a face. The interval of
    the volume includes all ways to close the gaps between faces within this distance of edges."""
    skipped_faces: list[LeftOutFace] | Missing = None
    """Invalid faces that were left out, with `"invalid_faces": "skip"`, if there are any. A brep
    with such faces is not closed."""
