"""Whether points of the surfaces of faces are inside their trims, given the gaps of edges.

An edge is a curve of space, and the border of a region is a curve on the surface; they are apart by
at most a proved gap. A point that is nearer to an edge than this is neither inside nor outside.

Proof in docs/proofs.md: "Inside a trimmed region".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, row_slices
from service.cancellation import checkpoint
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.border_tree import group_runs
from service.engine.trims.inside import UNDECIDED
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import Items, length, project

ROUNDING = 2.0**-42
"""Share of the largest coordinate that is added to gaps."""

NEAR = 1 / 4
"""A piece of an edge whose box is smaller than this share of the gap is not halved."""

MOST_HALVINGS = 64
"""A piece that was halved this often is shorter than rounding."""

ROUNDS, MOST_PIECES = 5, 1 << 14
"""Edges are halved this often before points are tested, up to this number of pieces."""

CHUNK, PAIRS = 1 << 14, 1 << 16
"""Points, and pairs of a point and a box, that are tested together: it limits memory."""

NUMBERS = 1 << 20
"""Numbers of the matrices by which pieces that are tested together are halved."""


@dataclass(frozen=True, eq=False, slots=True)
class _Pieces(Items):
    """m pieces of edges: parts of spans of curves, with how far from them a border may be.

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
    def of(cls, curves: Splines, parts: Intervals, reaches: FloatArray) -> "_Pieces":
        """Parts (m,) of curves, and how far a border is from them."""
        boxes, ends = np.empty((2, 6, len(reaches)))
        for rows, nets in curves.restrict(parts):
            points = project(nets, axis=-1).transpose(2, 1, 0)
            boxes[:3, rows], boxes[3:, rows] = points.min(axis=1), points.max(axis=1)
            ends[:3, rows], ends[3:, rows] = points[:, 0], points[:, -1]
        boxes[:3] -= reaches
        boxes[3:] += reaches
        return cls(parts.curve, parts.span, parts.low, parts.high, reaches, boxes, ends)

    def halve(self, curves: Splines) -> "_Pieces":
        """The halves of all pieces: piece k becomes 2 k and 2 k + 1."""
        middle = self.low + (self.high - self.low) / 2
        twice = np.arange(len(middle)).repeat(2)
        low = np.stack([self.low, middle], axis=1).ravel()
        high = np.stack([middle, self.high], axis=1).ravel()
        parts = Intervals(twice, self.curves[twice], low, high, self.spans[twice])
        return _Pieces.of(curves, parts, self.reaches[twice])


def find_inside(
    prepared: PreparedBrep, face: Ints, parameters: FloatArray, points: FloatArray
) -> Ints:
    """Whether points of faces (m,) are inside their trims: `INSIDE`, `OUTSIDE` or `UNDECIDED`.

    Parameters
    ----------
    parameters : ndarray of float64, shape (m, 2)
        Of the surfaces of the faces.
    points : ndarray of float64, shape (m, 3)
        The points of the surfaces there.
    """
    inside = prepared.regions.find_inside(face, parameters).inside
    decided = (inside != UNDECIDED).nonzero()[0]
    is_near = find_near_edges(prepared, face[decided], points[decided])
    inside[decided[is_near]] = UNDECIDED
    return inside


def find_near_edges(prepared: PreparedBrep, face: Ints, points: FloatArray) -> Bools:
    """Whether points (m, 3) of faces (m,) are nearer to an edge of the face than its gap.

    True where the distance is at most the gap, and never where it is more than 5/4 of the gap and
    rounding. Seams and poles do not count.
    """
    is_near = np.zeros(len(face), bool)
    curve = prepared.edge_curves[prepared.coedge_edges]
    coedge = (prepared.is_border & (curve >= 0)).nonzero()[0]
    if not len(coedge):
        return is_near
    size = float(np.abs(prepared.box).max())
    low, high = prepared.edge_ranges[prepared.coedge_edges[coedge]].T
    parts = prepared.curves.cut(curve[coedge], low, high)
    owner = coedge[parts.source]
    pieces = _Pieces.of(prepared.curves, parts, prepared.gaps[owner] + ROUNDING * size)
    owner_faces = prepared.coedge_faces[owner]
    for _ in range(ROUNDS):
        if 2 * len(owner_faces) > min(len(face), MOST_PIECES):
            break
        pieces, owner_faces = pieces.halve(prepared.curves), owner_faces.repeat(2)
    counts = np.bincount(owner_faces, minlength=len(prepared.surfaces))
    levels: list[tuple[FloatArray, Ints, Ints]] = []
    boxes = pieces.boxes
    while not levels or int(counts.max()) > 1:
        first, below, counts = group_runs(counts)
        least = np.minimum.reduceat(boxes[:3], first, axis=1)
        boxes = np.concatenate([least, np.maximum.reduceat(boxes[3:], first, axis=1)])
        levels.insert(0, (boxes, first, below))
    root = counts.cumsum() - counts
    for rows in row_slices(len(face), 1, CHUNK):
        near = points[rows].T
        row, number = expand_runs(counts[face[rows]])
        node = root[face[rows]][row] + number
        is_near[rows] = _descend(prepared.curves, levels, pieces, near, (row, node))
    return is_near


def _descend(
    curves: Splines,
    levels: Sequence[tuple[FloatArray, Ints, Ints]],
    pieces: _Pieces,
    points: FloatArray,
    pairs: tuple[Ints, Ints],
) -> Bools:
    """Whether points (3, m) are near pieces, from pairs of a point and a node of the first level.

    A level has the boxes of its nodes, their first nodes or pieces below, and the numbers of these.
    """
    is_near = np.zeros(points.shape[1], bool)
    lists = [(0, *pairs)]
    while lists:
        checkpoint()
        depth, row, node = lists.pop()
        most = min(PAIRS, curves.count_restricted(NUMBERS)) if depth == len(levels) else PAIRS
        if len(row) > most:
            parts = range(0, len(row), most)
            lists += [(depth, row[k : k + most], node[k : k + most]) for k in parts]
        elif depth == len(levels):
            left = ~is_near[row]
            is_near |= _test_pieces(curves, pieces.take(node[left]), row[left], points)
        else:
            boxes, first, below = levels[depth]
            touches = _touch(boxes[:, node], points[:, row]) & ~is_near[row]
            row, node = row[touches], node[touches]
            above, node = expand_runs(below[node], first[node])
            lists.append((depth + 1, row[above], node))
    return is_near


def _test_pieces(curves: Splines, pieces: _Pieces, row: Ints, points: FloatArray) -> Bools:
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
        pieces = pieces.halve(curves)
    return is_near


def _touch(boxes: FloatArray, points: FloatArray) -> Bools:
    """Whether boxes (6, k) contain points (3, k)."""
    touches: Bools = np.all((boxes[:3] <= points) & (points <= boxes[3:]), axis=0)
    return touches
