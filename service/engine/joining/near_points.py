"""Groups of points that are equal up to rounding.

Two points are near if their distance is at most `radius`. Components are the connected components
of the graph of near points. A component whose points are all near each other is a group. A wider
component is not a group, because no single point could represent all its points. The groups within
a wider component are found with 1/8 of `radius`, then with 1/64 and so on. So if an edge is about
as long as `radius`, and its ends are not near each other although points around them are, the ends
stay two points, and points that differ from an end by rounding alone form a group with it.
"""

import numpy as np

from service.bases.arrays import AnyInts, Bools, FloatArray, Ints
from service.bases.row_batches import count_runs, unique_rows
from service.engine.connectivity.equal_points import find_possible_neighbours

MAX_ROUNDS = 8
"""The most rounds of separating points by gaps along x, y and z. Few models need more than one."""

MAX_CROWD = 16
"""The most points of a crowd whose pairs are all compared. A crowd is a set of points that is wider
than `radius` and that no gap along an axis divides. A search finds no groups in a larger crowd, but
the next, finer search may divide the crowd."""

CHUNK = 1 << 12
"""The number of crowds whose pairs are compared together."""

REACH_FACTOR, MAX_SEARCHES = 1 / 8, 4
"""Each search within wide components multiplies `radius` by this factor; and the most searches."""


def group_near_points(points: FloatArray, radius: float) -> Ints:
    """For each point (N, 3), the number of the first point of its group, (N,).

    Equal points are always in one group. The groups do not depend on the order of the points.
    """
    first, number = unique_rows(points)
    leader, remaining = np.arange(len(first)), find_possible_neighbours(points[first], radius)
    remaining.sort()  # so that leaders do not depend on the order of the search
    for _ in range(MAX_SEARCHES if len(remaining) else 0):
        leader_of_remaining, is_wide = _find_groups(points[first[remaining]], radius)
        leader[remaining] = remaining[leader_of_remaining]
        remaining = remaining[is_wide]
        if not len(remaining):
            break
        radius *= REACH_FACTOR
    # Distinct points are not in the order of `points`, so a leader need not be the first there.
    first_points = np.full(len(first), len(points))
    np.minimum.at(first_points, leader, first)
    return first_points[leader][number]


def _find_groups(points: FloatArray, radius: float) -> tuple[Ints, Bools]:
    """For each point (N,), the first point of its group, and whether a finer search may help."""
    set_number = _separate_by_gaps(points, radius)
    order = np.argsort(set_number, kind="stable")
    starts = run_starts(set_number[order])
    sizes = count_runs(starts, len(order))
    ordered = points[order]
    low, high = np.minimum.reduceat(ordered, starts), np.maximum.reduceat(ordered, starts)
    is_wide = np.square(high - low).sum(axis=1) > radius**2
    leader = np.arange(len(points))
    is_joined = np.repeat(~is_wide, sizes)
    leader[order[is_joined]] = np.repeat(order[starts], sizes)[is_joined]
    # Crowds of equal size are compared together.
    for size in range(2, MAX_CROWD + 1):
        crowds = starts[is_wide & (sizes == size), None] + np.arange(size)
        for begin in range(0, len(crowds), CHUNK):
            rows = order[crowds[begin : begin + CHUNK]]
            leader[rows] = np.take_along_axis(
                rows, _find_leaders_in_crowds(points[rows], radius), axis=1
            )
    is_ungrouped: Bools = np.zeros(len(points), dtype=bool)
    is_ungrouped[order[~is_joined]] = True
    is_ungrouped &= np.bincount(leader, minlength=len(points))[leader] == 1
    return leader, is_ungrouped


def run_starts(ordered: AnyInts) -> Ints:
    """The positions where runs of equal numbers begin, (R,)."""
    is_first = np.ones(len(ordered), dtype=bool)
    np.not_equal(ordered[1:], ordered[:-1], out=is_first[1:])
    return is_first.nonzero()[0]


def _separate_by_gaps(points: FloatArray, radius: float) -> Ints:
    """The number of the set of each point, (N,).

    A gap wider than `radius` along an axis divides a set. A set without a gap is a group, a crowd
    or a single point.
    """
    set_number = np.zeros(len(points), dtype=np.intp)
    remaining = np.arange(len(points))
    for _ in range(MAX_ROUNDS):
        set_count = len(np.unique(set_number))
        for axis in range(3):
            coordinate = points[remaining, axis]
            order = np.lexsort((coordinate, set_number[remaining]))
            remaining, coordinate = remaining[order], coordinate[order]
            is_first = np.ones(len(remaining), dtype=bool)
            is_first[1:] = (set_number[remaining[1:]] != set_number[remaining[:-1]]) | (
                coordinate[1:] - coordinate[:-1] > radius
            )
            # Single points are final, and get numbers below zero.
            set_number[remaining] = np.cumsum(is_first) - 1
            is_single = is_first & np.append(is_first[1:], True)
            set_number[remaining[is_single]] = -1 - remaining[is_single]
            remaining = remaining[~is_single]
            if not len(remaining):
                return set_number
        if len(np.unique(set_number)) == set_count:
            break
    return set_number


def _find_leaders_in_crowds(points: FloatArray, radius: float) -> Ints:
    """For each point of G crowds (G, m, 3), the first point of its component, or itself; (G, m).

    Points are numbered within their crowd. A point of a component that is not a group gets itself.
    """
    differences = points[:, :, None] - points[:, None]
    is_near: Bools = np.square(differences).sum(axis=3) <= radius**2
    # Each product doubles the length of the paths of near points.
    is_connected = is_near
    for _ in range(MAX_CROWD.bit_length() - 1):
        is_connected = (
            np.matmul(is_connected.astype(np.float32), is_connected.astype(np.float32)) > 0
        )
    has_far = np.logical_or.reduce(is_connected & ~is_near, axis=2)
    is_wide = np.logical_or.reduce(is_connected & has_far[:, None], axis=2)
    return np.where(is_wide, np.arange(points.shape[1]), is_connected.argmax(axis=2))
