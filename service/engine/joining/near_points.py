"""Groups of points that are equal up to rounding.

Two points are near if their distance is at most `reach`. Components are the connected components of
the graph of near points. A component whose points are all near one another is a group. A wider
component is not a group, because no point could represent all of its points; groups within it are
found with 1/8 of `reach`, then with 1/64 and so on. So the two ends of a short edge stay two
points, and points that differ from an end by rounding alone form a group with it.
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.unique_rows import unique_rows
from service.engine.mesh.equal_points import find_possible_neighbours

ROUNDS = 8
"""Rounds of separating points by gaps along x, y and z: few need more than one."""

MAX_CROWD = 16
"""The most points of a crowd, which no gap along an axis divides and which is wider than `reach`:
all pairs of a crowd are compared. More points are not a group."""

CHUNK = 1 << 12
"""Crowds in one chunk of comparisons."""

FINER, LEVELS = 1 / 8, 4
"""Factor of `reach` from one search within wide components to the next, and the number of
searches."""


def group_near_points(points: FloatArray, reach: float) -> Ints:
    """For each point (N, 3) the first point of its group; equal points are always in one group.

    Which points form a group does not depend on their order.
    """
    first, number = unique_rows(points)
    leader, remaining = np.arange(len(first)), find_possible_neighbours(points[first], reach)
    remaining.sort()  # leaders are the first points of their groups
    for _ in range(LEVELS if len(remaining) else 0):
        lead, is_wide = _groups(points[first[remaining]], reach)
        leader[remaining] = remaining[lead]
        remaining = remaining[is_wide]
        if not len(remaining):
            break
        reach *= FINER
    least = np.full(len(first), len(points))
    np.minimum.at(least, leader, first)
    return least[leader][number]


def _groups(points: FloatArray, reach: float) -> tuple[Ints, Bools]:
    """The first point of each point's group (N,), and whether it may be in a wide component."""
    group = _gap_groups(points, reach)
    order = np.argsort(group, kind="stable")
    starts = run_starts(group[order])
    sizes = np.diff(starts, append=len(order))
    ordered = points[order]
    low, high = np.minimum.reduceat(ordered, starts), np.maximum.reduceat(ordered, starts)
    wide = np.square(high - low).sum(axis=1) > reach**2
    leader = np.arange(len(points))
    is_joined = np.repeat(~wide, sizes)
    leader[order[is_joined]] = np.repeat(order[starts], sizes)[is_joined]
    for size in range(2, MAX_CROWD + 1):
        crowds = starts[wide & (sizes == size), None] + np.arange(size)
        for begin in range(0, len(crowds), CHUNK):
            rows = order[crowds[begin : begin + CHUNK]]
            leader[rows] = np.take_along_axis(rows, _cliques(points[rows], reach), axis=1)
    is_left: Bools = np.zeros(len(points), dtype=bool)
    is_left[order[~is_joined]] = True
    is_left &= np.bincount(leader, minlength=len(points))[leader] == 1
    return leader, is_left


def run_starts(ordered: Ints) -> Ints:
    """Where runs of equal numbers begin, (R,)."""
    begins = np.ones(len(ordered), dtype=bool)
    np.not_equal(ordered[1:], ordered[:-1], out=begins[1:])
    starts: Ints = begins.nonzero()[0]
    return starts


def _gap_groups(points: FloatArray, reach: float) -> Ints:
    """Numbers (N,) of groups between which there are gaps along an axis, wider than `reach`."""
    group = np.zeros(len(points), dtype=np.intp)
    remaining = np.arange(len(points))
    for _ in range(ROUNDS):
        before = len(np.unique(group))
        for axis in range(3):
            coordinate = points[remaining, axis]
            order = np.lexsort((coordinate, group[remaining]))
            remaining, coordinate = remaining[order], coordinate[order]
            begins = np.ones(len(remaining), dtype=bool)
            begins[1:] = (group[remaining[1:]] != group[remaining[:-1]]) | (
                coordinate[1:] - coordinate[:-1] > reach
            )
            # Groups that are final have numbers below zero.
            group[remaining] = np.cumsum(begins) - 1
            ends = np.append(begins[1:], True)
            is_single = begins & ends
            group[remaining[is_single]] = -1 - remaining[is_single]
            remaining = remaining[~is_single]
            if not len(remaining):
                return group
        if len(np.unique(group)) == before:
            break
    return group


def _cliques(points: FloatArray, reach: float) -> Ints:
    """The first point of each point's component in crowds (G, m, 3), itself if that is wide."""
    differences = points[:, :, None] - points[:, None]
    near: Bools = np.square(differences).sum(axis=3) <= reach**2
    joined = near
    for _ in range(MAX_CROWD.bit_length() - 1):
        joined = np.matmul(joined.astype(np.float32), joined.astype(np.float32)) > 0
    has_far = np.logical_or.reduce(joined & ~near, axis=2)
    is_wide = np.logical_or.reduce(joined & has_far[:, None], axis=2)
    return np.where(is_wide, np.arange(points.shape[1]), joined.argmax(axis=2))
