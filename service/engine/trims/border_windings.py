"""The winding numbers of loops of parameter curves about places.

A run of pieces of a loop that begins at a and ends at b, and is in a convex set without the place,
winds about the place as the chord from a to b does. So the tree of runs is descended only where a
box contains the place, and a piece is halved only where both of its convex sets do.

Proof in docs/proofs.md: "Inside a trimmed region".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.cancellation import checkpoint
from service.engine.trims.border_pieces import JOIN, BorderPieces
from service.engine.trims.border_tree import BorderTree

MOST_HALVINGS = 64
"""A piece that was halved this often is shorter than rounding."""


PAIRS = 1 << 16
"""Pairs of a place and a node, or a piece, that are tested together: it limits memory."""

NUMBERS = 1 << 20
"""Numbers of the matrices by which pieces that are tested together are halved."""


@dataclass(frozen=True, eq=False, slots=True)
class Windings:
    """The winding numbers of loops about m places.

    Attributes
    ----------
    numbers : ndarray of int, shape (m,)
        Without the pieces that are listed below.
    rows, coedges : ndarray of int, shape (k,)
        Places, and coedges on which they are up to rounding.
    tests : int
        How many pairs were tested of a place and a node of the tree, or a piece.
    halves : int
        How many pairs were tested of a place and a half of a piece.
    """

    numbers: Ints
    rows: Ints
    coedges: Ints
    tests: int
    halves: int


def find_windings(
    tree: BorderTree, places: FloatArray, margin: FloatArray, row: Ints, node: Ints
) -> Windings:
    """The sums of the winding numbers of loops about places.

    Parameters
    ----------
    tree : BorderTree
    places : ndarray of float64, shape (2, m)
    margin : ndarray of float64, shape (m,)
        Convex sets are made larger by this on all sides, for rounding.
    row, node : ndarray of int, shape (k,)
        Pairs of a place and a node of the first level of the tree.
    """
    total = np.zeros(places.shape[1])
    near_rows, near_coedges = [row[:0]], [row[:0]]
    tests = halves = 0
    most_pieces = min(PAIRS, tree.pcurves.count_restricted(NUMBERS))
    lists = [(0, row, node)]
    while lists:
        checkpoint()
        depth, row, node = lists.pop()
        most = most_pieces if depth == len(tree.levels) else PAIRS
        if len(row) > most:
            parts = range(0, len(row), most)
            lists += [(depth, row[k : k + most], node[k : k + most]) for k in parts]
            continue
        tests += len(row)
        if depth == len(tree.levels):
            found = _wind_about_pieces(tree, tree.pieces.take(node), places, margin, row)
            total += found.numbers
            near_rows.append(found.rows)
            near_coedges.append(found.coedges)
            halves += found.halves
            continue
        level = tree.levels[depth]
        box = level.boxes.take(node, axis=1)
        is_near = touch_boxes(box, places, margin, row)
        far = (~is_near).nonzero()[0]
        ends = level.begins.take(node[far]), level.ends.take(node[far])
        steps = wind_outside_box(box[:, far], *ends, places.take(row[far], axis=1))
        total += np.bincount(row[far], steps, minlength=len(total))
        row, node = row[is_near], node[is_near]
        above, node = expand_runs(level.counts[node], level.first[node])
        lists.append((depth + 1, row[above], node))
    rows, coedges = np.concatenate(near_rows), np.concatenate(near_coedges)
    return Windings(total.astype(np.intp), rows, coedges, tests, halves)


def _wind_about_pieces(
    tree: BorderTree, pieces: BorderPieces, places: FloatArray, margin: FloatArray, row: Ints
) -> Windings:
    """The sums of how often pieces, each of a place `row` (k,), cross the rays from places."""
    total = np.zeros(places.shape[1])
    near_rows, near_coedges = [], []
    halves = 0
    for halving in range(MOST_HALVINGS + 1):
        steps, is_near = cross_rays(pieces, places.take(row, axis=1), margin[row])
        total += np.bincount(row, steps, minlength=len(total))
        row, pieces = row[is_near], pieces.take(is_near)
        is_last = (pieces.spans == JOIN) | pieces.find_flat(margin[row])
        is_last |= halving == MOST_HALVINGS
        near_rows.append(row[is_last])
        near_coedges.append(pieces.coedges[is_last])
        row, pieces = row[~is_last].repeat(2), pieces.take(~is_last)
        if not len(row):
            break
        halves += len(row)
        pieces = pieces.halve(tree.pcurves)
    rows, coedges = np.concatenate(near_rows), np.concatenate(near_coedges)
    return Windings(total.astype(np.intp), rows, coedges, 0, halves)


def touch_boxes(boxes: FloatArray, places: FloatArray, margin: FloatArray, row: Ints) -> Bools:
    """Whether boxes (4, k), with margins, contain the places of rows (k,)."""
    (x, y), more = places.take(row, axis=1), margin.take(row)
    touches: Bools = (boxes[0] - more <= x) & (x <= boxes[2] + more)
    touches &= (boxes[1] - more <= y) & (y <= boxes[3] + more)
    return touches


def wind_outside_box(
    boxes: FloatArray, begins: FloatArray, ends: FloatArray, places: FloatArray
) -> FloatArray:
    """How often runs cross the rays from places (2, k) towards greater x; places are outside.

    A crossing counts 1 upwards and −1 downwards. `begins` and `ends` (k,) are the y of the ends of
    runs; a ray through an end is just above it.
    """
    x, y = places
    crossings: FloatArray = (ends > y) * 1.0 - (begins > y)
    return np.where(x < boxes[0], crossings, 0.0)


def cross_rays(
    pieces: BorderPieces, places: FloatArray, margin: FloatArray
) -> tuple[FloatArray, Bools]:
    """How often pieces (k,) cross the rays from places (2, k), 0 where this is not decided.

    The second result is where it is not decided: where a place is in the box and in the strip.
    """
    is_near = touch_boxes(pieces.boxes, places, margin, np.arange(len(margin)))
    begins, ends = pieces.begins[1], pieces.ends[1]
    steps = np.where(is_near, 0.0, wind_outside_box(pieces.boxes, begins, ends, places))
    rows = is_near.nonzero()[0]
    (x, y), along = places[:, rows] - pieces.begins[:, rows], pieces.along[:, rows]
    across = along[0] * y - along[1] * x
    low, high = pieces.sides[:, rows]
    is_left, is_right = across > high + margin[rows], across < low - margin[rows]
    above = ends[rows] > places[1, rows], begins[rows] > places[1, rows]
    upwards, downwards = above[0] & ~above[1], above[1] & ~above[0]
    steps[rows] = (upwards & is_left) * 1.0 - (downwards & is_right)
    is_near[rows] = ~(is_left | is_right)
    return steps, is_near
