"""Many curves as Bézier spans, grouped by degree, so that no Python loop runs over curves.

A curve of degree n over a span [a, b] between two neighbouring breaks is a Bézier curve in the
local parameter x = (t − a) / (b − a). Curves are right-continuous, as B-splines are
(`service.bases.knots`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins
from service.engine.nets.blossoms import build_blossoms
from service.engine.trims.lowering import lower_curves
from service.engine.trims.span_nets import (
    Intervals,
    SpanNets,
    interpolate,
    merge_groups,
    project_levels,
)
from service.engine.trims.spans import Breaks
from service.surface.spline_tables import CurveTable, find_starts


@dataclass(frozen=True, eq=False)
class Splines:
    """n curves of dimension D.

    Attributes
    ----------
    dimension : int
        D, 2 or 3.
    degree : ndarray of int, shape (n,)
        The degree of each curve; that of its nets may be higher (`merge_groups`).
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
        breaks, groups, group, row = lower_curves(table)
        return cls(
            table.points.shape[1],
            table.degrees,
            table.is_rational,
            breaks.count,
            breaks.first,
            breaks.values,
            *merge_groups(groups, group, row),
        )

    def __len__(self) -> int:
        return len(self.degree)

    @property
    def start(self) -> FloatArray:
        """The first parameter of each curve, (n,)."""
        return self.breaks.take(self.first_break)

    @property
    def end(self) -> FloatArray:
        """The last parameter of each curve, (n,)."""
        return self.breaks.take(self.first_break + self.span_count)

    def take(self, curves: Ints) -> "Splines":
        """The curves with these numbers, in this order; a curve may occur several times."""
        if len(curves) == len(self) and (curves == np.arange(len(self))).all():
            return self
        span_count = self.span_count[curves]
        _, rows = expand_runs(span_count + 1, self.first_break[curves])
        return replace(
            self,
            degree=self.degree[curves],
            is_rational=self.is_rational[curves],
            span_count=span_count,
            first_break=find_starts(span_count + 1)[:-1],
            breaks=self.breaks[rows],
            group=self.group[curves],
            row=self.row[curves],
        )

    @classmethod
    def join(cls, parts: Sequence["Splines"]) -> "Splines":
        """The curves of several records of one dimension, one record after the other."""
        if len(parts) == 1:
            return parts[0]
        groups = [nets for part in parts for nets in part.groups]
        first = find_starts(np.array([len(part.groups) for part in parts]))[:-1]
        group = np.concatenate([part.group + k for part, k in zip(parts, first, strict=True)])
        row = np.concatenate([part.row for part in parts])
        span_count = np.concatenate([part.span_count for part in parts])
        return cls(
            parts[0].dimension,
            np.concatenate([part.degree for part in parts]),
            np.concatenate([part.is_rational for part in parts]),
            span_count,
            find_starts(span_count + 1)[:-1],
            np.concatenate([part.breaks for part in parts]),
            *merge_groups(groups, group, row),
        )

    def move_ranges(self, start: FloatArray, end: FloatArray) -> "Splines":
        """The curves with their parameters mapped affinely to [start, end], (n,) each."""
        old_start, old_end = self.start, self.end
        unchanged = (start == old_start) & (end == old_end)
        if unchanged.all():
            return self
        owner = np.repeat(np.arange(len(self)), self.span_count + 1)
        scale = (end - start) / (old_end - old_start)
        breaks = start[owner] + (self.breaks - old_start[owner]) * scale[owner]
        unchanged = unchanged[owner]
        breaks = np.where(unchanged, self.breaks, breaks)
        breaks[self.first_break] = start
        breaks[self.first_break + self.span_count] = end
        return replace(self, breaks=breaks)

    def map_points(self, origin: FloatArray, scale: FloatArray) -> "Splines":
        """The curves (P − origin) · scale, with a row of `origin` and `scale`, (n, D), for each."""
        spans = self.list_spans()
        group, row = np.zeros((2, len(self)), np.intp)
        groups = []
        for k, (nets, rows) in enumerate(self.split(spans.curve)):
            curve = spans.curve[rows]
            values = nets.values.take(self.row[curve] + spans.span[rows], axis=2)
            weights = values[:, -1:] if nets.is_rational else 1.0
            values[:, : self.dimension] -= origin[curve].T * weights
            values[:, : self.dimension] *= scale[curve].T
            groups.append(SpanNets(values, nets.is_rational))
            curves = curve[find_begins(curve)]
            group[curves], row[curves] = k, find_starts(self.span_count[curves])[:-1]
        return replace(self, groups=tuple(groups), group=group, row=row)

    def find_spans(self, curve: Ints, t: FloatArray, *, before: bool = False) -> Ints:
        """The spans (m,) of curves that contain the parameters t (m,).

        At a break it is the span that begins there, or with `before` the span that ends there.
        Parameters outside of the domain belong to the first or the last span.
        """
        return self._breaks.find_spans(curve, t, before=before)

    def evaluate(self, curve: Ints, t: FloatArray) -> FloatArray:
        """Points (m, D) of curves (m,) at parameters t (m,), which are clamped to the domain."""
        column, x, _ = self._locate(curve, t)
        if len(self.groups) == 1:
            return _evaluate(self.groups[0], column, x)
        points = np.empty((len(curve), self.dimension))
        for nets, rows in self.split(curve):
            points[rows] = _evaluate(nets, column[rows], x[rows])
        return points

    def evaluate_derivatives(self, curve: Ints, t: FloatArray, order: int = 1) -> FloatArray:
        """Points and derivatives C, C′ and, if `order` is 2, C″: shape (order + 1, m, D)."""
        column, x, width = self._locate(curve, t)
        out = np.zeros((order + 1, len(curve), self.dimension))
        for nets, rows in self.split(curve):
            levels = interpolate(nets.values.take(column[rows], axis=2), x[rows], order)
            if nets.is_rational:
                levels = project_levels(levels)
            for k, level in enumerate(levels):
                out[k, rows] = (level / width[rows] ** k if k else level).T
        return out

    def cut(self, curve: Ints, low: FloatArray, high: FloatArray) -> Intervals:
        """Intervals [low, high] (m,) of curves, cut at their breaks."""
        first = self.find_spans(curve, low)
        if not self._has_breaks:
            return Intervals(np.arange(len(curve)), curve, low, high, first)
        last = np.maximum(self.find_spans(curve, high, before=True), first)
        source, span = expand_runs(last - first + 1, first)
        owner = curve[source]
        at = self.first_break[owner] + span
        return Intervals(
            source,
            owner,
            np.maximum(low[source], self.breaks[at]),
            np.minimum(high[source], self.breaks[at + 1]),
            span,
        )

    def list_spans(self) -> Intervals:
        """All spans of all curves, curve after curve; `source` is the curve."""
        return self._spans

    @cached_property
    def _spans(self) -> Intervals:
        """The result of `list_spans`."""
        curve, span = expand_runs(self.span_count)
        at = self.first_break[curve] + span
        return Intervals(curve, curve, self.breaks[at], self.breaks[at + 1], span)

    def restrict(self, intervals: Intervals) -> Iterator[tuple[Ints, FloatArray]]:
        """The Bézier nets of curves over intervals, group by group.

        Yields
        ------
        indices : ndarray of int, shape (r,)
            Rows of `intervals`, ascending.
        nets : ndarray of float64, shape (r, n+1, D), or (r, n+1, D + 1) if rational
        """
        at = self.first_break[intervals.curve] + intervals.span
        low = self.breaks[at]
        width = self.breaks[at + 1] - low
        ends = np.array([(intervals.low - low) / width, (intervals.high - low) / width])
        ends = np.minimum(np.maximum(ends, 0.0), 1.0)
        ends = 1.0 - (1.0 - ends)  # so that 1 − t is exact, too
        column = self.row[intervals.curve] + intervals.span
        for nets, rows in self.split(intervals.curve):
            blossoms = build_blossoms(nets.degree, ends[:, rows])
            yield rows, blossoms @ nets.nets.take(column[rows], axis=0)

    def count_restricted(self, numbers: int) -> int:
        """How many intervals `restrict` takes with matrices of this many numbers; at least 1.

        There is a matrix for each interval, of degree + 1 rows and columns.
        """
        degree = max((nets.degree for nets in self.groups), default=0)
        return max(1, numbers // (degree + 1) ** 2)

    def _locate(self, curve: Ints, t: FloatArray) -> tuple[Ints, FloatArray, FloatArray]:
        """Columns of nets (m,), local parameters (m,) from 0 to 1, and lengths of spans (m,)."""
        at = self.first_break.take(curve)
        column = self.row.take(curve)
        if self._has_breaks:
            span = self.find_spans(curve, t)
            at, column = at + span, column + span
        low = self.breaks.take(at)
        width = self.breaks.take(at + 1) - low
        return column, np.minimum(np.maximum((t - low) / width, 0.0), 1.0), width

    @cached_property
    def _has_breaks(self) -> bool:
        """Whether some curve has more than one span."""
        return bool((self.span_count > 1).any())

    def split(self, curve: Ints) -> Iterator[tuple[SpanNets, Ints]]:
        """The groups that have some of the curves (m,), each with their indices in `curve`."""
        if len(self.groups) == 1:
            if len(curve):
                yield self.groups[0], np.arange(len(curve))
            return
        group = self.group[curve]
        for k, nets in enumerate(self.groups):
            rows = (group == k).nonzero()[0]
            if len(rows):
                yield nets, rows

    @cached_property
    def _breaks(self) -> Breaks:
        """The breaks of all curves, for `find_spans`."""
        return Breaks(self.breaks, self.span_count, self.first_break)


def _evaluate(nets: SpanNets, column: Ints, x: FloatArray) -> FloatArray:
    """Points (m, D) of nets at local parameters."""
    point = interpolate(nets.values.take(column, axis=2), x, 0)[0]
    return (point[:-1] / point[-1] if nets.is_rational else point).T
