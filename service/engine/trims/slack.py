"""How far surfaces move where places of their borders, and knots, are rounded.

Proof in docs/proofs.md: "Places of trimmed faces".
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, mark_begins
from service.engine.trims.places import Places
from service.engine.trims.span_nets import Intervals
from service.engine.trims.spline_shapes import box_spans
from service.engine.trims.splines import Splines
from service.engine.vectors import project
from service.surface.spline_tables import find_starts

UNITS = 2.5
"""Places may move by up to this number of units along both axes."""

REACH = 2 * UNITS
"""Spans nearer to the border than this number of units count."""

FEW = 16
"""All patches of faces with at most this number count."""

_PARTS = 4
"""Parameter curves are cut into at least this number of parts, whose boxes show where they are."""


def bound_slack(
    places: Places, pcurves: Splines, face: Ints, loop: Ints, is_reversed: Bools
) -> FloatArray:
    """Bounds σ (F,) of how far surfaces move over `UNITS` units along both axes near the border.

    Spans that the border neither touches nor comes near need not count: there, rounded knots only
    change the parameters of the surface. The lengths of spans without places are added.

    Parameters
    ----------
    pcurves : Splines
        n parameter curves, in places, in the order of loops.
    face, loop : ndarray of int, shape (n,)
        The face and the loop of each curve; loops are in ascending order.
    is_reversed : ndarray of bool, shape (n,)
        Whether the loop runs against the curve.
    """
    spans = places.faces.spans
    count = spans.prod(axis=0)
    has_border = np.zeros(len(count), bool)
    has_border[face] = True
    owner, number = expand_runs(np.where(has_border & (count <= FEW), count, 0))
    columns = spans[1].take(owner)
    near = [np.array([owner, number // columns, number % columns])]
    rows = (count[face] > FEW).nonzero()[0]
    if len(rows):
        chosen = pcurves.take(rows), face[rows], loop[rows], is_reversed[rows]
        near.append(_find_near_spans(places, *chosen))
    owner, *span = np.concatenate(near, axis=1)
    patch = places.first.take(owner) + span[0] * places.stride.take(owner) + span[1]
    lengths = np.zeros((2, len(patch)))
    nets = places.surfaces.nets
    for group, rows in nets.split_by_group(patch):
        lengths[:, rows] = group.partial_bounds.take(nets.row[patch[rows]], axis=1)
    slack = np.zeros((2, len(count)))
    for axis in range(2):
        begin, end = places.knots_at(owner, axis, span[axis])
        # Spans without places are in the second term.
        rates = np.where(end > begin, lengths[axis] / np.maximum(end - begin, 1), 0.0)
        np.maximum.at(slack[axis], owner, rates)
    bounds: FloatArray = UNITS * slack.sum(axis=0)
    return bounds + _measure_skipped(places) if places.has_skipped_spans else bounds


def _box_curves(pcurves: Splines) -> tuple[Ints, FloatArray, FloatArray]:
    """Boxes about the parts of curves: the curve, and the least and greatest places (m, 2)."""
    spans = pcurves.list_spans()
    parts = np.maximum(1, -(-_PARTS // pcurves.span_count))[spans.curve]
    run, part = expand_runs(parts)
    spans = spans.take(run)
    step = (spans.high - spans.low) / parts[run]
    begin = spans.low + part * step
    end = np.minimum(begin + step, spans.high)
    low, high = np.empty((2, len(part), 2))
    whole = (parts[run] == 1).nonzero()[0]
    low[whole], high[whole] = box_spans(pcurves, spans.take(whole))
    divided = (parts[run] > 1).nonzero()[0]
    intervals = Intervals(spans.source, spans.curve, begin, end, spans.span).take(divided)
    for rows, nets in pcurves.restrict(intervals):
        points = project(nets, -1, 2)
        low[divided[rows]], high[divided[rows]] = points.min(axis=1), points.max(axis=1)
    return spans.curve, low, high


def _box_joins(
    pcurves: Splines, loop: Ints, is_reversed: Bools
) -> tuple[Ints, FloatArray, FloatArray]:
    """Boxes about the segments from the end of each curve of a loop to the start of the next."""
    curve = np.arange(len(loop))
    first, last = pcurves.start, pcurves.end
    begins = pcurves.evaluate(curve, np.where(is_reversed, last, first))
    ends = pcurves.evaluate(curve, np.where(is_reversed, first, last))
    is_first = mark_begins(loop)
    following = curve + 1
    following[np.append(is_first[1:], True)] = curve[is_first]
    begins = begins[following]
    return curve, np.minimum(ends, begins), np.maximum(ends, begins)


def _find_near_spans(
    places: Places, pcurves: Splines, face: Ints, loop: Ints, is_reversed: Bools
) -> Ints:
    """Faces, spans along u, and spans along v, (3, k), that the borders of faces come near.

    Boxes about parts of the border are added up as differences: 1 at the first corner, −1 behind
    the last one, then sums along both axes. For each face there is a column of (n_u + 1) (n_v + 1)
    numbers, v fastest; all rows and all columns add up to 0, so that sums end there.
    """
    boxes = [_box_curves(pcurves), _box_joins(pcurves, loop, is_reversed)]
    curve, low, high = (np.concatenate(values) for values in zip(*boxes, strict=True))
    face = face[curve]
    rows, columns = places.faces.spans + 1
    start = find_starts(rows * columns)
    begin, end = np.empty((2, 2, len(face)), np.intp)
    for axis in range(2):
        begin[axis], end[axis] = places.find_spans(
            face, axis, low[:, axis] - REACH, high[:, axis] + REACH
        )
    marks = np.zeros(start[-1], np.intp)
    for u, v, sign in (
        (begin[0], begin[1], 1),
        (begin[0], end[1] + 1, -1),
        (end[0] + 1, begin[1], -1),
        (end[0] + 1, end[1] + 1, 1),
    ):
        np.add.at(marks, start[face] + u * columns[face] + v, sign)
    marks = marks.cumsum()
    owner, number = expand_runs(rows * columns)
    order = start[owner] + number % rows[owner] * columns[owner] + number // rows[owner]
    marks[order] = marks[order].cumsum()
    near = (marks > 0).nonzero()[0]
    owner, number = owner[near], number[near]
    return np.stack([owner, number // columns[owner], number % columns[owner]])


def _measure_skipped(places: Places) -> FloatArray:
    """For each face, (F,), bounds of the lengths of all spans without places, added up."""
    faces, nets = places.faces, places.surfaces.nets
    total = np.zeros(len(faces.first))
    for axis in range(2):
        owner, span = expand_runs(faces.spans[axis])
        begin, end = places.knots_at(owner, axis, span)
        skipped = (begin == end).nonzero()[0]
        if not len(skipped):
            continue
        run, across = expand_runs(faces.spans[1 - axis].take(owner[skipped]))
        face, along = owner[skipped[run]], span[skipped[run]]
        u, v = (along, across) if axis == 0 else (across, along)
        patch = faces.first[face] + u * faces.stride[face] + v
        lengths = np.zeros(len(patch))
        for group, rows in nets.split_by_group(patch):
            lengths[rows] = group.partial_bounds[axis].take(nets.row[patch[rows]])
        longest = np.maximum.reduceat(lengths, (across == 0).nonzero()[0])
        total += np.bincount(owner[skipped], longest, minlength=len(total))
    return total
