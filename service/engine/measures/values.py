"""Queries of measures, and their results."""

import sys
from dataclasses import dataclass
from math import inf, nextafter

from service.engine.measures.joined_surface import RequestSide
from service.engine.options import MeshOptions

TOLERANCE = 1e-6
"""The default relative width of intervals."""

MAX_TOLERANCE = 0.1
"""The largest tolerance that a query may ask for."""

WELD_TOLERANCE = MeshOptions().weld_tolerance
"""The default of `MeasureQuery.weld_tolerance`: that of meshes."""

BUDGET = 1 << 20
"""The most control points of the cells of one integral, which takes some seconds. A cell is a part
of a patch over a rectangle of its parameters (`service.engine.measures.cells`)."""

MIN_NORMAL = sys.float_info.min
"""The least normal float64. Below it, products with powers of two are rounded."""

MAX_LISTED = 100
"""The most edges and borders that a response lists."""


@dataclass(frozen=True, slots=True)
class MeasureQuery:
    """The width of the intervals, and the most work for a query.

    Attributes
    ----------
    tolerance : float
        Largest width of an interval, relative to the area, the length or the volume of the surface;
        for the centroid, relative to the diagonal of the box about the control points.
    weld_tolerance : float
        As in `MeshOptions`.
    budget : int
        The most control points of the cells of one integral; but at least three times those of the
        patches.
    is_trial : bool
        Whether to end with `BudgetEnded` as soon as a larger budget would change the result.
    """

    tolerance: float = TOLERANCE
    weld_tolerance: float = WELD_TOLERANCE
    budget: int = BUDGET
    is_trial: bool = False


class BudgetEnded(Exception):
    """A trial ended: its budget is too small for this surface and this tolerance."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A value, and two bounds that are proved to enclose the true value."""

    value: float
    low: float
    high: float

    @staticmethod
    def about(value: float, error: float, unit: float = 1.0) -> "Interval":
        """The interval [value − error, value + error], rounded outwards, times `unit`.

        `unit` is a power of two; or 0, if a small power of two underflowed.
        """
        interval = Interval(value, nextafter(value - error, -inf), nextafter(value + error, inf))
        return interval.times(unit)

    def times(self, unit: float) -> "Interval":
        """The interval times a power of two, or 0, rounded outward if the result underflows."""
        low, high = self.low * unit, self.high * unit
        if abs(low) < MIN_NORMAL and self.low:
            low = nextafter(low, -inf)
        if abs(high) < MIN_NORMAL and self.high:
            high = nextafter(high, inf)
        return Interval(self.value * unit, low, high)

    def without_negatives(self) -> "Interval":
        """The part of the interval that is not below 0."""
        return Interval(self.value, max(self.low, 0.0), self.high)

    def is_within(self, width: float) -> bool:
        """Whether the interval is at most `width` wide."""
        return self.high - self.low <= width


@dataclass(frozen=True, slots=True)
class PartMeasures:
    """The measures of one part; an open part has neither volume nor centroid."""

    name: str
    area: Interval
    volume: Interval | None
    centroid: tuple[Interval, ...] | None


@dataclass(frozen=True, slots=True)
class Boundary:
    """An open border: its length, its number of edges, whether it is a loop, and its first edge."""

    length: Interval
    edges: int
    closed: bool
    first: RequestSide


@dataclass(frozen=True, slots=True)
class FaultyEdge:
    """A side whose edge is open or not balanced.

    An edge is balanced if as many sides pass along it in one direction as in the other
    (`service.engine.connectivity.orientation`).

    A surface with such sides has no volume.
    """

    is_open: bool
    request_side: RequestSide


@dataclass(frozen=True, slots=True)
class Measures:
    """The measures of a surface.

    Attributes
    ----------
    area, volume, centroid
        The measures of all patches together; volume and centroid are None if the surface is not
        closed.
    closed : bool
        Whether every edge is balanced (`service.engine.connectivity.orientation`).
    boundary_length : Interval
        Of all open borders.
    boundary_count : int
    boundaries : tuple of Boundary
        The first `MAX_LISTED` open borders.
    open_edges : int
        Number of sides that are alone on their edges.
    inconsistent_edges : int
        Number of sides on edges of several sides that are not balanced.
    faulty_edges : tuple of FaultyEdge
        The first `MAX_LISTED` of the sides that `open_edges` and `inconsistent_edges` count.
    parts : tuple of PartMeasures
    reached : bool
        Whether the intervals of area, volume, centroid and border length of the whole surface are
        as narrow as the query demands; those of parts may be wider.
    moved : float
        An upper bound of the distance by which joining moved any point, in model units.
    """

    area: Interval
    volume: Interval | None
    centroid: tuple[Interval, ...] | None
    closed: bool
    boundary_length: Interval
    boundary_count: int
    boundaries: tuple[Boundary, ...]
    open_edges: int
    inconsistent_edges: int
    faulty_edges: tuple[FaultyEdge, ...]
    parts: tuple[PartMeasures, ...]
    reached: bool
    moved: float
