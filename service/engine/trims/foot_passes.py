"""Parameters at which curves are cut, because they pass near a pole of the surface below them.

Around a pole a parameter of the surface is an angle. A curve that passes the pole at the distance d
with the speed s has feet whose angle turns by π, most of it while the parameter t moves by d / s:
it is about arctan(s (t − t*) / d), which is analytic within d / s of the nearest point t* alone.
Pieces of the lengths d/s, d/s, 2 d/s, 4 d/s … on both sides of t* turn by π/4 at most, and
polynomials through their nodes converge at the same rate on each. Distances and speeds are those in
the metric of the pole (`pole_frames`).

References
----------
Trefethen, Approximation Theory and Approximation Practice, chapter 8.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.pole_frames import PoleFrames
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import dot, length

SAMPLES = 16
"""Parts of each span, between whose ends the nearest point to a pole is looked for."""

STEPS = 20
"""The most steps of Newton's method towards it."""

LAST_STEP = 2.0**-20
"""A step of at most this share of a sample's distance from the next is the last one."""

SHARE = 1 / 8
"""Pieces are at most this share of a span long, as long as they are cut for a pole."""

LEAST = 2.0**-40
"""No cut is nearer to the end of its span than this share of it."""


@dataclass(frozen=True, eq=False, slots=True)
class PoleCuts:
    """k parameters at which curves are cut, in no order.

    Attributes
    ----------
    curve : ndarray of int, shape (k,)
    t : ndarray of float64, shape (k,)
    """

    curve: Ints
    t: FloatArray


def find_pole_cuts(
    surfaces: ClosedSurfaces, face: Ints, curves: Splines, tolerance: float
) -> PoleCuts:
    """Where curves that pass near poles are cut.

    Parameters
    ----------
    face : ndarray of int, shape (n,)
        The face of each curve.
    tolerance : float
        Curves that come nearer to a pole run through it: they are not cut there. Model units.
    """
    cuts = PoleCuts(np.zeros(0, np.intp), np.zeros(0))
    if not surfaces.is_pole[face].any():
        return cuts
    spans = curves.list_spans()
    for axis, end in ((0, 0), (0, 1), (1, 0), (1, 1)):
        rows = surfaces.is_pole[face[spans.curve], axis, end].nonzero()[0]
        if not len(rows):
            continue
        chosen = spans.take(rows)
        poles = PoleFrames.of(surfaces, face[chosen.curve], axis, end)
        span, t, reach = _find_passes(curves, chosen, poles, tolerance)
        cuts = _join(cuts, _grade(chosen.take(span), t, reach))
    return cuts


def _join(one: PoleCuts, other: PoleCuts) -> PoleCuts:
    """Both."""
    return PoleCuts(np.concatenate([one.curve, other.curve]), np.concatenate([one.t, other.t]))


def _find_passes(
    curves: Splines, spans: Intervals, poles: PoleFrames, tolerance: float
) -> tuple[Ints, FloatArray, FloatArray]:
    """The points of spans (m,) that are nearest to their poles: span, t*, and d / s, (k,)."""
    count = len(spans.curve)
    width = spans.high - spans.low
    t = spans.low[:, np.newaxis] + width[:, np.newaxis] * np.linspace(0.0, 1.0, SAMPLES + 1)
    run = np.repeat(np.arange(count), SAMPLES + 1)
    points = curves.evaluate(spans.curve[run], t.ravel())
    metrics = poles.find_metrics()
    apart = np.pad(
        length(_map(metrics[run], points - poles.points[run]), -1).reshape(count, -1),
        ((0, 0), (1, 1)),
        constant_values=np.inf,
    )
    is_least = (apart[:, 1:-1] <= apart[:, :-2]) & (apart[:, 1:-1] < apart[:, 2:])
    row, column = is_least.nonzero()
    at, pole, curve = t[row, column], poles.points[row], spans.curve[row]
    metrics = metrics[row]
    step = width[row] / SAMPLES
    low = np.maximum(at - step, spans.low[row])
    high = np.minimum(at + step, spans.high[row])
    for _ in range(STEPS):
        point, first, second = curves.evaluate_derivatives(curve, at, 2)
        rest, first, second = (_map(metrics, x) for x in (point - pole, first, second))
        bend = dot(first, first, -1)
        full = bend + dot(rest, second, -1)
        bend = np.where(full > 0, full, np.where(bend > 0, bend, 1.0))
        before = at
        at = np.minimum(np.maximum(at - dot(rest, first, -1) / bend, low), high)
        if (np.abs(at - before) <= LAST_STEP * step).all():
            break
    point, first = curves.evaluate_derivatives(curve, at)
    is_apart = length(point - pole, -1) > tolerance
    distance, speed = (length(_map(metrics, x), -1) for x in (point - pole, first))
    reach = np.where(speed > 0, distance / np.where(speed > 0, speed, 1.0), np.inf)
    near = (is_apart & (reach < SHARE * width[row])).nonzero()[0]
    return row[near], at[near], reach[near]


def _map(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors (m, 3) mapped by matrices (m, 3, 3)."""
    mapped: FloatArray = np.einsum("mij,mj->mi", matrices, vectors)
    return mapped


def _grade(spans: Intervals, t: FloatArray, reach: FloatArray) -> PoleCuts:
    """Cuts at t*, and d/s, 2 d/s, 4 d/s … before and after it, up to a share of the span."""
    width = spans.high - spans.low
    levels = np.ceil(np.log2(SHARE * width / reach)).astype(np.intp) + 1
    run, number = expand_runs(levels)
    steps = reach[run] * 2.0**number
    curve = np.concatenate([spans.curve, spans.curve[run], spans.curve[run]])
    cuts = np.concatenate([t, t[run] - steps, t[run] + steps])
    span = np.concatenate([np.arange(len(t)), run, run])
    margin = LEAST * width[span]
    inside = (cuts > spans.low[span] + margin) & (cuts < spans.high[span] - margin)
    return PoleCuts(curve[inside], cuts[inside])
