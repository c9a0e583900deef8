"""Keeps edges shared when patches are elevated, also if their weights differ by a common factor.

On such an edge both patches have the same curve, but after elevation their control points may
differ in the last digits. Patches share an edge only if all digits are equal, so the points of one
patch are copied to the other.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.polynomials import Net
from service.bases.row_batches import unique_rows
from service.bases.triangle import degree_of, side_rows
from service.surface.sides import take_side

SAME_WEIGHT = 2.0**-44
"""Weights of an edge in two patches count as equal up to a factor if they differ by at most this
number, after both are scaled to a largest weight of 1."""


@dataclass(frozen=True, eq=False, slots=True)
class _Side:
    """One side of all patches of a batch.

    Attributes
    ----------
    points : ndarray of float64, shape (P, m+1, 3)
        Points of the side before elevation.
    weights : ndarray of float64, shape (P, m+1)
        Weights of the side before elevation.
    elevated : ndarray of float64
        Points after elevation, a view that `write` changes: of the side, shape (P, n+1, 3), for
        grids; of the whole net for triangles.
    rows : ndarray of int, shape (n+1,), or None
        For triangles, the rows of the net on this side.
    """

    points: FloatArray
    weights: FloatArray
    elevated: FloatArray
    rows: Ints | None = None

    @property
    def new_points(self) -> FloatArray:
        """The points of the side after elevation, shape (P, n+1, 3)."""
        return self.elevated if self.rows is None else self.elevated[:, self.rows]

    def write(self, values: FloatArray) -> None:
        """Replace the points of the side after elevation."""
        if self.rows is None:
            self.elevated[...] = values
        else:
            self.elevated[:, self.rows] = values


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
            list_sides = _sides_of_grids if points.ndim == 4 else _sides_of_triangles
            for side in list_sides(points, weights, elevated):
                point_counts = side.points.shape[1], side.new_points.shape[1]
                groups.setdefault(point_counts, []).append(side)
    for sides in groups.values():
        _match_sides(sides)


def _sides_of_grids(
    points: FloatArray, weights: FloatArray, elevated: FloatArray
) -> Iterator[_Side]:
    for side in range(4):
        yield _Side(take_side(points, side), take_side(weights, side), take_side(elevated, side))


def _sides_of_triangles(
    points: FloatArray, weights: FloatArray, elevated: FloatArray
) -> Iterator[_Side]:
    old, new = (side_rows(degree_of(net.shape[1])) for net in (points, elevated))
    for old_rows, new_rows in zip(old, new, strict=True):
        yield _Side(points[:, old_rows], weights[:, old_rows], elevated, new_rows)


def _match_sides(sides: list[_Side]) -> None:
    """Make elevated points equal on sides with equal points, and with weights equal up to a factor.

    All sides have the same degree before elevation, and the same after it.
    """
    old_points = np.concatenate([side.points for side in sides])
    weights = np.concatenate([side.weights for side in sides])
    new_points = np.concatenate([side.new_points for side in sides])
    # An edge may run in opposite directions in two patches: give all sides a common direction.
    is_reversed = _find_reversed(old_points)
    for values in (old_points, weights, new_points):
        _reverse_rows(values, is_reversed)
    first_equal = _find_first_equal(old_points)
    weights /= weights.max(axis=1, keepdims=True)
    is_same = np.abs(weights - weights[first_equal]).max(axis=1) <= SAME_WEIGHT
    new_points[is_same] = new_points[first_equal[is_same]]
    _reverse_rows(new_points, is_reversed)
    ends = np.cumsum([len(side.points) for side in sides])
    for side, values in zip(sides, np.split(new_points, ends[:-1]), strict=True):
        side.write(values)


def _find_first_equal(sides: FloatArray) -> Ints:
    """For each side, the number of the first side with the same points: shape (N,)."""
    first, number = unique_rows(sides.reshape(len(sides), -1))
    first_equal: Ints = first[number]
    return first_equal


def _find_reversed(sides: FloatArray) -> Bools:
    """Which sides must be reversed to get a common direction, shape (N,).

    Of both directions of a side, the common one comes first in the lexicographic order of its
    numbers.
    """
    forwards = sides.reshape(len(sides), -1)
    backwards = sides[:, ::-1].reshape(forwards.shape)
    # The first number of each side that differs between both directions.
    positions = np.arange(len(sides)), (forwards != backwards).argmax(axis=1)
    is_reversed: Bools = forwards[positions] > backwards[positions]
    return is_reversed


def _reverse_rows(sides: FloatArray, is_reversed: Bools) -> None:
    """Reverse some of the sides, in place."""
    sides[is_reversed] = sides[is_reversed, ::-1]
