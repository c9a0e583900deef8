"""Cells: rectangles of parameters of a patch, with the coefficients of f over each rectangle.

A cell belongs to a pair of a plane and a net; f is the Bézier polynomial of `heights`: the height
over the plane times the weight. The search halves cells.

Rounding. Halving takes means of two numbers. With u = 2⁻⁵³, it moves coefficients by at most p u
max |f| along u, and by at most q u max |f| along v. There are at most 30 halvings in each
direction, and |f| ≤ 3.5, as coordinates are at most 1. So the errors of coefficients are at most
105 (p + q) u. This is less than `heights.THICKNESS` for p + q ≤ 78, and 1.5e-12 for degrees of 64.
The section in each cell is therefore exactly the section of a surface whose points are moved by at
most this perpendicular to the plane.

On a side, f is computed from the control points of this side alone, by the same operations in both
directions. So f has the same bits in two patches whose control points on an edge are the same. If
they are not the same (because degrees differ, or weights differ by a factor, or nets are thirds of
triangles), f differs by at most

    2 n u Σ_k min(3.5, 7 n / 2^k) ≤ 7 n u (log₂ n + 3),

where n is the degree on the edge and k counts halvings, because max |f| halves with a cell that
meets the plane. This difference and the rounding of the control points together are less than
`heights.NOISE` for n ≤ 10.
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.nets.subdivision import halve
from service.surface.sides import take_side

OVER_U, OVER_V, BELOW, ABOVE, SINGULAR, COPLANAR = range(6)
"""Kinds of cells: the section is a graph over u; a graph over v; f ≤ 0; f ≥ 0; the section is not
known to be a graph; the patch lies in the plane."""


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """The n cells of nets of one group in which a search ends.

    Attributes
    ----------
    plane, net, kind : ndarray of int, shape (n,)
    place : ndarray of int, shape (4, n)
        The rectangle [u₀, u₁] × [v₀, v₁], in units of 1 / `borders.ONE`.
    sense : ndarray of float64, shape (n,)
        The direction in which a graph has f > 0 on its left: 1 toward larger parameters, −1 toward
        smaller parameters; 0 for other kinds.
    floor : ndarray of float64, shape (n,)
        The largest absolute value of coefficients whose signs are not reliable (`roots`).
    rows : tuple of ndarray of float64
        The coefficients of f on the four sides: shapes (n, q+1) twice and (n, p+1) twice.
    """

    plane: Ints
    net: Ints
    kind: Ints
    place: Ints
    sense: FloatArray
    floor: FloatArray
    rows: tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False, slots=True)
class OpenCells:
    """The n cells that a search examines, each with the coefficients of f.

    Attributes
    ----------
    pair : ndarray of int, shape (n,)
        Number of the pair of a plane and a net.
    plane, net : ndarray of int, shape (n,)
    place : ndarray of int, shape (4, n)
        As in `Cells`.
    nets : ndarray of float64, shape (n, p+1, q+1)
        Coefficients of f.
    coplanar : ndarray of bool, shape (n,)
        Whether the patch lies in the plane.
    floor : ndarray of float64, shape (n,)
    """

    pair: Ints
    plane: Ints
    net: Ints
    place: Ints
    nets: FloatArray
    coplanar: Bools
    floor: FloatArray

    def __len__(self) -> int:
        return len(self.pair)

    def take(self, rows: Ints | Bools) -> "OpenCells":
        """The cells with these rows."""
        return OpenCells(
            self.pair[rows],
            self.plane[rows],
            self.net[rows],
            self.place[:, rows],
            self.nets[rows],
            self.coplanar[rows],
            self.floor[rows],
        )

    def end(self, kind: Ints, sense: FloatArray) -> Cells:
        """End the search in these cells, with their final kinds (n,) and senses (n,)."""
        a, b, c, d = (take_side(self.nets, side).copy() for side in range(4))
        return Cells(self.plane, self.net, kind, self.place, sense, self.floor, (a, b, c, d))

    def halve(self, along_u: Bools, along_v: Bools) -> "OpenCells":
        """Halve cells along u, along v or along both; cells with neither are omitted."""
        parts = []
        for is_along_u, is_along_v in ((True, False), (False, True), (True, True)):
            cells_to_halve = self.take(
                np.flatnonzero((along_u == is_along_u) & (along_v == is_along_v))
            )
            pieces = [cells_to_halve] if len(cells_to_halve) else []
            for axis, is_halved in ((0, is_along_u), (1, is_along_v)):
                if is_halved:
                    checkpoint()
                    pieces = [half for piece in pieces for half in piece._halves(axis)]
            parts += pieces
        if not parts:
            return self.take(np.zeros(0, np.intp))
        checkpoint()
        return OpenCells(
            np.concatenate([part.pair for part in parts]),
            np.concatenate([part.plane for part in parts]),
            np.concatenate([part.net for part in parts]),
            np.concatenate([part.place for part in parts], axis=1),
            np.concatenate([part.nets for part in parts]),
            np.concatenate([part.coplanar for part in parts]),
            np.concatenate([part.floor for part in parts]),
        )

    def _halves(self, axis: int) -> "tuple[OpenCells, OpenCells]":
        """The lower halves and the upper halves of all cells along one axis."""
        halves = []
        middle = (self.place[2 * axis] + self.place[2 * axis + 1]) // 2
        nets = np.empty((*self.nets.shape[1:], 2, len(self)))
        halve(self.nets.transpose(1, 2, 0), axis, nets)
        for end in range(2):
            place = self.place.copy()
            place[2 * axis + 1 - end] = middle
            halves.append(replace(self, place=place, nets=nets[:, :, end].transpose(2, 0, 1)))
        return halves[0], halves[1]


def join_cells(parts: list[Cells]) -> Cells:
    """Join lists of cells of one group."""
    if not parts:
        no_numbers, rows = np.zeros(0, np.intp), np.zeros((0, 2))
        return Cells(
            no_numbers,
            no_numbers,
            no_numbers,
            np.zeros((4, 0), np.int64),
            rows[:, 0],
            rows[:, 0],
            (rows,) * 4,
        )
    a, b, c, d = (np.concatenate([part.rows[side] for part in parts]) for side in range(4))
    return Cells(
        np.concatenate([part.plane for part in parts]),
        np.concatenate([part.net for part in parts]),
        np.concatenate([part.kind for part in parts]),
        np.concatenate([part.place for part in parts], axis=1),
        np.concatenate([part.sense for part in parts]),
        np.concatenate([part.floor for part in parts]),
        (a, b, c, d),
    )
