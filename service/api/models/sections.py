"""Responses about sections of surfaces, as JSON."""

from pydantic import RootModel

from service.api.models.intersect import RayHits
from service.api.models.meshes import Count, Length, ResponseModel, Vector


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
    """Indices of the patches that lie in the plane, in the order of the request; their border is
    part of the polylines."""


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
    engine: int
    """Version of the engine: equal requests give equal numbers while it is the same."""


class Sections(ResponseModel):
    """Sections of a surface by planes, in their order."""

    sections: list[Section]
    """The section by each plane."""
    report: SectionReport


class Intersections(RootModel[RayHits | Sections]):
    """Hits of rays, or sections by planes."""
