"""Whether parameter curves leave the domains of their surfaces."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.spline_shapes import find_boxes
from service.engine.trims.splines import Splines

MOST_TURNS = 1000
"""The most turns of a curve around a closed surface, to each side: it is cut at each turn."""

OUTSIDE = 1e-6
"""A parameter curve leaves the domain by at most this share of it, as rounding in files does."""

SAMPLES = 64
"""Parameters at which curves with control points outside of the domain are evaluated."""


def find_beyond(surfaces: ClosedSurfaces, face: Ints, pcurves: Splines) -> tuple[Ints, FloatArray]:
    """The curves (k,) that leave the domain, and how far beyond it they are along u and v, (k, 2).

    Planes have no ends, and along closed axes surfaces are continued for `MOST_TURNS` turns.
    """
    margin = np.where(surfaces.is_closed, MOST_TURNS, OUTSIDE) * surfaces.period
    low, high = (surfaces.low - margin)[face], (surfaces.surfaces.high + margin)[face]
    least, most = find_boxes(pcurves)
    is_curved = ~surfaces.surfaces.is_planar[face]
    rows = (((least < low) | (most > high)).any(axis=1) & is_curved).nonzero()[0]
    if not len(rows):
        return rows, np.zeros((0, 2))
    # Control points may be outside although the curve is not.
    share = np.linspace(0.0, 1.0, SAMPLES)
    t = pcurves.start[rows, np.newaxis] * (1 - share) + pcurves.end[rows, np.newaxis] * share
    points = pcurves.evaluate(np.repeat(rows, SAMPLES), t.ravel()).reshape(-1, SAMPLES, 2)
    beyond = np.maximum(low[rows, np.newaxis] - points, points - high[rows, np.newaxis])
    beyond = beyond.max(axis=1)
    # Turns are bounded by the control points: a span of a curve may be between two samples.
    far = np.maximum(low - least, most - high)[rows]
    beyond = np.where(surfaces.is_closed[face[rows]], np.maximum(beyond, far), beyond)
    is_outside = (beyond > 0).any(axis=1)
    return rows[is_outside], beyond[is_outside]
