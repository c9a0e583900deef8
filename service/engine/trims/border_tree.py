"""A tree over the pieces of loops: runs of pieces of one loop, with boxes about them.

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
        From the root down; the first level has one node for each loop.
    pieces : BorderPieces
    counts : ndarray of int, shape (L,)
        Number of pieces of each loop.
    """

    pcurves: Splines
    levels: tuple[TreeLevel, ...]
    pieces: BorderPieces
    counts: Ints

    @classmethod
    def of(cls, pcurves: Splines, coedge_reversed: Bools, loop_counts: Ints) -> "BorderTree":
        """The tree of loops of parameter curves; see `list_pieces`."""
        pieces, counts = list_pieces(pcurves, coedge_reversed, loop_counts)
        pieces, counts = flatten_pieces(pieces, counts, pcurves, WIDTH, ROUNDS)
        return cls(pcurves, _build_levels(pieces, counts), pieces, counts)


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
