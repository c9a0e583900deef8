"""Joins arcs to polylines that are as long as possible.

If two arcs meet at a node, they are joined. If 4, 6 or another even number of arcs meet, lines go
straight on: the arcs are ordered by their directions in the plane, and opposite arcs are joined. So
a figure of eight is one closed line, and two circles that cross are two closed lines. At other
nodes lines end. For sections of solids, lines turn instead: arcs that arrive are joined with arcs
that leave. So a figure of eight is two closed lines, each about one
piece of the material.

Arc a has two *halves*, one for each direction in which it can be followed: half 2 a begins at node
0 of the arc, half 2 a + 1 begins at its node 1. So `half ^ 1` is the half in the other direction,
and `half >> 1` is the arc.
"""

from collections.abc import Iterator
from math import cos

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import count_runs, find_begins
from service.cancellation import checkpoint

MAX_NODES = 64
"""The direction in which a line leaves a crossing is found from at most this number of nodes."""

CHECKPOINT_NODES = 4096
"""After this number of nodes of a polyline, the request can be cancelled."""


def join_arcs(
    ends: Ints,
    sense: FloatArray,
    positions: FloatArray,
    radius: float,
    *,
    turns: bool = False,
) -> Iterator[Ints]:
    """Join arcs to polylines: the nodes (k,) of each; if it is closed, the last repeats the first.

    Parameters
    ----------
    ends : ndarray of int, shape (A, 2)
        The nodes at the two ends of each arc.
    sense : ndarray of float64, shape (A,)
        Above 0 for arcs that should run from their node 0 to node 1 in a polyline, below 0 for the
        other direction, 0 if both are possible. The sum over a polyline decides its direction.
    positions : ndarray of float64, shape (N, 2)
        Coordinates of the nodes in the plane.
    radius : float
        At this distance from a crossing the directions of arcs are compared.
    turns : bool
        Whether lines turn where more than two arcs meet, rather than go straight on.
    """
    node = ends.ravel()
    mate = _find_mates(node, positions, radius, sense if turns else None)
    nodes, mates = node.tolist(), mate.tolist()
    senses = sense.tolist()
    is_done = bytearray(len(ends))
    order = np.argsort(node, kind="stable")
    # First the lines that begin at an end, then the closed lines, which begin anywhere.
    starts = [*order[mate[order] < 0].tolist(), *range(0, 2 * len(ends), 2)]
    for start in starts:
        if is_done[start >> 1]:
            continue
        half, path, sense_of_path = start, [nodes[start]], 0.0
        while True:
            if not len(path) % CHECKPOINT_NODES:
                checkpoint()
            arc = half >> 1
            is_done[arc] = 1
            sense_of_path += senses[arc] if half & 1 == 0 else -senses[arc]
            path.append(nodes[half ^ 1])
            half = mates[half ^ 1]
            if half < 0 or is_done[half >> 1]:
                break
        checkpoint()
        yield np.array(path if sense_of_path >= 0 else path[::-1])


def _find_mates(node: Ints, positions: FloatArray, radius: float, sense: FloatArray | None) -> Ints:
    """For each half, the other half that begins at its node and to which it is joined: (2 A,).

    It is −1 where lines end. `node` has the node at which each half begins. Lines turn if the
    senses of arcs are given.
    """
    order = np.argsort(node, kind="stable")
    mate = np.full(len(node), -1)
    # `order` lists the halves node by node: those of a node from `begins`, `counts` halves.
    begins = find_begins(node[order])
    counts = count_runs(begins, len(node))
    begins_of_two = begins[counts == 2]
    mate[order[begins_of_two]], mate[order[begins_of_two + 1]] = (
        order[begins_of_two + 1],
        order[begins_of_two],
    )
    crossings = np.flatnonzero((counts > 2) & (counts % 2 == 0))
    if len(crossings):
        mates_of_two = mate.copy()  # so that lines are followed only to the next crossing
        for k in crossings.tolist():
            checkpoint()
            halves = order[begins[k] : begins[k] + counts[k]]
            angles = [_find_angle(int(h), node, mates_of_two, positions, radius) for h in halves]
            by_angle = np.argsort(angles, kind="stable")
            halves = halves[by_angle]
            if sense is None:
                # Each half is joined to the opposite one.
                mate[halves] = np.roll(halves, len(halves) // 2)
                continue
            leaves = [_find_sense(int(h), mates_of_two, sense) for h in halves]
            for one, two in _pair_opposites(leaves, np.take(angles, by_angle).tolist()):
                mate[halves[one]], mate[halves[two]] = halves[two], halves[one]
    return mate


def _find_sense(half: int, mate: Ints, sense: FloatArray) -> int:
    """1 if the line that begins with a half leaves its node, −1 if it arrives, 0 if unknown."""
    for _ in range(MAX_NODES):
        along = float(sense[half >> 1]) * (1 if half & 1 == 0 else -1)
        if along:
            return 1 if along > 0 else -1
        half = int(mate[half ^ 1])
        if half < 0:
            break
    return 0


def _pair_opposites(leaves: list[int], angles: list[float]) -> Iterator[tuple[int, int]]:
    """Pairs of items with different senses, the largest angles between them first; then the rest.

    Of four lines at a crossing, each has the senses of its neighbours in turn, so two neighbours
    are joined. Lines that run there and back go on.
    """
    pairs = [(i, j) for j in range(len(leaves)) for i in range(j)]
    pairs.sort(key=lambda p: (leaves[p[0]] == leaves[p[1]], cos(angles[p[1]] - angles[p[0]])))
    left = set(range(len(leaves)))
    for one, two in pairs:
        if one in left and two in left:
            left -= {one, two}
            yield one, two


def _find_angle(half: int, node: Ints, mate: Ints, positions: FloatArray, radius: float) -> float:
    """The angle in the plane at which the line that begins with a half leaves its node."""
    begin = positions[node[half]]
    x = y = 0.0
    for _ in range(MAX_NODES):
        x, y = (positions[node[half ^ 1]] - begin).tolist()
        half = int(mate[half ^ 1])
        if half < 0 or x * x + y * y >= radius * radius:
            break
    return float(np.arctan2(y, x))
