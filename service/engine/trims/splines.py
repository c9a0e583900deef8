"""Many curves as Bézier spans, grouped by degree, so that no Python loop runs over curves.

A curve of degree n over a span [a, b] between two neighbouring breaks is a Bézier curve in the
local parameter x = (t − a) / (b − a). Curves are right-continuous, as B-splines are
(`service.bases.knots`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.vectors import Items
from service.surface.spline_tables import CurveTable


@dataclass(frozen=True, eq=False, slots=True)
class SpanNets:
    """The Bézier spans of all curves of one degree n, all polynomial or all rational.

    Attributes
    ----------
    values : ndarray of float64, shape (n+1, D, k)
        Control points; or, if rational, (w P, w), D + 1 numbers. The spans of a curve follow one
        another.
    is_rational : bool
    """

    values: FloatArray
    is_rational: bool

    @property
    def degree(self) -> int:
        """Degree n."""
        return len(self.values) - 1


@dataclass(frozen=True, eq=False, slots=True)
class Intervals(Items):
    """m intervals of parameters, each within one span of a curve.

    Attributes
    ----------
    source : ndarray of int, shape (m,)
        For each interval, the row of the interval from which it was cut, in ascending order.
    curve : ndarray of int, shape (m,)
    low, high : ndarray of float64, shape (m,)
        The ends: low ≤ high.
    span : ndarray of int, shape (m,)
        The number of the span among those of its curve.
    """

    source: Ints
    curve: Ints
    low: FloatArray
    high: FloatArray
    span: Ints


@dataclass(frozen=True, eq=False)
class Splines:
    """n curves of dimension D.

    Attributes
    ----------
    dimension : int
        D, 2 or 3.
    degree : ndarray of int, shape (n,)
    is_rational : ndarray of bool, shape (n,)
    span_count : ndarray of int, shape (n,)
    first_break : ndarray of int, shape (n,)
        The breaks of curve c are the `span_count[c]` + 1 numbers of `breaks` from this row on.
    breaks : ndarray of float64, shape (Σ (span_count + 1),)
        Strictly increasing for each curve.
    groups : tuple of SpanNets
    group, row : ndarray of int, shape (n,)
        The group of each curve, and the column of its first span there.
    """

    dimension: int
    degree: Ints
    is_rational: Bools
    span_count: Ints
    first_break: Ints
    breaks: FloatArray
    groups: tuple[SpanNets, ...]
    group: Ints
    row: Ints

    @classmethod
    def of(cls, table: CurveTable) -> "Splines":
        """All curves of a table, lowered to Bézier spans."""
        raise NotImplementedError

    def __len__(self) -> int:
        return len(self.degree)

    @property
    def start(self) -> FloatArray:
        """The first parameter of each curve, (n,)."""
        start: FloatArray = self.breaks[self.first_break]
        return start

    @property
    def end(self) -> FloatArray:
        """The last parameter of each curve, (n,)."""
        end: FloatArray = self.breaks[self.first_break + self.span_count]
        return end

    def take(self, curves: Ints) -> "Splines":
        """The curves with these numbers, in this order; a curve may occur several times."""
        raise NotImplementedError

    @classmethod
    def join(cls, parts: Sequence["Splines"]) -> "Splines":
        """The curves of several records of one dimension, one record after the other."""
        raise NotImplementedError

    def move_ranges(self, start: FloatArray, end: FloatArray) -> "Splines":
        """The curves with their parameters mapped affinely to [start, end], (n,) each."""
        raise NotImplementedError

    def map_points(self, origin: FloatArray, scale: FloatArray) -> "Splines":
        """The curves (P − origin) · scale, with a row of `origin` and `scale`, (n, D), for each."""
        raise NotImplementedError

    def split_by_group(self, curve: Ints) -> Iterator[tuple[SpanNets, Ints]]:
        """The groups that have some of the curves (m,), each with their indices in `curve`."""
        raise NotImplementedError

    def find_spans(self, curve: Ints, t: FloatArray, *, before: bool = False) -> Ints:
        """The spans (m,) of curves that contain the parameters t (m,).

        At a break it is the span that begins there, or with `before` the span that ends there.
        Parameters outside of the domain belong to the first or the last span.
        """
        raise NotImplementedError

    def evaluate(self, curve: Ints, t: FloatArray) -> FloatArray:
        """Points (m, D) of curves (m,) at parameters t (m,), which are clamped to the domain."""
        raise NotImplementedError

    def evaluate_derivatives(self, curve: Ints, t: FloatArray, order: int = 1) -> FloatArray:
        """Points and derivatives C, C′ and, if `order` is 2, C″: shape (order + 1, m, D)."""
        raise NotImplementedError

    def cut(self, curve: Ints, low: FloatArray, high: FloatArray) -> Intervals:
        """Intervals [low, high] (m,) of curves, cut at their breaks."""
        raise NotImplementedError

    def list_spans(self) -> Intervals:
        """All spans of all curves, curve after curve; `source` is the curve."""
        raise NotImplementedError

    def restrict(self, intervals: Intervals) -> Iterator[tuple[Ints, FloatArray]]:
        """The Bézier nets of curves over intervals, group by group.

        Yields
        ------
        indices : ndarray of int, shape (r,)
            Rows of `intervals`, ascending.
        nets : ndarray of float64, shape (r, n+1, D), or (r, n+1, D + 1) if rational
        """
        raise NotImplementedError

    def find_kinks(self, scale: FloatArray | None = None) -> tuple[Ints, FloatArray]:
        """The breaks at which the direction of a curve turns by more than `KINK`.

        Parameters
        ----------
        scale : ndarray of float64, shape (n, D), optional
            Factors of the coordinates of each curve, before directions are compared.

        Returns
        -------
        curve, t : ndarray of int and of float64, shape (k,)
        """
        raise NotImplementedError

    def measure_polygons(self) -> FloatArray:
        """Lengths (n,) of the control polygons of the Bézier spans: no curve is longer."""
        raise NotImplementedError

    def find_boxes(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest coordinates, (n, D) each, of the control points of the spans."""
        raise NotImplementedError
