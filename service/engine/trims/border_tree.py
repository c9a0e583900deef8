"""A tree over the pieces of loops: runs of pieces of one loop, and loops, with boxes about them.

Proof in docs/proofs.md: "Inside a trimmed region".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.trims.border_pieces import BorderPieces, flatten_pieces, list_pieces
from service.engine.trims.places import SIZE
from service.engine.trims.splines import Splines
from service.engine.vectors import Items
from service.surface.spline_tables import find_starts

BRANCHES = 4
"""Nodes below each node."""

WIDTH = SIZE / 1024
"""Pieces of the tree have strips that are at most this wide."""

ROUNDS = 12
"""But no span is halved more often than this for the tree."""


FEW_LOOPS = 8
"""Loops of faces are grouped if a face has more of them than this."""

CELLS = 1 << 10
"""Loops are sorted by the cell of a grid of this many rows and columns in which their middle is."""


@dataclass(frozen=True, eq=False, slots=True)
class TreeLevel(Items):
    """The nodes of one level: node after node along each loop.

    Attributes
    ----------
    begins, ends : ndarray of float64, shape (m,)
        The y at which the run of pieces begins and ends.
    boxes : ndarray of float64, shape (4, m)
        Least x and y, and greatest x and y.
    first, counts : ndarray of int, shape (m,)
        The nodes below: consecutive ones of the next level, or pieces.
    """

    begins: FloatArray
    ends: FloatArray
    boxes: FloatArray
    first: Ints
    counts: Ints


@dataclass(frozen=True, eq=False, slots=True)
class BorderTree:
    """The tree of all loops.

    Attributes
    ----------
    pcurves : Splines
        One for each coedge, in the order of loops.
    levels : tuple of TreeLevel
        From the roots down.
    pieces : BorderPieces
    counts : ndarray of int, shape (L,)
        Number of pieces of each loop.
    roots : ndarray of int, shape (F+1,)
        The first node of each face on the first level, and the number of these nodes.
    """

    pcurves: Splines
    levels: tuple[TreeLevel, ...]
    pieces: BorderPieces
    counts: Ints
    roots: Ints

    @classmethod
    def of(
        cls,
        pcurves: Splines,
        coedge_reversed: Bools,
        loop_counts: Ints,
        loop_faces: Ints,
        faces: int,
    ) -> "BorderTree":
        """The tree of loops of parameter curves (`list_pieces`).

        `loop_faces` (L,) are the faces of loops, in ascending order, and `faces` is F.
        """
        pieces, counts = list_pieces(pcurves, coedge_reversed, loop_counts)
        pieces, counts = flatten_pieces(pieces, counts, pcurves, WIDTH, ROUNDS)
        loops = np.bincount(loop_faces, minlength=faces)
        levels, loops = _group_loops(_build_levels(pieces, counts), loop_faces, loops)
        return cls(pcurves, levels, pieces, counts, find_starts(loops))


def group_runs(counts: Ints) -> tuple[Ints, Ints, Ints]:
    """Runs of rows in groups of at most `BRANCHES` consecutive rows of one run.

    Parameters
    ----------
    counts : ndarray of int, shape (n,)
        How many rows each run has.

    Returns
    -------
    first, below : ndarray of int, shape (g,)
        The first row of each group, and how many rows it has.
    counts : ndarray of int, shape (n,)
        How many groups each run has.
    """
    starts = find_starts(counts)
    groups = -(-counts // BRANCHES)
    run, number = expand_runs(groups)
    first = starts[run] + number * BRANCHES
    return first, np.minimum(first + BRANCHES, starts[run + 1]) - first, groups


def _build_levels(pieces: BorderPieces, counts: Ints) -> tuple[TreeLevel, ...]:
    """The levels of a tree over pieces, from the root down, which has one node for each loop.

    `counts` (L,) are the numbers of pieces of loops, at least 1.
    """
    levels: list[TreeLevel] = []
    begins, ends, boxes = pieces.begins[1], pieces.ends[1], pieces.boxes
    while len(counts) and (not levels or int(counts.max()) > 1):
        first, below, counts = group_runs(counts)
        low = np.minimum.reduceat(boxes[:2], first, axis=1)
        high = np.maximum.reduceat(boxes[2:], first, axis=1)
        begins, ends = begins[first], ends[first + below - 1]
        boxes = np.concatenate([low, high])
        levels.insert(0, TreeLevel(begins, ends, boxes, first, below))
    return tuple(levels)


def _group_loops(
    levels: tuple[TreeLevel, ...], faces: Ints, counts: Ints
) -> tuple[tuple[TreeLevel, ...], Ints]:
    """The levels of a tree, with groups of loops of one face above its loops, if a face has many.

    The first of the given levels has one node for each loop, and `faces` (L,) are their faces.
    Loops that are near to each other are in one group. The second result is how many nodes of the
    first level each face has; `counts` (F,) is how many loops.
    """
    if int(counts.max(initial=0)) <= FEW_LOOPS:
        return levels, counts
    middles = levels[0].boxes[:2] / 2 + levels[0].boxes[2:] / 2
    cell = np.clip(middles / (SIZE / CELLS), 0, CELLS - 1).astype(np.intp)
    code = np.zeros(len(faces), np.intp)
    for bit in range(CELLS.bit_length() - 1):
        code |= (cell[0] >> bit & 1) << (2 * bit) | (cell[1] >> bit & 1) << (2 * bit + 1)
    order = np.lexsort((code, faces))
    result = [levels[0].take(order), *levels[1:]]
    while int(counts.max()) > 1:
        first, below, counts = group_runs(counts)
        boxes = result[0].boxes
        low = np.minimum.reduceat(boxes[:2], first, axis=1)
        high = np.maximum.reduceat(boxes[2:], first, axis=1)
        # Closed loops do not wind about a place outside of their box.
        none = np.zeros(len(first))
        result.insert(0, TreeLevel(none, none, np.concatenate([low, high]), first, below))
    return tuple(result), counts
