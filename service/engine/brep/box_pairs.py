"""Pairs of boxes of places that meet, in a number of steps that does not grow with their squares.

The boxes of a list are sorted along a Z-order curve, and four at a time get a box about them, and
so on: a tree in arrays. Other boxes descend it together, level by level.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Ints
from service.bases.row_batches import row_slices
from service.engine.trims.places import BITS

BRANCHES = 4
"""Boxes below each box of the tree."""

CHUNK = 1 << 9
"""Boxes that descend together: it limits memory, also where all boxes meet each other."""

COARSE = 16
"""Bits of the coordinates by which boxes are sorted."""


@dataclass(frozen=True, eq=False, slots=True)
class BoxTree:
    """n boxes of places of faces, for finding those that meet other boxes.

    Attributes
    ----------
    order : ndarray of int, shape (n,)
        The box at each leaf.
    levels : list of ndarray of int, shape (4, n_k)
        For each level, from the root to the leaves: the least coordinates and the greatest ones,
        negated. The first coordinate has the number of the face in its high bits.
    """

    order: Ints
    levels: list[Ints]

    @classmethod
    def of(cls, faces: Ints, low: Ints, high: Ints) -> "BoxTree":
        """The tree of boxes [low, high], shape (n, 2) each, of faces (n,)."""
        center = np.clip((low + high) >> 1, 0, (1 << BITS) - 1) >> (BITS - COARSE)
        order = (faces << (2 * COARSE) | _interleave(center)).argsort(kind="stable")
        levels = [_stack(faces, low, high).take(order, axis=1)]
        while levels[0].shape[1] > 1:
            begins = np.arange(0, levels[0].shape[1], BRANCHES)
            levels.insert(0, np.minimum.reduceat(levels[0], begins, axis=1))
        return cls(order, levels)

    def find_pairs(self, faces: Ints, low: Ints, high: Ints) -> tuple[Ints, Ints]:
        """All pairs of a box [low, high], (m, 2) each, of a face and a box of the tree that meet.

        Boxes meet if they have a point in common and are of one face.

        Returns
        -------
        box, own : ndarray of int, shape (k,)
            Rows of `low` in ascending order, and numbers of boxes of the tree.
        """
        if not len(self.order):
            return _join([])
        boxes = _stack(faces, low, high)
        found = [
            self._descend(boxes[:, rows], np.zeros(0, np.intp), rows.start)
            for rows in row_slices(len(faces), 1, CHUNK)
        ]
        return _join(found)

    def list_own_pairs(self) -> Iterator[tuple[Ints, Ints]]:
        """All pairs of boxes of the tree that meet, each pair once, in several lists."""
        leaves = self.levels[-1]
        count = leaves.shape[1]
        for rows in row_slices(count, 1, CHUNK):
            rank, second = self._descend(leaves[:, rows], np.arange(count)[rows], rows.start)
            yield self.order[rank], second

    def _descend(self, boxes: Ints, ranks: Ints, start: int) -> tuple[Ints, Ints]:
        """Pairs of boxes (4, m), numbered from `start`, and boxes of the tree.

        If there are `ranks` (m,), only leaves of a greater rank count.
        """
        opposite = -boxes[[2, 3, 0, 1]]
        box, node = np.arange(boxes.shape[1]), np.zeros(boxes.shape[1], np.intp)
        below = BRANCHES ** (len(self.levels) - 1)
        for depth, level in enumerate(self.levels):
            if depth:
                box = box.repeat(BRANCHES)
                node = (node[:, np.newaxis] * BRANCHES + np.arange(BRANCHES)).ravel()
                below //= BRANCHES
                inside = node < level.shape[1]
                box, node = box[inside], node[inside]
            if len(ranks):
                after = (node + 1) * below - 1 > ranks[box]
                box, node = box[after], node[after]
            # low ≤ high of the other, for both.
            meets = (level.take(node, axis=1) <= opposite.take(box, axis=1)).all(axis=0)
            box, node = box[meets], node[meets]
        return box + start, self.order[node]


def _stack(faces: Ints, low: Ints, high: Ints) -> Ints:
    """Boxes as rows (4, n): least coordinates, and greatest ones, negated."""
    boxes = np.empty((4, len(faces)), np.int64)
    boxes[:2], boxes[2:] = low.T, -high.T
    # Boxes of other faces are far away; boxes may reach beyond places by half of their range.
    shift = faces << (BITS + 2)
    boxes[0] += shift
    boxes[2] -= shift
    return boxes


def _interleave(places: Ints) -> Ints:
    """The bits of two coordinates (n, 2), below 2^16, in turn."""
    bits = places.astype(np.int64)
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        bits = (bits | bits << shift) & mask
    mixed: Ints = bits[:, 0] | bits[:, 1] << 1
    return mixed


def _join(found: list[tuple[Ints, Ints]]) -> tuple[Ints, Ints]:
    """Several lists of pairs as one."""
    if len(found) == 1:
        return found[0]
    if not found:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    first, second = zip(*found, strict=True)
    return np.concatenate(first), np.concatenate(second)
