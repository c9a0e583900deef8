"""Whether parameter curves leave the domains of their surfaces."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.spline_shapes import find_boxes
from service.engine.trims.splines import Splines

OUTSIDE = 1e-6
"""A parameter curve leaves the domain by at most this share of it, as rounding in files does."""

SAMPLES = 64
"""Parameters at which curves with control points outside of the domain are evaluated."""


def find_beyond(surfaces: ClosedSurfaces, face: Ints, pcurves: Splines) -> tuple[Ints, FloatArray]:
    """The curves (k,) that leave the domain, and how far beyond it they are along u and v, (k, 2).

    Planes have no ends, and along closed axes surfaces are continued.
    """
    margin = OUTSIDE * surfaces.period
    low = np.where(surfaces.is_closed, -np.inf, surfaces.low - margin)[face]
    high = np.where(surfaces.is_closed, np.inf, surfaces.surfaces.high + margin)[face]
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
    is_outside = (beyond > 0).any(axis=1)
    return rows[is_outside], beyond[is_outside]
