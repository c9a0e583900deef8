"""The cells of all groups in one table, and the lines and places on which their sides lie.

Cells of different patches meet on lines of `borders`; cells of one patch also meet on lines within
the patch. Lines have numbers, places have names of two numbers. Cells that share a line or a corner
compute the same number or name for it.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.sections.borders import LINE, ONE, Borders
from service.engine.sections.cells import Cells


@dataclass(frozen=True, eq=False, slots=True)
class CellTable:
    """The n cells of all groups, one group after another; arrays as in `Cells`.

    `parts` are the cells of each group, and `first` has the number of the first cell of each group.
    """

    plane: Ints
    net: Ints
    kind: Ints
    place: Ints
    sense: FloatArray
    parts: tuple[Cells, ...]
    first: Ints

    @staticmethod
    def of(parts: tuple[Cells, ...]) -> "CellTable":
        """Join the cells of several groups."""
        return CellTable(
            np.concatenate([part.plane for part in parts]),
            np.concatenate([part.net for part in parts]),
            np.concatenate([part.kind for part in parts]),
            np.concatenate([part.place for part in parts], axis=1),
            np.concatenate([part.sense for part in parts]),
            parts,
            np.cumsum([0, *(len(part.net) for part in parts)])[:-1],
        )

    def corner_values(self) -> FloatArray:
        """Values of f at the corners of cells, (n, 4)."""
        # Corners 0 and 1 are the ends of side u = 0, corners 2 and 3 those of side u = 1.
        ends = [
            np.stack([p.rows[0][:, 0], p.rows[0][:, -1], p.rows[1][:, 0], p.rows[1][:, -1]], axis=1)
            for p in self.parts
        ]
        return np.concatenate(ends)

    def corner_parameters(self) -> FloatArray:
        """Parameters of the corners of cells, (2, 4 n)."""
        u, v = self.place[[0, 0, 1, 1]], self.place[[2, 3, 2, 3]]
        return np.stack([u.T.ravel(), v.T.ravel()]) / ONE


@dataclass(frozen=True, eq=False, slots=True)
class CellSides:
    """The sides of n cells: side k of cell i has number 4 i + k.

    Attributes
    ----------
    plane : ndarray of int, shape (4 n,)
        The number of the plane of the cell.
    line : ndarray of int, shape (4 n,)
        The number of the line: first the lines of `Borders`; then for every net one number for all
        lines of constant u, and one for all lines of constant v.
    across : ndarray of int, shape (4 n,)
        The constant parameter, which distinguishes parallel lines of a net; 0 on lines of
        `Borders`.
    low, high : ndarray of int, shape (4 n,)
        The interval of coordinates on the line.
    backward : ndarray of bool, shape (4 n,)
        Whether the side and its line run in opposite directions.
    has_length : ndarray of bool, shape (4 n,)
        Whether the line is more than one point.
    start, step : ndarray of int, shape (4 n,)
        The parameter t along the side has the coordinate start + step · t on the line.
    """

    plane: Ints
    line: Ints
    across: Ints
    low: Ints
    high: Ints
    backward: Bools
    has_length: Bools
    start: Ints
    step: Ints

    @staticmethod
    def of(cells: CellTable, borders: Borders) -> "CellSides":
        """The sides of all cells."""
        n = len(cells.net)
        line, across, low, high, start, step = np.zeros((6, n, 4), np.intp)
        has_length = np.ones((n, 4), bool)
        for side in range(4):
            varying_axis = 1 - side // 2
            is_outer = cells.place[side] == (side % 2) * ONE
            border = borders.line[cells.net, side]
            line[:, side] = np.where(is_outer, border, borders.count + 2 * cells.net + side // 2)
            across[:, side] = np.where(is_outer, 0, cells.place[side])
            start[:, side] = np.where(is_outer, borders.start[cells.net, side], 0)
            step[:, side] = np.where(is_outer, borders.step[cells.net, side], 1)
            ends = (
                start[:, side]
                + step[:, side] * cells.place[2 * varying_axis : 2 * varying_axis + 2]
            )
            low[:, side], high[:, side] = ends.min(axis=0), ends.max(axis=0)
            has_length[:, side] = ~(is_outer & borders.is_point[border])
        return CellSides(
            np.repeat(cells.plane, 4),
            line.ravel(),
            across.ravel(),
            low.ravel(),
            high.ravel(),
            (step < 0).ravel(),
            has_length.ravel(),
            start.ravel(),
            step.ravel(),
        )

    def parameters(
        self, cells: CellTable, cell: Ints, side: Ints, coordinates: FloatArray
    ) -> FloatArray:
        """Convert `coordinates` (k,) on the lines of sides to parameters (2, k) of the nets."""
        k = 4 * cell + side
        varying_parameter = (coordinates - self.start[k]) / self.step[k] / ONE
        fixed_parameter = cells.place[side, cell] / ONE
        is_u = side < 2
        return np.stack(
            [
                np.where(is_u, fixed_parameter, varying_parameter),
                np.where(is_u, varying_parameter, fixed_parameter),
            ]
        )


def number_corners(cells: CellTable, borders: Borders) -> tuple[Ints, Ints]:
    """Number the distinct places of the corners of cells.

    Returns
    -------
    number : ndarray of int, shape (n, 4)
        The number of the place of each corner.
    corner : ndarray of int, shape (V,)
        For each place, the first of the 4 n corners at this place.
    """
    n = len(cells.net)
    # The name of a place: (borders.count + net, u and v as one number) inside a net, (line,
    # coordinate) on a line of `borders`, and as in `Borders.ends` at an end of such a line: at the
    # coordinate 0 or `LINE`.
    names = np.zeros((2, n, 4), np.int64)
    for corner in range(4):
        u, v = cells.place[corner // 2], cells.place[2 + corner % 2]
        names[0, :, corner] = borders.count + cells.net
        names[1, :, corner] = u * LINE + v
        for side, t, other_parameter in ((2 + corner % 2, v, u), (corner // 2, u, v)):
            # The cells whose corner is on this side of the net.
            rows = np.flatnonzero(t == (side % 2) * ONE)
            net = cells.net[rows]
            line = borders.line[net, side]
            coordinate = borders.start[net, side] + borders.step[net, side] * other_parameter[rows]
            is_at_end = (coordinate == 0) | (coordinate == LINE) | borders.is_point[line]
            end = borders.ends[line, (coordinate == LINE).astype(np.intp)]
            names[0, rows, corner] = np.where(is_at_end, end[:, 0], line)
            names[1, rows, corner] = np.where(is_at_end, end[:, 1], coordinate)
    checkpoint()
    first_name, second_name = names.reshape(2, -1)
    plane = np.repeat(cells.plane, 4)
    order = np.lexsort((second_name, first_name, plane))
    is_new = is_change(plane[order], first_name[order], second_name[order])
    number = np.empty(4 * n, np.intp)
    number[order] = np.cumsum(is_new) - 1
    return number.reshape(n, 4), order[is_new]


def is_change(*columns: Ints) -> Bools:
    """Whether each row of sorted columns (m,) differs from the row before; true for the first."""
    changes = np.ones(len(columns[0]), bool)
    changes[1:] = False
    for column in columns:
        changes[1:] |= column[1:] != column[:-1]
    return changes
