"""Pairs of boxes of places that meet, in a number of steps that does not grow with their squares.

Boxes are sorted by their least x; those whose x overlap stand together. Where these are too many,
the boxes are sorted along a Z-order curve, and four at a time get a box about them, and so on: a
tree in arrays, which other boxes descend together, level by level.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from service.bases.arrays import Bools, Ints
from service.bases.row_batches import expand_runs, row_slices
from service.cancellation import checkpoint
from service.engine.trims.places import BITS

FEW = 64
"""Up to this number of pairs with common x for each box are compared, before there is a tree."""

BRANCHES = 4
"""Boxes below each box of the tree."""

PAIRS = 1 << 17
"""Pairs that are compared together, about: it limits memory."""

CHUNK = 1 << 9
"""Boxes that descend together: it limits memory, also where all boxes meet each other."""

COARSE = 16
"""Bits of the coordinates by which boxes are sorted."""

_SHIFT = BITS + 2
"""The number of a face stands before the bits of x: boxes of other faces are far away."""

_NONE = np.zeros(0, np.intp)


@dataclass(frozen=True, eq=False)
class BoxTree:
    """n boxes of places of faces, for finding those that meet other boxes.

    Boxes may reach beyond places by half of their range.

    Attributes
    ----------
    faces : ndarray of int, shape (n,)
    boxes : ndarray of int, shape (4, n)
        The least coordinates and the greatest ones, negated; x with the number of the face.
    """

    faces: Ints
    boxes: Ints

    @classmethod
    def of(cls, faces: Ints, low: Ints, high: Ints) -> "BoxTree":
        """Boxes [low, high], shape (n, 2) each, of faces (n,)."""
        return cls(faces, _stack(faces, low, high))

    def find_pairs(self, faces: Ints, low: Ints, high: Ints) -> tuple[Ints, Ints]:
        """All pairs of a box [low, high], (m, 2) each, of a face and a box of the tree that meet.

        Boxes meet if they have a point in common and are of one face.

        Returns
        -------
        box, own : ndarray of int, shape (k,)
            Rows of `low` in ascending order, and numbers of boxes of the tree.
        """
        if not (len(self.faces) and len(faces)):
            return _NONE, _NONE
        boxes, (order, least) = _stack(faces, low, high), self._by_x
        begin = np.searchsorted(least, (faces << _SHIFT) - (1 << (_SHIFT - 1)))
        count = np.searchsorted(least, -boxes[2], side="right") - begin
        if int(count.sum()) <= FEW * (len(faces) + len(order)):
            parts = [
                _keep_meeting(boxes, self.boxes, box, order[at])
                for box, at in _list_pairs(count, begin)
            ]
        else:
            parts = [
                self._descend(boxes[:, rows], _NONE, rows.start)
                for rows in row_slices(len(faces), 1, CHUNK)
            ]
        box, own = (np.concatenate(part) for part in zip(*parts, strict=True))
        return box, own

    def list_own_pairs(self, is_done: Bools | None = None) -> Iterator[tuple[Ints, Ints]]:
        """All pairs of boxes of the tree that meet, each pair once, in several lists.

        Further lists have no boxes of faces that the caller marks in `is_done` (F,) meanwhile.
        """
        total = len(self.faces)
        if not total:
            return
        order, least = self._by_x
        begin = np.arange(1, total + 1)
        count = np.searchsorted(least, -self.boxes[2, order], side="right") - begin
        if int(count.sum()) <= FEW * total:
            for first, at in _list_pairs(count, begin):
                yield _keep_meeting(self.boxes, self.boxes, order[first], order[at])
            return
        order, levels = self._tree
        for rows in row_slices(total, 1, CHUNK):
            ranks = np.arange(total)[rows]
            if is_done is not None:
                ranks = ranks[~is_done[self.faces[order[ranks]]]]
            box, second = self._descend(levels[-1][:, ranks], ranks, 0)
            yield order[ranks[box]], second

    @cached_property
    def _by_x(self) -> tuple[Ints, Ints]:
        """The boxes in the order of their least x, and these."""
        order = self.boxes[0].argsort(kind="stable")
        return order, self.boxes[0, order]

    @cached_property
    def _tree(self) -> tuple[Ints, list[Ints]]:
        """The box at each leaf; and boxes (4, n_k) of each level, from the root to the leaves."""
        center = (self.boxes[:2] - self.boxes[2:]) >> 1
        center[0] -= self.faces << _SHIFT
        center = np.clip(center, 0, (1 << BITS) - 1) >> (BITS - COARSE)
        order = (self.faces << (2 * COARSE) | _interleave(center)).argsort(kind="stable")
        levels = [self.boxes.take(order, axis=1)]
        while levels[0].shape[1] > 1:
            begins = np.arange(0, levels[0].shape[1], BRANCHES)
            levels.insert(0, np.minimum.reduceat(levels[0], begins, axis=1))
        return order, levels

    def _descend(self, boxes: Ints, ranks: Ints, start: int) -> tuple[Ints, Ints]:
        """Pairs of boxes (4, m), numbered from `start`, and boxes of the tree.

        If there are `ranks` (m,), only leaves of a greater rank count.
        """
        order, levels = self._tree
        box, node = np.arange(boxes.shape[1]), np.zeros(boxes.shape[1], np.intp)
        below = BRANCHES ** (len(levels) - 1)
        for depth, level in enumerate(levels):
            if depth:
                box = box.repeat(BRANCHES)
                node = (node[:, np.newaxis] * BRANCHES + np.arange(BRANCHES)).ravel()
                below //= BRANCHES
                inside = node < level.shape[1]
                box, node = box[inside], node[inside]
            if len(ranks):
                after = (node + 1) * below - 1 > ranks[box]
                box, node = box[after], node[after]
            box, node = _keep_meeting(boxes, level, box, node)
        return box + start, order[node]


def _list_pairs(count: Ints, begin: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Pairs of a row i and one of `count[i]` numbers from `begin[i]` on, in several lists."""
    ends = count.cumsum()
    if int(ends[-1]) <= PAIRS:
        yield expand_runs(count, begin)
        return
    splits = np.searchsorted(ends, np.arange(PAIRS, int(ends[-1]), PAIRS))
    for first, last in pairwise([0, *np.unique(splits).tolist(), len(count)]):
        checkpoint()
        run, number = expand_runs(count[first:last], begin[first:last])
        yield run + first, number


def _stack(faces: Ints, low: Ints, high: Ints) -> Ints:
    """Boxes as rows (4, n): least coordinates, and greatest ones, negated."""
    boxes = np.empty((4, len(faces)), np.int64)
    boxes[:2] = low.T
    np.negative(high.T, out=boxes[2:])
    shift = faces << _SHIFT
    boxes[0] += shift
    boxes[2] -= shift
    return boxes


def _keep_meeting(boxes: Ints, others: Ints, box: Ints, other: Ints) -> tuple[Ints, Ints]:
    """The pairs, columns of `boxes` and of `others`, that meet."""
    for row in (1, 3, 0, 2):
        # The least coordinate of one is at most the greatest of the other.
        meets = boxes[row].take(box) <= -others[(row + 2) % 4].take(other)
        box, other = box[meets], other[meets]
    return box, other


def _interleave(places: Ints) -> Ints:
    """The bits of two coordinates (2, n), below 2^16, in turn."""
    bits = places.astype(np.int64)
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        bits = (bits | bits << shift) & mask
    mixed: Ints = bits[0] | bits[1] << 1
    return mixed
