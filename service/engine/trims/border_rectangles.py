"""Which rectangles of places the loops of faces may meet, and winding numbers about the others.

The tree of runs of pieces is descended only where a box meets a rectangle. Pieces are not halved:
their boxes and their strips decide.

Proof in docs/proofs.md: "Rectangles of a trimmed region".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.cancellation import checkpoint
from service.engine.trims.border_pieces import BorderPieces
from service.engine.trims.border_tree import BorderTree
from service.engine.trims.border_windings import PAIRS, cross_rays, wind_outside_box
from service.engine.vectors import Items

OUTER = 2.0
"""A rectangle is made larger by this number of margins, to be free of loops with its sides."""

INNER = 8.0
"""And smaller by this number of margins, to be free of loops up to its sides: a loop that runs
along a side does not cut the rectangle."""


@dataclass(frozen=True, eq=False, slots=True)
class Rectangles(Items):
    """m rectangles of places.

    Attributes
    ----------
    middles, halves : ndarray of float64, shape (2, m)
        The middles, and half the lengths of the sides.
    margins : ndarray of float64, shape (m,)
    """

    middles: FloatArray
    halves: FloatArray
    margins: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class RectangleWindings:
    """Winding numbers of loops about m rectangles.

    Attributes
    ----------
    numbers : ndarray of int, shape (m,)
        The winding numbers about the middles of rectangles that are not cut.
    is_cut : ndarray of bool, shape (m,)
        Whether a loop may meet the rectangle, further than `INNER` margins from its sides.
    is_met : ndarray of bool, shape (m,)
        Whether a loop may meet the rectangle or come within `OUTER` margins of it. Only of
        rectangles that are not cut.
    """

    numbers: Ints
    is_cut: Bools
    is_met: Bools


def wind_about_rectangles(
    tree: BorderTree, rectangles: Rectangles, row: Ints, node: Ints
) -> RectangleWindings:
    """The winding numbers of loops about rectangles, and which of these they may meet.

    `row` and `node` (k,) are pairs of a rectangle and a node of the first level of the tree.
    """
    count = len(rectangles.margins)
    total = np.zeros(count)
    is_cut, is_met = np.zeros((2, count), bool)
    lists = [(0, row, node)]
    while lists:
        checkpoint()
        depth, row, node = lists.pop()
        if len(row) > PAIRS:
            parts = range(0, len(row), PAIRS)
            lists += [(depth, row[k : k + PAIRS], node[k : k + PAIRS]) for k in parts]
            continue
        left = ~is_cut[row]
        row, node = row[left], node[left]
        about = rectangles.take(row)
        if depth == len(tree.levels):
            pieces = tree.pieces.take(node)
            meets_inside = _meet_pieces(pieces, about, -INNER)
            is_cut[row[meets_inside]] = True
            is_met[row[_meet_pieces(pieces, about, OUTER)]] = True
            steps, _ = cross_rays(pieces, about.middles, about.margins)
            total += np.bincount(row, steps, minlength=count)
            continue
        level = tree.levels[depth]
        meets = _meet_boxes(level.boxes.take(node, axis=1), about, OUTER)
        far = (~meets).nonzero()[0]
        boxes = level.boxes.take(node[far], axis=1)
        ends = level.begins.take(node[far]), level.ends.take(node[far])
        steps = wind_outside_box(boxes, *ends, about.middles[:, far])
        total += np.bincount(row[far], steps, minlength=count)
        row, node = row[meets], node[meets]
        above, node = expand_runs(level.counts[node], level.first[node])
        lists.append((depth + 1, row[above], node))
    return RectangleWindings(total.astype(np.intp), is_cut, is_met)


def _meet_boxes(boxes: FloatArray, rectangles: Rectangles, reach: float) -> Bools:
    """Whether boxes (4, k), each larger by a margin, meet rectangles larger by `reach` margins."""
    halves = rectangles.halves + (reach + 1.0) * rectangles.margins
    low, high = rectangles.middles - halves, rectangles.middles + halves
    meets: Bools = np.all((boxes[:2] <= high) & (low <= boxes[2:]), axis=0)
    return meets


def _meet_pieces(pieces: BorderPieces, rectangles: Rectangles, reach: float) -> Bools:
    """Whether both convex sets of pieces, each larger by a margin, meet rectangles.

    Rectangles are larger by `reach` margins.
    """
    x, y = rectangles.middles - pieces.begins
    along = pieces.along
    across = along[0] * y - along[1] * x
    halves = rectangles.halves + reach * rectangles.margins
    width = np.abs(along[0]) * halves[1] + np.abs(along[1]) * halves[0] + rectangles.margins
    meets: Bools = (across - width <= pieces.sides[1]) & (pieces.sides[0] <= across + width)
    meets &= _meet_boxes(pieces.boxes, rectangles, reach)
    return meets
