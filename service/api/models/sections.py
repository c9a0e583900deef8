"""Responses about sections of surfaces, as JSON."""

from pydantic import RootModel

from service.api.models.intersect import RayHits
from service.api.models.meshes import Count, Length, ResponseModel, Vector


class SectionLine(ResponseModel):
    """A polyline of a section."""

    closed: bool
    """Whether it is closed; its last point is then its first."""
    points: list[Vector]
    """Points of the surface and of the plane, in model units. Seen from the tip of the plane's
    normal, the normals of the surface point to the right of the polyline."""


class Section(ResponseModel):
    """The section of a surface by one plane."""

    normal: Vector
    """Unit normal of the plane."""
    offset: float
    """Distance of the plane from zero, along the normal."""
    x_axis: Vector
    """Unit vector along x in the coordinates of the plane, which the SVG format uses."""
    y_axis: Vector
    """Unit vector along y in these coordinates: x × y is the normal."""
    polylines: list[SectionLine]
    """The polylines; empty where the plane does not cut the surface."""
    touching: list[Vector]
    """Points where the surface touches the plane, or is closer to it than rounding can resolve."""
    coplanar: list[Count]
    """Numbers of patches that lie in the plane, in the order of the request; the polylines are
    their border."""


class SectionReport(ResponseModel):
    """Facts about all sections."""

    planes: Count
    """Number of planes."""
    polylines: Count
    """Number of polylines."""
    points: Count
    """Number of their points."""
    deviation_bound: Length
    """In model units, proved: no point of a section is further than this from its polylines."""
    engine: int
    """Version of the numbers."""


class Sections(ResponseModel):
    """Sections of a surface by planes, in their order."""

    sections: list[Section]
    """The section by each plane."""
    report: SectionReport


class Intersections(RootModel[RayHits | Sections]):
    """Hits of rays, or sections by planes."""
