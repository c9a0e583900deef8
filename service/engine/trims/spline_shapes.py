"""Kinks, lengths and boxes of many curves, from the control points of their spans."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import dot, length
from service.surface.spline_tables import find_starts

KINK = 0.995
"""A curve has a kink at a break if the cosine of the angle between its tangents is below this."""


def find_kinks(splines: Splines, scale: FloatArray | None = None) -> tuple[Ints, FloatArray]:
    """The breaks at which the direction of a curve turns by more than `KINK`.

    Parameters
    ----------
    scale : ndarray of float64, shape (n, D), optional
        Factors of the coordinates of each curve, before directions are compared.

    Returns
    -------
    curve, t : ndarray of int and of float64, shape (k,)
    """
    curve, span = expand_runs(splines.span_count - 1)
    is_kink = np.zeros(len(curve), bool)
    for nets, rows in splines.split(curve) if len(curve) else ():
        owner, column = curve[rows], splines.row[curve[rows]] + span[rows]
        points = nets.points
        before = points[-1].take(column, axis=1) - points[-2].take(column, axis=1)
        after = points[1].take(column + 1, axis=1) - points[0].take(column + 1, axis=1)
        if scale is not None:
            before, after = before * scale[owner].T, after * scale[owner].T
        lengths = length(before) * length(after)
        is_kink[rows] = ~(dot(before, after) >= KINK * lengths) | (lengths == 0)
    return curve[is_kink], splines.breaks[splines.first_break[curve] + span + 1][is_kink]


def measure_polygons(splines: Splines) -> FloatArray:
    """Lengths (n,) of the control polygons of the Bézier spans: no curve is longer."""
    spans = splines.list_spans()
    lengths = np.zeros(len(spans.curve))
    for nets, rows in splines.split(spans.curve):
        points = nets.points.take(splines.row[spans.curve[rows]] + spans.span[rows], axis=2)
        lengths[rows] = length(points[1:] - points[:-1]).sum(axis=0)
    total: FloatArray = np.bincount(spans.curve, lengths, minlength=len(splines)).astype(np.float64)
    return total


def find_boxes(splines: Splines) -> tuple[FloatArray, FloatArray]:
    """Least and greatest coordinates, (n, D) each, of the control points of the spans."""
    low, high = box_spans(splines, splines.list_spans())
    if not len(splines):
        return low, high
    first = find_starts(splines.span_count)[:-1]
    return np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)


def box_spans(splines: Splines, spans: Intervals) -> tuple[FloatArray, FloatArray]:
    """Least and greatest coordinates, (m, D) each, of the control points of whole spans."""
    low, high = np.zeros((2, len(spans.curve), splines.dimension))
    for nets, rows in splines.split(spans.curve):
        points = nets.points.take(splines.row[spans.curve[rows]] + spans.span[rows], axis=2)
        low[rows], high[rows] = points.min(axis=0).T, points.max(axis=0).T
    return low, high


def find_face_boxes(pcurves: Splines, face: Ints, count: int) -> tuple[FloatArray, FloatArray]:
    """Boxes about the parameter curves of each of `count` faces: (count, 2) each.

    `face` (n,) has the face of each curve, in ascending order. A face without curves has the least
    values ∞ and the greatest values −∞.
    """
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    if len(face):
        spans = pcurves.list_spans()
        owner = face[spans.curve]
        begins = find_begins(owner)
        least, most = box_spans(pcurves, spans)
        low[owner[begins]] = np.minimum.reduceat(least, begins)
        high[owner[begins]] = np.maximum.reduceat(most, begins)
    return low, high
