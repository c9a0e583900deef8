"""Curves from the Bézier nets of their spans, and the curves over parts of their domains."""

from collections.abc import Iterable

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import find_begins
from service.engine.trims.span_nets import Intervals, SpanNets
from service.engine.trims.splines import Splines
from service.surface.spline_tables import find_starts


def join_spans(
    dimension: int,
    intervals: Intervals,
    nets: Iterable[tuple[Ints, FloatArray]],
) -> Splines:
    """Curves from their spans.

    Parameters
    ----------
    dimension : int
        D.
    intervals : Intervals
        The spans of curve 0, then those of curve 1, and so on: `source` is the number of the new
        curve; each interval begins where the one before ends.
    nets : pairs of rows of `intervals` and nets (r, n+1, D) or (r, n+1, D + 1)
        As `Splines.restrict` yields them; all spans of a curve have nets of one shape.
    """
    source = intervals.source
    count = int(source[-1]) + 1 if len(source) else 0
    span_count = np.bincount(source, minlength=count)
    first_break = find_starts(span_count + 1)[:-1]
    breaks = np.empty(len(source) + count)
    breaks[np.arange(len(source)) + source] = intervals.low
    last = span_count.cumsum() - 1
    breaks[first_break + span_count] = intervals.high[last]
    parts: dict[tuple[int, ...], list[tuple[Ints, FloatArray]]] = {}
    for rows, values in nets:
        parts.setdefault(values.shape[1:], []).append((rows, values))
    degree, group, row = np.zeros((3, count), np.intp)
    is_rational = np.zeros(count, bool)
    groups: list[SpanNets] = []
    for shape, members in parts.items():
        rows = np.concatenate([rows for rows, _ in members])
        order = rows.argsort()
        values = np.concatenate([values for _, values in members])[order]
        owner = source[rows[order]]
        begins = find_begins(owner)
        curves = owner[begins]
        degree[curves], group[curves], row[curves] = shape[0] - 1, len(groups), begins
        is_rational[curves] = shape[1] > dimension
        groups.append(
            SpanNets(np.ascontiguousarray(values.transpose(1, 2, 0)), shape[1] > dimension)
        )
    return Splines(
        dimension,
        degree,
        is_rational,
        span_count,
        first_break,
        breaks,
        tuple(groups),
        group,
        row,
    )


def restrict_curves(splines: Splines, curve: Ints, low: FloatArray, high: FloatArray) -> Splines:
    """New curves: curve `curve[k]` over [low[k], high[k]], with the same parameters."""
    intervals = splines.cut(curve, low, high)
    return join_spans(splines.dimension, intervals, splines.restrict(intervals))


def make_segments(begin: FloatArray, end: FloatArray, ranges: FloatArray) -> Splines:
    """Segments from points (k, D) to points (k, D) over ranges (k, 2) of parameters."""
    every = np.arange(len(begin))
    intervals = Intervals(every, every, ranges[:, 0], ranges[:, 1], np.zeros(len(begin), np.intp))
    return join_spans(begin.shape[1], intervals, [(every, np.stack([begin, end], axis=1))])
