"""Parameter curves cut where they cross the knot lines of their surfaces.

A part of a curve whose control points lie between two knots is within one span. Otherwise the part
is divided at the knot nearest to its middle: where the coordinate rises or falls along the control
points, it crosses the knot once, and the crossing is found by regula falsi; where it does not, the
part is halved. Parts that touch a knot line end as very short ones.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import Items, project

MARGIN = 2.0**-42
"""A part may reach beyond a knot by this share of the domain."""

SHORTEST = 2.0**-40
"""Parts that are shorter than this share of the domain of their curve are not divided."""

LOOSE = 1e-9
"""Control points are at most this share of the domain beyond an open end, if the part is long."""

LONG = 2.0**-7
"""Parts are long above this share of the domain of their curve."""

STEPS = 12
"""Steps of regula falsi (the Illinois variant)."""


@dataclass(frozen=True, eq=False, slots=True)
class SpanParts(Items):
    """m parts of parameter curves, each over one patch.

    Attributes
    ----------
    source, span : ndarray of int, shape (m,)
        The row of the interval from which a part was cut, and the span of its curve.
    curve : ndarray of int, shape (m,)
    low, high : ndarray of float64, shape (m,)
        Parameters of the curve.
    patch : ndarray of int, shape (m,)
    around : ndarray of int, shape (9, m)
        The patch and its eight neighbours; at borders, fewer, repeated.
    knots : ndarray of float64, shape (2, 2, m)
        For both axes, the knots at which the span begins and ends.
    excess : ndarray of float64, shape (2, m)
        How far the control points of the part reach beyond the span, along each axis.
    is_constant : ndarray of bool, shape (2, m)
        Whether all control points have the same coordinate.
    """

    source: Ints
    span: Ints
    curve: Ints
    low: FloatArray
    high: FloatArray
    patch: Ints
    around: Ints
    knots: FloatArray
    excess: FloatArray
    is_constant: Bools


def cut_at_knots(
    surfaces: ClosedSurfaces, face: Ints, pcurves: Splines, intervals: Intervals
) -> SpanParts:
    """Parts of parameter curves over single patches, in the order of sources and parameters.

    Parameters
    ----------
    face : ndarray of int, shape (n,)
        The face of each parameter curve.
    pcurves : Splines
        Of dimension 2, in parameters of the surfaces; along closed axes, also beyond the domains.
    intervals : Intervals
        Of the parameter curves. The sources of the parts are rows of these.
    """
    done: list[SpanParts] = []
    todo = Intervals(
        np.arange(len(intervals.curve)),
        intervals.curve,
        intervals.low,
        intervals.high,
        intervals.span,
    )
    domain = pcurves.end - pcurves.start
    while len(todo.curve):
        checkpoint()
        rising = np.zeros((2, len(todo.curve)), bool)
        low, high = np.empty((2, 2, len(todo.curve)))
        for rows, nets in pcurves.restrict(todo):
            # NumPy reduces many short rows slowly.
            points = np.ascontiguousarray(project(nets, -1, 2).transpose(1, 2, 0))
            steps = points[1:] - points[:-1]
            rising[:, rows] = (steps >= 0).all(axis=0) | (steps <= 0).all(axis=0)
            low[:, rows], high[:, rows] = points.min(axis=0), points.max(axis=0)
        owner = face[todo.curve]
        spans = [surfaces.find_spans(owner, a, (low[a] + high[a]) / 2) for a in range(2)]
        knots = np.array([surfaces.list_knots(owner, a, spans[a]) for a in range(2)])
        excess = np.maximum(np.maximum(knots[:, 0] - low, high - knots[:, 1]), 0.0)
        excess[:, surfaces.surfaces.is_planar[owner]] = 0.0  # planes have no ends
        is_open = ~surfaces.is_closed[owner].T
        last = surfaces.surfaces.faces.spans[:, owner] - 1
        # Beyond an open end there is no other span; shorter parts have closer control points.
        at_first, at_last = (np.array(spans) == 0) & is_open, (np.array(spans) == last) & is_open
        over = np.stack([knots[:, 0] - low, high - knots[:, 1]], axis=1)
        over[:, 0] = np.where(at_first, 0.0, over[:, 0])
        over[:, 1] = np.where(at_last, 0.0, over[:, 1])
        too_far = over > MARGIN * surfaces.period[owner].T[:, np.newaxis]
        is_short = todo.high - todo.low <= SHORTEST * domain[todo.curve]
        is_done = is_short | ~too_far.any(axis=(0, 1))
        is_long = todo.high - todo.low > LONG * domain[todo.curve]
        is_loose = (excess > LOOSE * surfaces.period[owner].T).any(axis=0) & is_long
        is_done &= ~is_loose
        done.append(
            SpanParts(
                todo.source,
                todo.span,
                todo.curve,
                todo.low,
                todo.high,
                *_find_patches(surfaces, owner, spans),
                knots,
                excess,
                low == high,
            ).take(is_done)
        )
        rest = (~is_done).nonzero()[0]
        if not len(rest):
            if len(done) == 1:  # nothing was cut
                return done[0]
            break
        # The axis along which a part is divided, and the knot.
        axis = np.where(too_far[0].any(axis=0), 0, 1)[rest]
        side = np.where(over[axis, 0, rest] > over[axis, 1, rest], 0, 1)
        knot = knots[axis, side, rest]
        cut = (todo.low + todo.high)[rest] / 2
        is_crossing: Bools = np.any(too_far, axis=(0, 1))
        crossing = (rising[axis, rest] & is_crossing[rest]).nonzero()[0]
        part = todo.take(rest)
        if len(crossing):
            margin = MARGIN * surfaces.period[owner[rest[crossing]], axis[crossing]]
            cut[crossing] = _find_crossing(
                pcurves, part.take(crossing), axis[crossing], knot[crossing], margin
            )
        todo = Intervals.join(
            [
                Intervals(part.source, part.curve, part.low, cut, part.span),
                Intervals(part.source, part.curve, cut, part.high, part.span),
            ]
        )
    if not done:
        empty = np.zeros(0, np.intp)
        done.append(_empty_parts(empty))
    parts = SpanParts.join(done)
    return parts.take(np.lexsort((parts.low, parts.source)))


def _empty_parts(empty: Ints) -> SpanParts:
    """No parts."""
    none = np.zeros(0)
    return SpanParts(
        *(empty,) * 3,
        none,
        none,
        empty,
        np.zeros((9, 0), np.intp),
        np.zeros((2, 2, 0)),
        np.zeros((2, 0)),
        np.zeros((2, 0), bool),
    )


def _find_patches(surfaces: ClosedSurfaces, face: Ints, spans: list[Ints]) -> tuple[Ints, Ints]:
    """The patches (m,) of spans; and these with their neighbours, (9, m)."""
    faces = surfaces.surfaces.faces
    steps = np.array([[0], [-1], [1]])
    along = []
    for axis, span in enumerate(spans):
        count = faces.spans[axis, face]
        near = span + steps
        inside = np.minimum(np.maximum(near, 0), count - 1)
        along.append(np.where(surfaces.is_closed[face, axis], near % count, inside))
    around = along[0][:, np.newaxis] * faces.stride[face] + along[1] + faces.first[face]
    return around[0, 0], around.reshape(9, -1)


def _find_crossing(
    pcurves: Splines, part: Intervals, axis: Ints, knot: FloatArray, margin: FloatArray
) -> FloatArray:
    """Parameters (m,) inside of parts at which the coordinate along an axis is the knot.

    It differs from the knot by at most half of `margin` (m,).
    """
    number = np.arange(len(part.curve))
    low, high = part.low.copy(), part.high.copy()

    def value(t: FloatArray) -> FloatArray:
        points: FloatArray = pcurves.evaluate(part.curve, t)[number, axis] - knot
        return points

    a, b = value(low), value(high)
    side = np.zeros(len(number), np.intp)
    t = middle = (low + high) / 2
    for _ in range(STEPS):
        t = low - a * (high - low) / np.where(a == b, 1.0, b - a)
        t = np.where((a == b) | (t <= low) | (t >= high), (low + high) / 2, t)
        at = value(t)
        is_low = (at < 0) == (a < 0)
        low, high = np.where(is_low, t, low), np.where(is_low, high, t)
        # The end that stays twice counts half.
        b = np.where(is_low, np.where(side == 1, b / 2, b), at)
        a = np.where(is_low, at, np.where(side == -1, a / 2, a))
        side = np.where(is_low, 1, -1)
        if (np.abs(at) <= margin / 2).all():
            break
    width = part.high - part.low
    is_inside = (t > part.low + 2.0**-30 * width) & (t < part.high - 2.0**-30 * width)
    return np.where(is_inside, t, middle)
