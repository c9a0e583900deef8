"""Whether parameters of surfaces are in the trimmed regions of faces, by winding numbers.

Proof in docs/proofs.md: "Inside a trimmed region".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.cancellation import checkpoint
from service.engine.cells.cell_trims import INSIDE, OUTSIDE, UNDECIDED
from service.engine.trims.border_tree import BorderTree
from service.engine.trims.border_windings import Windings, find_windings
from service.engine.trims.places import SIZE, PlaceFrames
from service.surface.spline_tables import find_starts

__all__ = ["INSIDE", "OUTSIDE", "UNDECIDED", "Answers", "Regions"]

MARGIN = 2.0**-7
"""Convex sets are made larger by this number of units on all sides, for rounding."""

RELATIVE_MARGIN = 2.0**-49
"""And by this share of the largest parameter of the face."""

SEAM_MARGINS = 8.0
"""A point at a seam or a pole is inside if no border is within this many margins: the seam itself
is within 4."""

CHUNK = 1 << 14
"""Places that are tested together, with all their periods: it limits memory."""


@dataclass(frozen=True, eq=False, slots=True)
class Answers:
    """Answers for m points.

    Attributes
    ----------
    inside : ndarray of int, shape (m,)
        `INSIDE`; `OUTSIDE`; or `UNDECIDED` where a point is on a border, up to rounding, and on
        faces without loops.
    tests, halves : int
        How many pairs were tested of a place and a node of a tree or a piece, and of a place and a
        half of a piece.
    """

    inside: Ints
    tests: int
    halves: int


@dataclass(frozen=True, eq=False, slots=True)
class Regions:
    """The regions of F faces, ready for questions.

    Attributes
    ----------
    places : PlaceFrames
    tree : BorderTree
        The loops of all faces, face after face.
    first_loop : ndarray of int, shape (F + 1,)
        The loops of face f are those from `first_loop[f]` to `first_loop[f + 1] - 1`.
    is_border : ndarray of bool, shape (C,)
        Whether a coedge is a border of its face on the surface: it is no seam and no pole.
    periods : ndarray of float64, shape (F, 2)
        The lengths of closed axes, in parameters; 0 for others.
    margins : ndarray of float64, shape (F,)
        In places.
    low, high : ndarray of float64, shape (F, 2)
        The box of the loops of each face with its margin, in parameters.
    """

    places: PlaceFrames
    tree: BorderTree
    first_loop: Ints
    is_border: Bools
    periods: FloatArray
    margins: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(
        cls,
        places: PlaceFrames,
        tree: BorderTree,
        *,
        loop_faces: Ints,
        is_border: Bools,
        periods: FloatArray,
    ) -> "Regions":
        """The regions of loops; `loop_faces` (L,) are their faces, in ascending order."""
        count = len(places.origin)
        first_loop = find_starts(np.bincount(loop_faces, minlength=count))
        low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
        faces = np.repeat(loop_faces, tree.counts)
        np.minimum.at(low, faces, tree.pieces.boxes[:2].T)
        np.maximum.at(high, faces, tree.pieces.boxes[2:].T)
        every = np.arange(count)
        largest = np.maximum(np.abs(places.origin), np.abs(places.origin + places.extent))
        share = ((largest + periods) / places.extent).max(axis=1, initial=0.0)
        margins = MARGIN + RELATIVE_MARGIN * SIZE * share
        low = places.to_parameters(every, low - margins[:, np.newaxis])
        high = places.to_parameters(every, high + margins[:, np.newaxis])
        return cls(places, tree, first_loop, is_border, periods, margins, low, high)

    def find_inside(self, face: Ints, parameters: FloatArray) -> Answers:
        """Whether parameters (m, 2) of the surfaces of faces (m,) are in the regions of these.

        Seams and poles are no borders: a point on them is inside if no border is there.
        """
        first, count = self._count_copies(face, parameters)
        inside = np.empty(len(face), np.intp)
        tests = halves = 0
        ends = count.prod(axis=1).cumsum()
        begin = 0
        while begin < len(face):
            checkpoint()
            done = int(ends[begin - 1]) if begin else 0
            end = max(begin + 1, int(np.searchsorted(ends, done + CHUNK, side="right")))
            rows = slice(begin, end)
            point, number = expand_runs(count[rows].prod(axis=1))
            turns = first[rows][point] + np.stack(np.divmod(number, count[rows][point, 1]), axis=1)
            own = face[rows][point]
            copies = parameters[rows][point] + turns * self.periods[own]
            found = self.find_windings(own, copies)
            tests, halves = tests + found.tests, halves + found.halves
            at_seam = np.unique(found.rows[~self.is_border[found.coedges]])
            at_border = at_seam
            if len(at_seam):
                near = self.find_windings(own[at_seam], copies[at_seam], SEAM_MARGINS)
                at_border = at_seam[near.rows[self.is_border[near.coedges]]]
                tests, halves = tests + near.tests, halves + near.halves
            inside[rows] = self._answer(face[rows], point, found, at_border)
            begin = end
        return Answers(inside, tests, halves)

    def find_windings(self, face: Ints, parameters: FloatArray, margins: float = 1.0) -> Windings:
        """The winding numbers of the loops of faces (m,) about parameters (m, 2).

        Coedges are listed on which a point is up to a number of margins.
        """
        row, node = self.list_roots(face)
        places = np.ascontiguousarray(self.places.to_places(face, parameters).T)
        return find_windings(self.tree, places, margins * self.margins[face], row, node)

    def list_roots(self, face: Ints) -> tuple[Ints, Ints]:
        """Pairs of a row of faces (m,), and a node of the first level of the tree of loops."""
        first = self.tree.roots[face]
        return expand_runs(self.tree.roots[face + 1] - first, first)

    def _count_copies(self, face: Ints, parameters: FloatArray) -> tuple[FloatArray, Ints]:
        """The least number of periods (m, 2) after which points are in the boxes of loops.

        The second result is how many numbers there are, (m, 2); 0 for a face without loops.
        """
        period = self.periods[face]
        low, high = self.low[face] - parameters, self.high[face] - parameters
        is_closed = period > 0
        first, last = np.zeros((2, *parameters.shape))
        np.divide(low, period, out=first, where=is_closed)
        np.divide(high, period, out=last, where=is_closed)
        first, last = np.ceil(first), np.floor(last)
        is_empty = ~((low <= 0) & (high >= 0) | is_closed) | ~np.isfinite(high - low)
        count = np.where(is_empty, 0.0, np.maximum(last - first + 1.0, 0.0))
        return first, count.astype(np.intp)

    def _answer(self, face: Ints, point: Ints, found: Windings, near_border: Ints) -> Ints:
        """Answers for points on faces (m,), from winding numbers about copies of them.

        A copy of a point that is at a border is undecided, and one that is at a seam or a pole
        alone has material beside it. Another copy may be inside for certain. `near_border` are
        copies at seams that have a border near.
        """
        at_border, at_seam = np.zeros((2, len(point)), bool)
        is_border = self.is_border[found.coedges]
        at_border[found.rows[is_border]] = True
        at_border[near_border] = True
        at_seam[found.rows[~is_border]] = True
        inside = np.full(len(face), OUTSIDE)
        inside[point[at_seam & ~at_border]] = INSIDE
        inside[point[at_border]] = UNDECIDED
        inside[point[~(at_seam | at_border) & (found.numbers == 1)]] = INSIDE
        inside[self.first_loop[face] == self.first_loop[face + 1]] = UNDECIDED
        return inside
