"""Splits the sides of cells into segments that neighbouring cells share, and finds roots on them.

Cells of different sizes meet along a line. Their sides on this line are dyadic intervals, so two
sides are nested or disjoint. The smallest sides are the *segments*; each side is a row of segments,
except for gaps, where the search dropped the neighbouring cells because they have no root of f. A
root of f on a segment is a *node*. It is computed once for all cells that have the segment on a
side; so neighbours share their nodes, and polylines have no gaps. The sign of f at a corner of
several cells is decided once, too, because the values of two patches may differ by rounding; the
polynomials on segments get these signs at their ends. Zero counts as positive.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.sections.borders import ONE, BorderLines
from service.engine.sections.cells import EndedCells
from service.engine.sections.coefficients import find_roots
from service.engine.sections.sides import CellSides, is_change, number_corners
from service.surface.sides import BEGINS, ENDS

MIN_NEGATIVE = 2.0**-1000
"""If a coefficient at the end of a segment should be negative, but is not because of rounding, it
becomes −MIN_NEGATIVE."""


@dataclass(frozen=True, eq=False, slots=True)
class Segments:
    """The segments, the V distinct places at corners, and the N nodes of n cells.

    Attributes
    ----------
    corner : ndarray of int, shape (n, 4)
        The number of the place at each corner of a cell. The places are also the first V nodes.
    value : ndarray of float64, shape (V,)
        f at the places.
    first, last : ndarray of int, shape (n, 4)
        The segments of each side have the numbers first … last − 1.
    side : ndarray of int, shape (G,)
        The side that each segment is: that of the cell with the least number, if it is of two.
    ends : ndarray of int, shape (G, 2)
        The places at which the G segments begin and end.
    in_plane : ndarray of bool, shape (G,)
        Whether each segment lies in the plane.
    root_segment, root_node : ndarray of int, shape (R,)
        The segment and the node of each root; segments ascend.
    root_at : ndarray of float64, shape (R,)
        The coordinate of each root on its line.
    node_net, node_plane : ndarray of int, shape (N,)
        A net on which each node lies, and the plane of its section.
    node_parameters : ndarray of float64, shape (2, N)
        The parameters of each node in this net.
    """

    corner: Ints
    value: FloatArray
    first: Ints
    last: Ints
    side: Ints
    ends: Ints
    in_plane: Bools
    root_segment: Ints
    root_node: Ints
    root_at: FloatArray
    node_net: Ints
    node_plane: Ints
    node_parameters: FloatArray


def find_segments(cells: EndedCells, sides: CellSides, borders: BorderLines) -> Segments:
    """Find the segments of all sides of cells, and the roots on them."""
    corner, first_corners = number_corners(cells, borders)
    cell_of_place, corner_of_place = np.divmod(first_corners, 4)
    value = cells.corner_values[corner_of_place, cell_of_place]
    checkpoint()
    side, first, last = _find_smallest(sides)
    checkpoint()
    cell, side_of_cell = np.divmod(side, 4)
    ends = np.stack([corner[cell, BEGINS[side_of_cell]], corner[cell, ENDS[side_of_cell]]], axis=1)
    is_reversed = sides.step[side] < 0
    ends[is_reversed] = ends[is_reversed, ::-1]
    segment, t, in_plane = _find_segment_roots(cells, side, is_reversed, value[ends])
    low, high = sides.low[side][segment], sides.high[side][segment]
    coordinates = np.asarray(low + t * (high - low), np.float64)
    # A root at an end of its segment is the node of this place; other roots have their own nodes.
    node = np.where(t == 0, ends[segment, 0], ends[segment, 1])
    inner_roots = np.flatnonzero((t > 0) & (t < 1))
    # A double root is one node.
    is_new = is_change(segment[inner_roots], t[inner_roots])
    node[inner_roots] = len(value) - 1 + np.cumsum(is_new)
    inner_roots = inner_roots[is_new]

    checkpoint()
    corner_parameters = np.stack(
        [
            cells.rectangle[corner_of_place // 2, cell_of_place],
            cells.rectangle[2 + corner_of_place % 2, cell_of_place],
        ]
    )
    cell_of_root, side_of_root = np.divmod(side[segment[inner_roots]], 4)
    cell_of_node = np.concatenate([cell_of_place, cell_of_root])
    root_parameters = sides.convert_to_parameters(
        cells, cell_of_root, side_of_root, coordinates[inner_roots]
    )
    return Segments(
        corner,
        value,
        first.reshape(-1, 4),
        last.reshape(-1, 4),
        side,
        ends,
        in_plane,
        segment,
        node,
        coordinates,
        cells.net[cell_of_node],
        cells.plane[cell_of_node],
        np.concatenate([corner_parameters / ONE, root_parameters], axis=1),
    )


def _find_smallest(sides: CellSides) -> tuple[Ints, Ints, Ints]:
    """Find the smallest sides, which are the segments; of equal sides the first is chosen.

    Sides without length have no segments.

    Returns
    -------
    side : ndarray of int, shape (G,)
        The sides that are segments, along each line.
    first, last : ndarray of int, shape (4 n,)
        The segments of every side have the numbers first … last − 1.
    """
    order = np.lexsort((-sides.high, sides.low, sides.across, sides.line, sides.plane))
    order = order[sides.has_length[order]]
    is_first = is_change(sides.plane[order], sides.line[order], sides.across[order])
    line = np.cumsum(is_first).astype(np.int64)
    low, high = sides.low[order], sides.high[order]
    distinct = np.flatnonzero(is_change(line, low, high))
    # A longer side comes before the sides inside it; so a side is smallest if the next one on its
    # line does not begin inside it.
    next_side = np.append(distinct[1:], distinct[-1:])
    is_smallest = (line[next_side] != line[distinct]) | (low[next_side] >= high[distinct])
    is_smallest[-1:] = True
    smallest = distinct[is_smallest]
    first, last = np.zeros((2, len(sides.low)), np.intp)
    key = (line << 32) | low  # in the order of `order`: by line, then by coordinate
    first[order] = np.searchsorted(key[smallest], key)
    last[order] = np.searchsorted(key[smallest], (line << 32) | high)
    return order[smallest], first, last


def _find_segment_roots(
    cells: EndedCells, side: Ints, is_reversed: Bools, end_values: FloatArray
) -> tuple[Ints, FloatArray, Bools]:
    """Find the roots of f on segments; `side` has the side of a cell that each segment is.

    `end_values` (G, 2) are the values of f that determine the signs at both ends of a segment.

    Returns
    -------
    segment : ndarray of int, shape (R,)
        The segment of each root.
    t : ndarray of float64, shape (R,)
        Its parameter on the segment, from 0 to 1.
    in_plane : ndarray of bool, shape (G,)
        Whether each segment lies in the plane.
    """
    cell, side_of_cell = np.divmod(side, 4)
    counts = cells.counts[side_of_cell, cell]
    in_plane = np.zeros(len(side), bool)
    parts = [(np.zeros(0, np.intp), np.zeros(0))]
    for count in np.bincount(counts).nonzero()[0].tolist():
        chosen = (counts == count).nonzero()[0]
        rows = cells.sides[:count, side_of_cell[chosen], cell[chosen]]
        rows = np.where(is_reversed[chosen], rows[::-1], rows)
        in_plane[chosen] = ~rows.any(axis=0)
        for end in (0, -1):
            is_negative = end_values[chosen, end] < 0
            has_wrong_sign = (rows[end] < 0) != is_negative
            right_values = np.where(is_negative, -MIN_NEGATIVE, 0.0)
            rows[end, has_wrong_sign] = right_values[has_wrong_sign]
        number, t = find_roots(rows, cells.threshold[cell[chosen]])
        parts.append((chosen[number], t))
    segment, t = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.lexsort((t, segment))
    return segment[order], t[order], in_plane
