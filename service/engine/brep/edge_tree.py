"""Whether points are near edges: a tree of boxes over pieces of edges, asked any number of times.

Each piece has a reach, such as the gap of its edge. A piece that may be near a point is halved
until an end of it is within the reach, or its box is small compared with the reach.

Proof in docs/proofs.md: "Inside a trimmed region".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, row_slices
from service.cancellation import checkpoint
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.border_tree import group_runs
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import Items, length, project

ROUNDING = 2.0**-42
"""Share of the largest coordinate that is added to gaps."""

NEAR = 1 / 4
"""A piece of an edge whose box is smaller than this share of the reach is not halved."""

MOST_HALVINGS = 64
"""A piece that was halved this often is shorter than rounding."""

ROUNDS, MOST_PIECES = 5, 1 << 14
"""Edges are halved this often before points are tested, up to this number of pieces."""

CHUNK, PAIRS = 1 << 14, 1 << 16
"""Points, and pairs of a point and a box, that are tested together: it limits memory."""

NUMBERS = 1 << 20
"""Numbers of the matrices by which pieces that are tested together are halved."""


@dataclass(frozen=True, eq=False, slots=True)
class EdgePieces(Items):
    """m pieces of edges: parts of spans of curves, each with its reach.

    Attributes
    ----------
    curves, spans : ndarray of int, shape (m,)
    low, high, reaches : ndarray of float64, shape (m,)
    boxes : ndarray of float64, shape (6, m)
        Least and greatest coordinates, with `reaches`.
    ends : ndarray of float64, shape (6, m)
        The first and the last point.
    """

    curves: Ints
    spans: Ints
    low: FloatArray
    high: FloatArray
    reaches: FloatArray
    boxes: FloatArray
    ends: FloatArray

    @classmethod
    def of(cls, curves: Splines, parts: Intervals, reaches: FloatArray) -> "EdgePieces":
        """Parts (m,) of curves, with their reaches."""
        boxes, ends = np.empty((2, 6, len(reaches)))
        for rows, nets in curves.restrict(parts):
            points = project(nets, axis=-1).transpose(2, 1, 0)
            boxes[:3, rows], boxes[3:, rows] = points.min(axis=1), points.max(axis=1)
            ends[:3, rows], ends[3:, rows] = points[:, 0], points[:, -1]
        boxes[:3] -= reaches
        boxes[3:] += reaches
        return cls(parts.curve, parts.span, parts.low, parts.high, reaches, boxes, ends)

    def halve(self, curves: Splines) -> "EdgePieces":
        """The halves of all pieces: piece k becomes 2 k and 2 k + 1."""
        middle = self.low + (self.high - self.low) / 2
        twice = np.arange(len(middle)).repeat(2)
        low = np.stack([self.low, middle], axis=1).ravel()
        high = np.stack([middle, self.high], axis=1).ravel()
        parts = Intervals(twice, self.curves[twice], low, high, self.spans[twice])
        return EdgePieces.of(curves, parts, self.reaches[twice])


@dataclass(frozen=True, eq=False, slots=True)
class EdgeTree:
    """The pieces of edges in G groups, such as those of one face, ready for questions.

    Attributes
    ----------
    curves : Splines
    pieces : EdgePieces
        Group after group.
    levels : tuple of (boxes, first, below)
        From the root down: the boxes (6, n) of nodes, the first of the nodes or pieces below, and
        the numbers of these.
    root, counts : ndarray of int, shape (G,)
        The first node of each group on the first level, and how many it has: 1, or 0.
    """

    curves: Splines
    pieces: EdgePieces
    levels: tuple[tuple[FloatArray, Ints, Ints], ...]
    root: Ints
    counts: Ints

    @classmethod
    def of(
        cls, curves: Splines, parts: Intervals, reaches: FloatArray, counts: Ints, points: int
    ) -> "EdgeTree":
        """The tree over parts (m,) of curves with their reaches; `counts` (G,) are of each group.

        `points` is about how many points will be asked for: for more points, pieces are smaller.
        """
        pieces, halvings = EdgePieces.of(curves, parts, reaches), 0
        most = min(points, MOST_PIECES)
        while halvings < ROUNDS and 2 * len(pieces.curves) <= most:
            pieces, halvings = pieces.halve(curves), halvings + 1
        counts = counts << halvings
        levels: list[tuple[FloatArray, Ints, Ints]] = []
        boxes = pieces.boxes
        while len(reaches) and (not levels or int(counts.max()) > 1):
            first, below, counts = group_runs(counts)
            least = np.minimum.reduceat(boxes[:3], first, axis=1)
            boxes = np.concatenate([least, np.maximum.reduceat(boxes[3:], first, axis=1)])
            levels.insert(0, (boxes, first, below))
        return cls(curves, pieces, tuple(levels), counts.cumsum() - counts, counts)

    @classmethod
    def of_borders(
        cls, prepared: PreparedBrep, points: int, chosen: Bools | bool = True
    ) -> "EdgeTree":
        """The edges of each face, with their gaps as reaches: no seams and no poles.

        There is a group for each face. `points` is that of `EdgeTree.of`; `chosen` (C,) is which
        coedges count.
        """
        curve = prepared.edge_curves[prepared.coedge_edges]
        coedge = (prepared.is_border & (curve >= 0) & chosen).nonzero()[0]
        low, high = prepared.edge_ranges[prepared.coedge_edges[coedge]].T
        parts = prepared.curves.cut(curve[coedge], low, high)
        owner = coedge[parts.source]
        reaches = prepared.close_gaps[owner] + ROUNDING * float(np.abs(prepared.box).max())
        counts = np.bincount(prepared.coedge_faces[owner], minlength=len(prepared.surfaces))
        return cls.of(prepared.curves, parts, reaches, counts, points)

    def find_near(self, group: Ints, points: FloatArray) -> Bools:
        """Whether points (m, 3) are near an edge of their groups (m,).

        True where the distance is at most the reach, and never where it is more than 5/4 of it.
        """
        is_near = np.zeros(len(group), bool)
        if not self.levels:
            return is_near
        for rows in row_slices(len(group), 1, CHUNK):
            row, number = expand_runs(self.counts[group[rows]])
            node = self.root[group[rows]][row] + number
            is_near[rows] = self._descend(points[rows].T, row, node)
        return is_near

    def _descend(self, points: FloatArray, row: Ints, node: Ints) -> Bools:
        """Whether points (3, m) are near pieces, from pairs of a point and a node at the top."""
        is_near = np.zeros(points.shape[1], bool)
        lists = [(0, row, node)]
        while lists:
            checkpoint()
            depth, row, node = lists.pop()
            is_last = depth == len(self.levels)
            most = min(PAIRS, self.curves.count_restricted(NUMBERS)) if is_last else PAIRS
            if len(row) > most:
                parts = range(0, len(row), most)
                lists += [(depth, row[k : k + most], node[k : k + most]) for k in parts]
            elif is_last:
                left = ~is_near[row]
                is_near |= self._test_pieces(self.pieces.take(node[left]), row[left], points)
            else:
                boxes, first, below = self.levels[depth]
                touches = _touch(boxes[:, node], points[:, row]) & ~is_near[row]
                row, node = row[touches], node[touches]
                above, node = expand_runs(below[node], first[node])
                lists.append((depth + 1, row[above], node))
        return is_near

    def _test_pieces(self, pieces: EdgePieces, row: Ints, points: FloatArray) -> Bools:
        """Whether points (3, m) are within the reach of pieces, each of a point `row` (k,)."""
        is_near = np.zeros(points.shape[1], bool)
        for halving in range(MOST_HALVINGS + 1):
            touches = _touch(pieces.boxes, points[:, row]) & ~is_near[row]
            row, pieces = row[touches], pieces.take(touches)
            apart = length(pieces.ends.reshape(2, 3, -1) - points[:, row]).min(axis=0)
            sides = pieces.boxes[3:] - pieces.boxes[:3] - 2 * pieces.reaches
            # All of a small piece is nearly at its ends.
            is_small = length(sides) <= NEAR * pieces.reaches
            is_met = apart <= np.where(is_small, 1 + NEAR, 1.0) * pieces.reaches
            is_near[row[is_met | (halving == MOST_HALVINGS)]] = True
            left = ~(is_small | is_near[row])
            row, pieces = row[left].repeat(2), pieces.take(left)
            if not len(row):
                break
            pieces = pieces.halve(self.curves)
        return is_near


def _touch(boxes: FloatArray, points: FloatArray) -> Bools:
    """Whether boxes (6, k) contain points (3, k)."""
    touches: Bools = np.all((boxes[:3] <= points) & (points <= boxes[3:]), axis=0)
    return touches
