"""Queries of measures, and their results."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import fsum, inf, nextafter
from typing import Generic, TypeVar

from service.engine.measures.joined_surface import RequestSide
from service.engine.options import MeshOptions
from service.surface.brep_model import SkippedFace

TOLERANCE = 1e-6
"""The default relative width of intervals."""

MAX_TOLERANCE = 0.1
"""The largest tolerance that a query may ask for."""

WELD_TOLERANCE = MeshOptions().weld_tolerance
"""The default of `MeasureQuery.weld_tolerance`: that of meshes."""

BUDGET = 1 << 20
"""The most control points of the cells of one integral, which takes some seconds. A cell is a part
of a patch over a rectangle of its parameters (`service.engine.measures.cells`)."""

EDGE_BUDGET = 1 << 16
"""The most control points of the cells of the edges of parts. The length of an edge is costly where
its curve turns back."""

MIN_NORMAL = sys.float_info.min
"""The least normal float64. Below it, products with powers of two are rounded."""

MAX_LISTED = 100
"""The most edges and borders that a response lists."""


MAX_EDGES = 100_000
"""The most lengths of edges that a response lists."""


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
    budget, edge_budget : int
        The most control points of the cells of one integral, and of the edges of a part; but at
        least three times those of the patches.
    is_trial : bool
        Whether to end with `BudgetEnded` as soon as a larger budget would change the result.
    """

    tolerance: float = TOLERANCE
    weld_tolerance: float = WELD_TOLERANCE
    budget: int = BUDGET
    edge_budget: int = EDGE_BUDGET
    is_trial: bool = False

    def with_share(self, share: float) -> "MeasureQuery":
        """The query with a share of the budgets: for one of several bodies."""
        budgets = int(self.budget * share), int(self.edge_budget * share)
        return replace(self, budget=budgets[0], edge_budget=budgets[1])

    def of_edges(self) -> "MeasureQuery":
        """The query for the lengths of edges, which are the same in every trial."""
        return replace(self, budget=self.edge_budget, is_trial=False)


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

    @staticmethod
    def total(intervals: Sequence["Interval"]) -> "Interval":
        """The sum of intervals, rounded outwards."""
        if len(intervals) == 1:
            return intervals[0]
        low, high = fsum(each.low for each in intervals), fsum(each.high for each in intervals)
        value = fsum(each.value for each in intervals)
        # A sum that is 0 is not rounded.
        return Interval(value, low and nextafter(low, -inf), high and nextafter(high, inf))

    def plus(self, number: float) -> "Interval":
        """The interval moved by a number, rounded outwards."""
        low, high = nextafter(self.low + number, -inf), nextafter(self.high + number, inf)
        return Interval(self.value + number, low, high)

    def product(self, other: "Interval") -> "Interval":
        """The interval of all products of numbers of two intervals, rounded outwards."""
        if self.low == self.high == 0 or other.low == other.high == 0:
            return Interval(0.0, 0.0, 0.0)
        ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
        low, high = nextafter(min(ends), -inf), nextafter(max(ends), inf)
        return Interval(self.value * other.value, low, high)

    def inverse(self) -> "Interval | None":
        """The interval of 1 / x, rounded outwards; None if 0 is in the interval."""
        if self.low <= 0 <= self.high:
            return None
        low, high = nextafter(1 / self.high, -inf), nextafter(1 / self.low, inf)
        return Interval(1 / self.value, low, high)

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
class FaceEdge:
    """An edge as a face of a brep uses it.

    Attributes
    ----------
    patch : int
        The number of the face in the request.
    edge : int or None
        The number of the edge in `Measures.edge_lengths`; None for borders that are given by
        parameter curves, and for the natural borders of surfaces.
    """

    patch: int
    edge: int | None


Place_co = TypeVar("Place_co", bound=RequestSide | FaceEdge, covariant=True)
"""Where an edge is in the request: a side of a patch, or an edge of a face."""


@dataclass(frozen=True, slots=True)
class Boundary(Generic[Place_co]):
    """An open border: its length, its number of edges, whether it is a loop, and its first edge."""

    length: Interval
    edges: int
    closed: bool
    first: Place_co


@dataclass(frozen=True, slots=True)
class FaultyEdge(Generic[Place_co]):
    """A side, or an edge of a face, that is open or not balanced.

    An edge is balanced if as many sides pass along it in one direction as in the other
    (`service.engine.connectivity.orientation`).

    A surface with such sides has no volume.
    """

    is_open: bool
    request_side: Place_co


@dataclass(frozen=True, slots=True)
class Measures(Generic[Place_co]):
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
    edge_lengths : tuple of Interval, or None
        For parts: of the edges of all breps, member after member; the first `MAX_EDGES`.
    gap_bound : float or None
        For parts: no border of a face is further than this from its edge. Model units.
    skipped_faces : tuple of SkippedFace, or None
        For parts: the faces that are left out, by their numbers in the request.
    """

    area: Interval
    volume: Interval | None
    centroid: tuple[Interval, ...] | None
    closed: bool
    boundary_length: Interval
    boundary_count: int
    boundaries: tuple[Boundary[Place_co], ...]
    open_edges: int
    inconsistent_edges: int
    faulty_edges: tuple[FaultyEdge[Place_co], ...]
    parts: tuple[PartMeasures, ...]
    reached: bool
    moved: float
    edge_lengths: tuple[Interval, ...] | None = None
    gap_bound: float | None = None
    skipped_faces: tuple[SkippedFace, ...] | None = None
