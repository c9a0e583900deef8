"""The lines and places on which the sides of cells lie.

Cells of different patches meet on lines of `borders`; cells of one patch also meet on lines within
the patch. Lines have numbers, places have names of two numbers. Cells that share a line or a corner
compute the same number or name for it.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.sections.borders import LINE, ONE, BorderLines
from service.engine.sections.cells import EndedCells
from service.surface.sides import along_sides


@dataclass(frozen=True, eq=False, slots=True)
class CellSides:
    """The sides of n cells: side k of cell i has number 4 i + k.

    Attributes
    ----------
    plane : ndarray of int, shape (4 n,)
        The number of the plane of the cell.
    has_length : ndarray of bool, shape (4 n,)
        Whether the line is more than one point.
    line : ndarray of int, shape (4 n,)
        The number of the line: first the lines of `BorderLines`; then for every net one number for
        all lines of constant u, and one for all lines of constant v.
    across : ndarray of int, shape (4 n,)
        The constant parameter, which distinguishes parallel lines of a net; 0 on lines of
        `BorderLines`.
    low, high : ndarray of int, shape (4 n,)
        The interval of coordinates on the line.
    start, step : ndarray of int, shape (4 n,)
        The parameter t along the side has the coordinate start + step · t on the line. If `step`
        is negative, the side and its line run in opposite directions.
    """

    plane: Ints
    has_length: Bools
    line: Ints
    across: Ints
    low: Ints
    high: Ints
    start: Ints
    step: Ints

    def convert_to_parameters(
        self, cells: EndedCells, cell: Ints, side: Ints, coordinates: FloatArray
    ) -> FloatArray:
        """Convert `coordinates` (k,) on the lines of sides to parameters (2, k) of the nets."""
        k = 4 * cell + side
        varying = (coordinates - self.start[k]) / self.step[k] / ONE
        fixed = cells.rectangle[side, cell] / ONE
        is_u = side < 2
        return np.stack([np.where(is_u, fixed, varying), np.where(is_u, varying, fixed)])


def find_sides(cells: EndedCells, borders: BorderLines) -> CellSides:
    """Find the lines and intervals of the sides of all cells."""
    # Here all arrays have the sides as the axis before the last.
    side = np.arange(4)[:, np.newaxis]
    is_outer = cells.rectangle == side % 2 * ONE
    border = borders.line[cells.net].T
    line = np.where(is_outer, border, borders.count + 2 * cells.net + side // 2)
    across = np.where(is_outer, 0, cells.rectangle)
    start = np.where(is_outer, borders.start[cells.net].T, 0)
    step = np.where(is_outer, borders.step[cells.net].T, 1)
    ends = start + step * np.stack(along_sides(cells.rectangle[:2], cells.rectangle[2:]), axis=1)
    has_length = ~(is_outer & borders.is_point[border])
    columns = np.stack([line, across, ends.min(axis=0), ends.max(axis=0), start, step])
    columns = columns.transpose(0, 2, 1).reshape(6, -1)
    return CellSides(np.repeat(cells.plane, 4), has_length.T.ravel(), *columns)


def number_corners(cells: EndedCells, borders: BorderLines) -> tuple[Ints, Ints]:
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
    # coordinate) on a line of `borders`, and as in `BorderLines.ends` at an end of such a line: at
    # the coordinate 0 or `LINE`.
    names = np.zeros((2, n, 4), np.int64)
    for corner in range(4):
        u, v = cells.rectangle[corner // 2], cells.rectangle[2 + corner % 2]
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


def is_change(*columns: Ints | FloatArray) -> Bools:
    """Whether each row of sorted columns (m,) differs from the row before; true for the first."""
    changes = np.ones(len(columns[0]), bool)
    changes[1:] = False
    for column in columns:
        changes[1:] |= column[1:] != column[:-1]
    return changes
