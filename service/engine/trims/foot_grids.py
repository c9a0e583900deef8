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

HIGH = 6
"""Spans of this degree or a higher one may turn once and more: they have as many points as their
degree, if all spans of the axis together have at most `MOST`."""

MOST_NEAR = 16
"""The most points of a table from which the foot of one point is looked for."""

PAIRS = 1 << 18
"""The most points of tables, and distances from them, that are computed at once: some 30 MB."""


def find_nearest(surfaces: ClosedSurfaces, face: Ints, points: FloatArray) -> FloatArray:
    """The parameters (m, 2) of the nearest point of a table of each face, for points (m, 3)."""
    used, which = np.unique(face, return_inverse=True)
    order, found = which.argsort(kind="stable"), np.empty((len(face), 2))
    # Faces whose tables together have at most `PAIRS` points, and the points of these faces.
    starts = find_starts(_list_axes(surfaces, used)[0].prod(axis=0))
    first = 0
    while first < len(used):
        last = int(np.searchsorted(starts, starts[first] + PAIRS, side="right")) - 1
        last = max(first + 1, last)
        rows = order[slice(*np.searchsorted(which[order], [first, last]))]
        found[rows] = _find_in_tables(surfaces, used[first:last], which[rows] - first, points[rows])
        first = last
    return found


def _find_in_tables(
    surfaces: ClosedSurfaces, used: Ints, which: Ints, points: FloatArray
) -> FloatArray:
    """The nearest parameters (m, 2) in the tables of faces `used[which]` (m,)."""
    starts, parameters = _list_table(surfaces, used)
    owner = np.repeat(used, np.diff(starts))
    table = surfaces.surfaces.evaluate(owner, parameters)
    count = np.diff(starts)[which]
    nearest = np.zeros(len(which), np.intp)
    first = 0
    ends = np.cumsum(count)
    while first < len(which):
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


def list_near(surfaces: ClosedSurfaces, face: Ints, points: FloatArray) -> tuple[Ints, FloatArray]:
    """For points (m, 3), up to `MOST_NEAR` points of the table that are nearer than all around.

    On each turn of a screw there is one. Numbers of points (k,), ascending, and parameters (k, 2).
    """
    owners, found = [np.zeros(0, np.intp)], [np.zeros((0, 2))]
    for one in np.unique(face):
        rows = (face == one).nonzero()[0]
        axes = _list_axes(surfaces, np.array([one]))[1]
        u, v = np.meshgrid(*axes, indexing="ij")
        parameters = np.stack([u.ravel(), v.ravel()], axis=1)
        table = surfaces.surfaces.evaluate(np.full(len(parameters), one), parameters)
        size = max(1, PAIRS // len(table))
        for first in range(0, len(rows), size):
            checkpoint()
            chosen = rows[first : first + size]
            rest = table - points[chosen, np.newaxis]
            square = np.einsum("ijk,ijk->ij", rest, rest)
            number, at = _find_minima(square.reshape(len(chosen), len(axes[0]), len(axes[1])))
            owners.append(chosen[number])
            found.append(parameters[at])
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return owner[order], np.concatenate(found)[order]


def _find_minima(square: FloatArray) -> tuple[Ints, Ints]:
    """The least of the local minima in each table of (m, U, V): number, and place in the table."""
    padded = np.pad(square, ((0, 0), (1, 1), (1, 1)), constant_values=np.inf)
    is_least = np.ones(square.shape, bool)
    u_count, v_count = square.shape[1:]
    for i in range(3):
        for j in range(3):
            is_least &= square <= padded[:, i : i + u_count, j : j + v_count]
    values = np.where(is_least, square, np.inf).reshape(len(square), -1)
    most = min(MOST_NEAR, values.shape[1])
    at = np.argpartition(values, most - 1, axis=1)[:, :most]
    number, column = np.isfinite(np.take_along_axis(values, at, axis=1)).nonzero()
    return number, at[number, column]


def _list_table(surfaces: ClosedSurfaces, face: Ints) -> tuple[Ints, FloatArray]:
    """Parameters (m, 2) of a grid on each face: shares of all spans; and where each face begins."""
    (u_count, v_count), axes = _list_axes(surfaces, face)
    run, number = expand_runs(u_count * v_count)
    u = axes[0][find_starts(u_count)[run] + number // v_count[run]]
    v = axes[1][find_starts(v_count)[run] + number % v_count[run]]
    return find_starts(u_count * v_count), np.stack([u, v], axis=1)


def _list_axes(surfaces: ClosedSurfaces, face: Ints) -> tuple[Ints, list[FloatArray]]:
    """The number of grid points of each face along both axes, (2, n), and their parameters."""
    faces, nets = surfaces.surfaces.faces, surfaces.surfaces.nets
    count = faces.spans[:, face]
    degrees = np.array([group.degree for group in nets.groups]).reshape(-1, 2)
    degree = degrees[nets.group[faces.first[face]]].T
    divisions = np.maximum(2, -(-FEWEST // count))
    more = np.minimum(degree, MOST // count)
    divisions = np.where(degree >= HIGH, np.maximum(divisions, more), divisions)
    divisions = np.where(count * 2 > MOST, 1, divisions)
    axes = []
    for axis in range(2):
        run, span = expand_runs(count[axis])
        run_2, number = expand_runs(divisions[axis][run])
        low, high = surfaces.list_knots(face[run], axis, span)
        share = (number + 0.5) / divisions[axis][run][run_2]
        axes.append(low[run_2] + (high - low)[run_2] * share)
    return count * divisions, axes
