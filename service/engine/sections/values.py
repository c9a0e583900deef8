"""Sections of a surface by planes, as polylines."""

from dataclasses import dataclass

from service.bases.arrays import FloatArray, Ints
from service.engine.curves.polyline import Polyline
from service.engine.sections.planes import Planes
from service.surface.checks import Up


@dataclass(frozen=True, eq=False, slots=True)
class Section:
    """The section by one plane.

    Attributes
    ----------
    polylines : tuple of Polyline
        Seen from the tip of the plane's normal, the normals of the surface point to the right of a
        polyline. So the polylines around a body run counter-clockwise.
    touching : ndarray of float64, shape (k, 3)
        Points where the surface touches the plane, up to rounding.
    coplanar : ndarray of int, shape (c,)
        Numbers of the patches that lie in the plane; polylines run along their border.
    """

    polylines: tuple[Polyline, ...]
    touching: FloatArray
    coplanar: Ints


@dataclass(frozen=True, eq=False, slots=True)
class Sections:
    """The sections of a surface by some planes, in the order of the planes.

    No point of a section is farther than `deviation_bound`, in model units, from its polylines.
    """

    name: str
    up: Up
    planes: Planes
    sections: tuple[Section, ...]
    deviation_bound: float

    @property
    def polylines(self) -> list[Polyline]:
        """The polylines of all sections."""
        return [line for section in self.sections for line in section.polylines]

    @property
    def point_count(self) -> int:
        """The number of points of all polylines."""
        return sum(len(line.points) for line in self.polylines)
