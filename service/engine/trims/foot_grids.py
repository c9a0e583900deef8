"""The nearest points of coarse grids on surfaces: first guesses of foot points."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.cancellation import checkpoint
from service.engine.trims.closure import ClosedSurfaces
from service.surface.spline_tables import find_starts

FEWEST, MOST = 12, 96
"""Least number of points of a table along an axis, and the number above which each span has only
two."""

PAIRS = 1 << 21
"""The most distances that are computed at once."""


def find_nearest(surfaces: ClosedSurfaces, face: Ints, points: FloatArray) -> FloatArray:
    """The parameters (m, 2) of the nearest point of a table of each face, for points (m, 3)."""
    used, which = np.unique(face, return_inverse=True)
    starts, parameters = _list_table(surfaces, used)
    owner = np.repeat(used, np.diff(starts))
    table = surfaces.surfaces.evaluate(owner, parameters)
    count = np.diff(starts)[which]
    nearest = np.zeros(len(face), np.intp)
    first = 0
    ends = np.cumsum(count)
    while first < len(face):
        checkpoint()
        done = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, done + PAIRS, side="right")))
        run, row = expand_runs(count[first:last], starts[which[first:last]])
        apart = table[row] - points[first:last][run]
        square = np.einsum("ij,ij->i", apart, apart)
        begins = np.cumsum(count[first:last]) - count[first:last]
        least = np.minimum.reduceat(square, begins)
        is_least = np.flatnonzero(square == least[run])
        nearest[first:last][run[is_least][::-1]] = row[is_least][::-1]
        first = last
    found: FloatArray = parameters[nearest]
    return found


def _list_table(surfaces: ClosedSurfaces, face: Ints) -> tuple[Ints, FloatArray]:
    """Parameters (m, 2) of a grid on each face: shares of all spans; and where each face begins."""
    count = surfaces.surfaces.faces.spans[:, face]
    divisions = np.maximum(2, -(-FEWEST // count))
    divisions = np.where(count * 2 > MOST, 1, divisions)
    axes = []
    for axis in range(2):
        run, span = expand_runs(count[axis])
        run_2, number = expand_runs(divisions[axis][run])
        low, high = surfaces.list_knots(face[run], axis, span)
        share = (number + 0.5) / divisions[axis][run][run_2]
        axes.append(low[run_2] + (high - low)[run_2] * share)
    u_count, v_count = count * divisions
    run, number = expand_runs(u_count * v_count)
    u = axes[0][find_starts(u_count)[run] + number // v_count[run]]
    v = axes[1][find_starts(v_count)[run] + number % v_count[run]]
    return find_starts(u_count * v_count), np.stack([u, v], axis=1)
