"""Keeps edges shared when patches are elevated, also if their weights differ by a common factor.

On such an edge both patches have the same curve, but after elevation their control points may
differ in the last digits. Patches share an edge only if all digits are equal, so the points of one
patch are copied to the other.
"""

from typing import Any, NamedTuple

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.bases.polynomials import Net
from service.bases.row_batches import unique_rows
from service.bases.triangle import degree_of, side_rows

SAME_WEIGHT = 2.0**-44
"""Weights of an edge in two patches count as equal up to a factor if they differ by at most this
number, after both are scaled to a largest weight of 1."""


class _Side(NamedTuple):
    """One side of all patches of a batch.

    Attributes
    ----------
    points : ndarray of float64, shape (P, m+1, 3)
        Points of the side before elevation.
    weights : ndarray of float64, shape (P, m+1)
        Weights of the side before elevation.
    elevated : ndarray of float64
        All points of the batch after elevation; those of this side, shape (P, n+1, 3), are
        overwritten.
    place : tuple
        The index of the points of this side in `elevated`.
    """

    points: FloatArray
    weights: FloatArray
    elevated: FloatArray
    place: tuple[Any, ...]


def match_shared_edges(pairs: list[tuple[Net, FloatArray]]) -> None:
    """Make the elevated points of every edge equal in all patches that share the edge.

    Batches without weights need no change: elevation makes equal points of equal points.

    Parameters
    ----------
    pairs : list of (net, points)
        For each batch of grids or of triangles its nets before elevation, and its points after
        elevation. The points on shared edges are overwritten.
    """
    groups: dict[tuple[int, int], list[_Side]] = {}
    for (points, weights), elevated in pairs:
        if weights is not None:
            for old, new in zip(_index_sides(points), _index_sides(elevated), strict=True):
                side = _Side(points[old], weights[old], elevated, new)
                point_counts = side.points.shape[1], elevated[new].shape[1]
                groups.setdefault(point_counts, []).append(side)
    for sides in groups.values():
        _match_sides(sides)


def _index_sides(points: FloatArray) -> list[tuple[Any, ...]]:
    """For each side of grids (P, m, n, 3), or of triangles (P, K, 3), the index of its points.

    The four sides of grids have the order of `service.surface.sides`.
    """
    every = slice(None)
    if points.ndim == 4:
        return [(every, 0), (every, -1), (every, every, 0), (every, every, -1)]
    return [(every, rows) for rows in side_rows(degree_of(points.shape[1]))]


def _match_sides(sides: list[_Side]) -> None:
    """Make elevated points equal on sides with equal points, and with weights equal up to a factor.

    All sides have the same degree before elevation, and the same after it.
    """
    old_points = np.concatenate([side.points for side in sides])
    weights = np.concatenate([side.weights for side in sides])
    new_points = np.concatenate([side.elevated[side.place] for side in sides])
    # An edge may run in opposite directions in two patches: give all sides a common direction.
    is_reversed = _find_reversed(old_points)
    for values in (old_points, weights, new_points):
        _reverse_rows(values, is_reversed)
    # For each side, the number of the first side with the same points.
    first, number = unique_rows(old_points.reshape(len(old_points), -1))
    first_equal = first[number]
    weights /= weights.max(axis=1, keepdims=True)
    is_same = np.abs(weights - weights[first_equal]).max(axis=1) <= SAME_WEIGHT
    new_points[is_same] = new_points[first_equal[is_same]]
    _reverse_rows(new_points, is_reversed)
    ends = np.cumsum([len(side.points) for side in sides])
    for side, values in zip(sides, np.split(new_points, ends[:-1]), strict=True):
        side.elevated[side.place] = values


def _find_reversed(sides: FloatArray) -> Bools:
    """Which sides must be reversed to get a common direction, shape (N,).

    Of both directions of a side, the common one comes first in the lexicographic order of its
    numbers.
    """
    forwards = sides.reshape(len(sides), -1)
    backwards = sides[:, ::-1].reshape(forwards.shape)
    # The first number of each side that differs between both directions.
    positions = np.arange(len(sides)), (forwards != backwards).argmax(axis=1)
    return np.asarray(forwards[positions] > backwards[positions])


def _reverse_rows(sides: FloatArray, is_reversed: Bools) -> None:
    """Reverse some of the sides, in place."""
    sides[is_reversed] = sides[is_reversed, ::-1]
