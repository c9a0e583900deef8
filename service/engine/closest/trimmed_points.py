"""Which points of cells are inside of the trims of their nets, in the search for closest points.

Proof in docs/proofs.md: "Closest points of a part".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.cells.cell_trims import INSIDE, UNDECIDED
from service.engine.cells.tree import CellTree
from service.engine.trims.trimmed_nets import NetTrims


@dataclass(frozen=True, eq=False, slots=True)
class TrimmedPoints:
    """The trims of the nets of a tree of cells."""

    cells: CellTree
    trims: NetTrims

    def find_gaps(self, cell: Ints) -> FloatArray:
        """How far borders may be from cells (m,) that stand for them."""
        gaps: FloatArray = self.trims.gaps[self.cells.net.take(cell)]
        return gaps

    def find_inside(self, cell: Ints, parameters: FloatArray, *, tests_all: bool = False) -> Ints:
        """Where parameters (2, m) of the nets of cells (m,) are, which are in these cells.

        Near the sides of cells that are inside they are undecided without a test, unless it
        `tests_all`.
        """
        cells, net = self.cells, self.cells.net.take(cell)
        is_cut = cells.is_cut.take(cell)
        rows = (~is_cut).nonzero()[0]
        rectangle = cells.rectangle.take(cell[rows], axis=1)
        is_near = self.trims.needs_test(net[rows], rectangle, parameters[:, rows])
        answers = np.full(len(cell), INSIDE)
        answers[rows[is_near]] = UNDECIDED
        is_cut[rows] = is_near & tests_all
        rows = is_cut.nonzero()[0]
        if len(rows):
            answers[rows] = self.trims.find_inside(net[rows], parameters[:, rows])
        return answers

    def find_reaches(self, cell: Ints, answers: Ints) -> FloatArray:
        """How far points of cells (m,) with these answers may be from points that are inside."""
        reaches = self.trims.reaches[self.cells.net.take(cell)]
        return np.where(answers == UNDECIDED, reaches, 0.0)
