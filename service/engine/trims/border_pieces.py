"""Pieces of the border of regions: parts of parameter curves with their chords and convex hulls.

A piece runs along its loop, from one parameter of its coedge to another one. Its part of the curve
is in two convex sets: a box, and a strip along the chord; both contain the chord, too.

Proof in docs/proofs.md: "Inside a trimmed region".
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines
from service.engine.vectors import Items, project

JOIN = -1
"""The span of a piece that is no part of a curve: the segment between two curves."""


@dataclass(frozen=True, eq=False, slots=True)
class BorderPieces(Items):
    """m pieces.

    Attributes
    ----------
    coedges : ndarray of int, shape (m,)
        The coedge of each piece; of a join, the coedge before it.
    spans : ndarray of int, shape (m,)
        The span of the parameter curve, or `JOIN`.
    parameters : ndarray of float64, shape (2, m)
        The parameters at which a piece begins and ends; the second is the lesser one where the loop
        runs against the edge.
    begins, ends : ndarray of float64, shape (2, m)
        The ends of the chord.
    boxes : ndarray of float64, shape (4, m)
        Least x and y, and greatest x and y.
    along : ndarray of float64, shape (2, m)
        The unit vector along the chord; (1, 0) for a chord without a length.
    sides : ndarray of float64, shape (2, m)
        The least and the greatest distance to the left of the chord; at most 0, and at least 0.
    """

    coedges: Ints
    spans: Ints
    parameters: FloatArray
    begins: FloatArray
    ends: FloatArray
    boxes: FloatArray
    along: FloatArray
    sides: FloatArray

    def find_flat(self, margin: FloatArray | float) -> Bools:
        """The pieces whose strip is at most `margin` (m,) wide, and whose box is that of the chord.

        The box may be larger than that of the chord by `margin`.
        """
        low = np.minimum(self.begins, self.ends) - margin
        high = np.maximum(self.begins, self.ends) + margin
        is_flat: Bools = self.sides[1] - self.sides[0] <= margin
        is_flat &= (self.boxes[:2] >= low).all(axis=0) & (self.boxes[2:] <= high).all(axis=0)
        return is_flat

    def halve(self, pcurves: Splines) -> "BorderPieces":
        """The halves of all pieces, which are parts of curves: piece k becomes 2 k and 2 k + 1."""
        middle = self.parameters[0] + (self.parameters[1] - self.parameters[0]) / 2
        at = pcurves.evaluate(self.coedges, middle).T
        parameters, begins, ends = (
            np.stack([first, second], axis=2).reshape(2, -1)
            for first, second in (
                (
                    np.array([self.parameters[0], middle]),
                    np.array([middle, self.parameters[1]]),
                ),
                (self.begins, at),
                (at, self.ends),
            )
        )
        halves = replace(
            self.take(np.arange(len(self.coedges)).repeat(2)),
            parameters=parameters,
            begins=begins,
            ends=ends,
        )
        return halves.measure(pcurves)

    def measure(self, pcurves: Splines) -> "BorderPieces":
        """The pieces with boxes and strips about their chords and curves."""
        chord = self.ends - self.begins
        lengths = np.hypot(*chord)
        along = np.where(lengths > 0, chord / np.where(lengths > 0, lengths, 1.0), [[1.0], [0.0]])
        boxes = np.concatenate(
            [np.minimum(self.begins, self.ends), np.maximum(self.begins, self.ends)]
        )
        sides = np.zeros((2, len(lengths)))
        curved = (self.spans != JOIN).nonzero()[0]
        low, high = np.sort(self.parameters[:, curved], axis=0)
        intervals = Intervals(curved, self.coedges[curved], low, high, self.spans[curved])
        for rows, nets in pcurves.restrict(intervals):
            number = curved[rows]
            points = project(nets, axis=-1, dimension=2).transpose(2, 1, 0)
            boxes[:2, number] = np.minimum(boxes[:2, number], points.min(axis=1))
            boxes[2:, number] = np.maximum(boxes[2:, number], points.max(axis=1))
            x, y = points - self.begins[:, np.newaxis, number]
            across = along[0, number] * y - along[1, number] * x
            sides[0, number] = np.minimum(across.min(axis=0), 0.0)
            sides[1, number] = np.maximum(across.max(axis=0), 0.0)
        return replace(self, boxes=boxes, along=along, sides=sides)


def list_pieces(
    pcurves: Splines, coedge_reversed: Bools, loop_counts: Ints
) -> tuple[BorderPieces, Ints]:
    """The pieces of closed loops of parameter curves: their spans, and joins between these.

    Parameters
    ----------
    pcurves : Splines
        One for each coedge, in the order of loops.
    coedge_reversed : ndarray of bool, shape (C,)
        Whether the loop runs against the curve.
    loop_counts : ndarray of int, shape (L,)
        Number of coedges of each loop, at least 1.

    Returns
    -------
    pieces : BorderPieces
        Along the loops: each piece begins where the one before it ends, and the first piece of a
        loop where the last one ends.
    counts : ndarray of int, shape (L,)
        Number of pieces of each loop.
    """
    coedge, number = expand_runs(pcurves.span_count)
    is_reversed = coedge_reversed[coedge]
    span = np.where(is_reversed, pcurves.span_count[coedge] - 1 - number, number)
    at = pcurves.first_break[coedge] + span
    parameters = np.array([pcurves.breaks[at], pcurves.breaks[at + 1]])
    points = np.empty((2, 2, len(coedge)))
    for nets, rows in pcurves.split(coedge):
        values = nets.points.take(pcurves.row[coedge[rows]] + span[rows], axis=2)
        points[:, :, rows] = values[[0, -1]]
    parameters = np.where(is_reversed, parameters[::-1], parameters)
    begins, ends = np.where(is_reversed, points[::-1], points)
    # The piece after each piece; after the last one of a loop, the first one.
    loops = np.repeat(np.arange(len(loop_counts)), loop_counts)
    counts = np.bincount(loops, pcurves.span_count, minlength=len(loop_counts)).astype(np.intp)
    last = counts.cumsum() - 1
    following = np.arange(1, len(coedge) + 1)
    following[last] = last + 1 - counts
    gaps = (ends != begins[:, following]).any(axis=0).nonzero()[0]
    place = gaps + 1
    counts += np.bincount(loops[coedge[gaps]], minlength=len(loop_counts))
    count = len(coedge) + len(gaps)
    pieces = BorderPieces(
        np.insert(coedge, place, coedge[gaps]),
        np.insert(span, place, JOIN),
        np.insert(parameters, place, parameters[1:, gaps].repeat(2, axis=0), axis=1),
        np.insert(begins, place, ends[:, gaps], axis=1),
        np.insert(ends, place, begins[:, following[gaps]], axis=1),
        np.empty((4, count)),
        np.empty((2, count)),
        np.empty((2, count)),
    )
    return pieces.measure(pcurves), counts


def flatten_pieces(
    pieces: BorderPieces, counts: Ints, pcurves: Splines, width: float, rounds: int
) -> tuple[BorderPieces, Ints]:
    """Halve pieces, in at most `rounds` rounds, until their strips are at most `width` wide."""
    loops = np.repeat(np.arange(len(counts)), counts)
    is_new = pieces.spans != JOIN
    for _ in range(rounds):
        is_wide = is_new & (pieces.sides[1] - pieces.sides[0] > width)
        wide = is_wide.nonzero()[0]
        if not len(wide):
            break
        halves = pieces.take(wide).halve(pcurves)
        source = np.arange(len(is_wide)).repeat(1 + is_wide)
        is_new = is_wide[source]
        pieces = BorderPieces.join([pieces, halves])
        order = source.copy()
        order[is_new] = len(is_wide) + np.arange(2 * len(wide))
        pieces, loops = pieces.take(order), loops[source]
    return pieces, np.bincount(loops, minlength=len(counts)).astype(np.intp)
