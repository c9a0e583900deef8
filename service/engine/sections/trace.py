"""Joins arcs to polylines that are as long as possible.

At a node with two arcs these are joined. At a node with 4, 6 or more arcs lines go straight on: the
arcs are ordered by their directions in the plane, and opposite ones are joined. So a figure of
eight is one closed line, and two circles that cross are two. At other nodes lines end.

An arc a is walked as two halves, 2 a and 2 a + 1: the first begins at its node 0, the second at its
node 1. So `half ^ 1` is the other half of an arc, and `half >> 1` is the arc.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint

FAR = 64
"""The most nodes that determine the direction in which an arc leaves a crossing."""

CHECKED = 4096
"""Nodes of a polyline after which the cancellation is checked."""


@dataclass(frozen=True, eq=False, slots=True)
class Line:
    """Nodes of a polyline (k,); if it is closed, the last node repeats the first."""

    nodes: Ints
    closed: bool


def join_arcs(ends: Ints, sense: FloatArray, places: FloatArray, reach: float) -> Iterator[Line]:
    """Join arcs to polylines.

    Parameters
    ----------
    ends : ndarray of int, shape (A, 2)
        The nodes at the two ends of each arc.
    sense : ndarray of float64, shape (A,)
        Above 0 for arcs in the direction of their polyline, below 0 for arcs against it.
    places : ndarray of float64, shape (N, 2)
        Coordinates of the nodes in the plane.
    reach : float
        Distance from a crossing at which the directions of arcs are compared.
    """
    node = ends.ravel()
    mate = _mates(node, places, reach)
    nodes, following = node.tolist(), mate.tolist()
    senses = sense.tolist()
    done = bytearray(len(ends))
    order = np.argsort(node, kind="stable")
    starts = [*order[mate[order] < 0].tolist(), *range(0, 2 * len(ends), 2)]
    for start in starts:
        if done[start >> 1]:
            continue
        half, path, votes = start, [nodes[start]], 0.0
        while True:
            if not len(path) % CHECKED:
                checkpoint()
            arc = half >> 1
            done[arc] = 1
            votes += senses[arc] if half & 1 == 0 else -senses[arc]
            path.append(nodes[half ^ 1])
            half = following[half ^ 1]
            if half < 0 or done[half >> 1]:
                break
        checkpoint()
        line = np.array(path if votes >= 0 else path[::-1])
        yield Line(line, path[0] == path[-1])


def _mates(node: Ints, places: FloatArray, reach: float) -> Ints:
    """For each half of an arc, (2 A,), the half that follows at its node, or −1 at line ends."""
    order = np.argsort(node, kind="stable")
    mate = np.full(len(node), -1)
    begins = np.flatnonzero(np.diff(node[order], prepend=-1))
    counts = np.diff(begins, append=len(node))
    twos = begins[counts == 2]
    mate[order[twos]], mate[order[twos + 1]] = order[twos + 1], order[twos]
    crossings = np.flatnonzero((counts > 2) & (counts % 2 == 0))
    if len(crossings):
        simple = mate.copy()
        for k in crossings.tolist():
            checkpoint()
            halves = order[begins[k] : begins[k] + counts[k]]
            angles = [_direction(int(h), node, simple, places, reach) for h in halves]
            halves = halves[np.argsort(angles, kind="stable")]
            mate[halves] = np.roll(halves, len(halves) // 2)
    return mate


def _direction(half: int, node: Ints, mate: Ints, places: FloatArray, reach: float) -> float:
    """The angle at which a line that begins with a half of an arc leaves its node."""
    begin = places[node[half]]
    x = y = 0.0
    for _ in range(FAR):
        x, y = (places[node[half ^ 1]] - begin).tolist()
        half = int(mate[half ^ 1])
        if half < 0 or x * x + y * y >= reach * reach:
            break
    return float(np.arctan2(y, x))
