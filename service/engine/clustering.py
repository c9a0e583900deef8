"""Groups: of rows that have the same key and nearly the same value, and of numbers by pairs."""

import numpy as np

from service.bases.arrays import AnyInts, Ints, RealArray
from service.cancellation import checkpoint
from service.engine.vectors import dot

MAX_ROUNDS = 64
"""The most groups of one key. Each row that then remains leads a group of its own. This is no
error, but fewer vertices are shared. Only the apex of a finely divided cone has this many
groups."""


def find_leaders(key: AnyInts, values: RealArray, radius: float) -> Ints:
    """For each row, the leader of its group: one row of the group.

    The row whose number is a key leads a group; all rows with this key whose values are at most
    `radius` from the leader's value belong to the group. The first of the remaining rows leads the
    next group of this key.

    Parameters
    ----------
    key : ndarray of int, shape (N,)
        Only rows with equal keys are grouped. A key is the number of one of the rows that have it.
    values : ndarray, shape (N, d)
    radius : float
        Euclidean distance. Equal values are at distance 0 exactly, so with radius 0 only equal
        values are grouped.

    Returns
    -------
    ndarray of int, shape (N,)
        Numbers of rows. A leader is its own leader: `leader[leader]` equals `leader`.
    """
    leader = np.arange(len(key))
    remaining = np.flatnonzero(key != leader)
    candidates = key[remaining]
    for _ in range(MAX_ROUNDS if len(remaining) else 0):
        step = values[remaining] - values[candidates]
        is_near = dot(step, step, -1) <= radius**2
        leader[remaining[is_near]] = candidates[is_near]
        remaining = remaining[~is_near]
        if not len(remaining):
            break
        # For each remaining row: the first remaining row with its key.
        _, first, inverse = np.unique(key[remaining], return_index=True, return_inverse=True)
        candidates = remaining[first][inverse]
    return leader


def find_components(count: int, first_vertices: Ints, second_vertices: Ints) -> Ints:
    """Connected components of a graph of `count` vertices: the least vertex of each, (count,).

    Its edges join the vertices `first_vertices` (k,) with `second_vertices` (k,).
    """
    label = np.arange(count)
    while True:
        checkpoint()
        smaller_label = np.minimum(label[first_vertices], label[second_vertices])
        next_label = label.copy()
        for ends in (first_vertices, second_vertices):
            np.minimum.at(next_label, label[ends], smaller_label)
        while not np.array_equal(next_label[next_label], next_label):
            next_label = next_label[next_label]
        if np.array_equal(next_label, label):
            return label
        label = next_label


class DisjointSets:
    """Sets of the numbers 0, 1, …, at first one set for each number, that pairs unite (union-find).

    The lowest number of a set is its root.
    """

    def __init__(self, count: int) -> None:
        self._parents = list(range(count))

    def find_root(self, number: int) -> int:
        """The root of the set of a number."""
        parents = self._parents
        while parents[number] != number:
            parents[number] = parents[parents[number]]  # shortens the way for later searches
            number = parents[number]
        return number

    def unite(self, first: int, second: int) -> bool:
        """Unite the sets of two numbers; returns whether they were different sets."""
        low, high = sorted((self.find_root(first), self.find_root(second)))
        self._parents[high] = low
        return low != high

    def list_roots(self) -> list[int]:
        """The root of each number."""
        return [self.find_root(number) for number in range(len(self._parents))]
