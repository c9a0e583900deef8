"""The search for the cells of a section by halving, which misses no loop.

A cell in which the section is not a graph (`coefficients`) is halved in both directions. A cell
with a graph is halved along the parameter of the graph, until each piece of the graph is within the
tolerance of its chord (`flatness`), and along the other parameter, too, while a piece may reach all
of its values in the cell. Cells with a side in the plane are halved along this side, until it is
within the tolerance of its chord. If the section is still not a graph in a cell of the size
`MIN_SIZE`, the cell is *singular*: near it the surface touches the plane, or the section crosses
itself. If the section is not a graph in more than `MAX_UNCLEAR_CELLS` cells of one patch, these lie
along a curve; then the size of singular cells is `RELATIVE_SIZE` times the tolerance instead,
which is mostly larger.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import row_slices
from service.cancellation import checkpoint
from service.engine.nets.nets import Nets
from service.engine.sections.borders import ONE
from service.engine.sections.cells import (
    COPLANAR,
    EDGE_ERROR,
    OVER_U,
    OVER_V,
    SINGULAR,
    EndedCells,
    LocalPlanes,
    OpenCells,
    build_cells,
)
from service.engine.sections.coefficients import bound_slopes, classify_cells, find_border_points
from service.engine.sections.flatness import Pieces, bound_pieces, bound_sides
from service.engine.vectors import project

MIN_SIZE = 2.0**-20
"""The size of singular cells, in the coordinates of the nets. Heights grow with the square of the
distance from a point where the surface touches the plane, so in such cells they are about
`cells.THICKNESS`."""

MAX_UNCLEAR_CELLS = 128
"""If the section by one plane is not a graph in more cells of one patch, these cells lie along a
curve, because only about 16 such cells lie around a point where a section crosses itself."""

RELATIVE_SIZE = 1 / 8
"""The size of singular cells along a curve, in units of the tolerance."""

MAX_CHANGE = 0.1
"""The expected number of pieces is reliable if it changes by at most this part from one level to
the next."""

MAX_NUMBERS = 1 << 18
"""The most coefficients in one array, to bound the memory."""


@dataclass(eq=False, slots=True)
class CellSearch:
    """The search for the cells of one group of nets.

    Attributes
    ----------
    width : int
        At least the number of coefficients of any side of a net, of any group.
    tolerance : float
        In the coordinates of the nets.
    allow : callable
        Is called with a lower bound of the number of cells, and with a number that the final number
        will probably exceed; raises an error if one of them is too large.
    is_lowered : bool
        Whether the search is for sections of solids.
    deviation : float
        The largest bound of the distance of a piece from its chord.
    """

    group: Nets
    planes: LocalPlanes
    width: int
    tolerance: float
    allow: Callable[[int, float], None]
    is_lowered: bool = False
    deviation: float = 0.0
    _pieces: float = 0.0
    """The expected number of pieces in the cells of the present level: the sum of √(bound /
    tolerance), because bounds are of the second order in the size of cells. In tests this sum was
    0.6 to 1.7 times the final number from the third level on, and 0.6 to 1 times if it changed by
    less than `MAX_CHANGE`."""

    def find(self, plane: Ints, net: Ints) -> tuple[list[EndedCells], Bools]:
        """Find the cells that the sections meet, for m pairs of a plane and a net.

        Also returns for which pairs (m,) the patch lies in the plane.
        """
        cells = build_cells(self.group, self.planes, plane, net)
        is_coplanar, ended = cells.is_coplanar, list[EndedCells]()
        count, expected = 0, 0.0
        while len(cells := _keep_near(cells)):
            kind, sense, is_monotone = _classify(cells.nets)
            kind[cells.is_coplanar] = COPLANAR
            along_u, along_v = self._choose_halvings(cells, kind, is_monotone)
            change = abs(count + self._pieces - expected)
            expected = count + self._pieces
            # While the sum changes, it may be too large (`_pieces`): then use half of it.
            self.allow(count + len(cells), expected / (1 if change <= MAX_CHANGE * expected else 2))
            is_ended = ~(along_u | along_v)
            count += int(np.count_nonzero(is_ended))
            checkpoint()
            if is_ended.any():
                rows = is_ended.nonzero()[0]
                ended.append(
                    cells.take(rows).end(kind[rows], sense[rows], is_monotone[rows], self.width)
                )
            if is_ended.all():
                break
            cells = cells.halve_some(along_u, along_v)
        return ended, is_coplanar

    def _choose_halvings(self, cells: OpenCells, kind: Ints, is_monotone: Bools) -> Bools:
        """Which cells are halved along u, and along v: shape (2, n)."""
        checkpoint()
        self._pieces = 0.0
        is_unclear = kind == SINGULAR
        is_crowded = np.bincount(cells.pair, is_unclear)[cells.pair] > MAX_UNCLEAR_CELLS
        min_size = np.where(is_crowded, self.tolerance * RELATIVE_SIZE, MIN_SIZE)
        if is_unclear.any():
            is_unclear &= self._estimate_sizes(cells) > min_size
        is_halved = np.stack([is_unclear, is_unclear])
        # The kinds `OVER_U` and `OVER_V` are 0 and 1, the axes of these parameters.
        for axis in (OVER_U, OVER_V):
            cells_with_graph = np.flatnonzero(kind == axis)
            for chunk in row_slices(len(cells_with_graph), cells.nets[..., 0].size, MAX_NUMBERS):
                rows = cells_with_graph[chunk]
                is_flat_graph, is_wide = self._are_flat(cells.take(rows), axis, is_monotone[rows])
                is_halved[axis, rows] = ~is_flat_graph
                is_halved[1 - axis, rows] = ~is_flat_graph & is_wide
        for side, coefficients in enumerate(cells.take_sides()):
            checkpoint()
            axis = 1 - side // 2  # the parameter that varies along the side
            is_in_plane = ~coefficients.any(axis=0) & (kind != SINGULAR)
            # Of a patch that lies in the plane, only the border is a polyline.
            is_in_plane &= (kind != COPLANAR) | (cells.rectangle[side] == (side % 2) * ONE)
            rows = np.flatnonzero(is_in_plane & ~is_halved[axis])
            if len(rows):
                is_halved[axis, rows] = ~self._have_straight_side(cells.take(rows), side, axis)
        is_halved &= cells.lengths > 1
        return is_halved

    def _estimate_sizes(self, cells: OpenCells) -> FloatArray:
        """Approximate sizes (n,) of cells on the surface."""
        points = project(self.group.nets, -1)
        net = cells.net - self.group.first
        sizes = np.zeros(len(cells))
        for axis, lengths in enumerate(cells.lengths):
            steps = np.abs(np.diff(points, axis=axis + 1)).max(axis=(1, 2, 3))
            sizes += (steps * self.group.degree[axis])[net] * lengths
        return sizes / ONE

    def _are_flat(self, cells: OpenCells, axis: int, is_monotone: Bools) -> tuple[Bools, Bools]:
        """In which cells all pieces of the graph are near enough to their chords, shape (n,).

        The second result, of shape (n,), says in which of the cells a piece may reach every value
        of the other parameter.
        """
        cell, parameters = find_border_points(cells, axis)
        checkpoint()
        # Border points are in turn beginnings and ends of pieces.
        cell_of_piece, ends = cell[::2], (parameters[:, ::2], parameters[:, 1::2])
        pieces = build_pieces(cells, axis, is_monotone, cell_of_piece, ends)
        across = 1 - axis
        low, high = pieces.rectangle[2 * across], pieces.rectangle[2 * across + 1]
        bound, slack = bound_pieces(self.group, self.planes, pieces, tries_both=self.is_lowered)
        max_bound = np.zeros(len(cells))
        # Halving does not reduce the slack for rounding, so count at most half of the tolerance for
        # it: then the rest is left for the errors that halving reduces.
        np.maximum.at(max_bound, cell_of_piece, np.minimum(slack, self.tolerance / 2) + bound)
        is_wide = np.zeros(len(cells), bool)
        is_wide[cell_of_piece] = (high - low) * ONE >= cells.lengths[across, cell_of_piece]
        is_flat = self._are_small(max_bound, cells.lengths[axis])
        bounds = (bound + slack)[is_flat[cell_of_piece]]
        self.deviation = max(self.deviation, float(bounds.max(initial=0.0)))
        return is_flat, is_wide & ~is_monotone

    def _have_straight_side(self, cells: OpenCells, side: int, axis: int) -> Bools:
        """In which cells this side, which lies in the plane, is near enough to its chord."""
        rectangle = cells.rectangle / ONE
        rectangle[2 - 2 * axis : 4 - 2 * axis] = rectangle[side]
        bounds = bound_sides(self.group, cells.net, rectangle, axis)
        is_flat = self._are_small(bounds, cells.lengths[axis])
        self.deviation = max(self.deviation, float(bounds[is_flat].max(initial=0.0)))
        return is_flat

    def _are_small(self, bounds: FloatArray, lengths: Ints) -> Bools:
        """Which bounds are small enough, or belong to cells that cannot be halved.

        Also adds the pieces that these cells are expected to need to `_pieces`.
        """
        self._pieces += float(np.sqrt(np.maximum(bounds / self.tolerance, 1.0)).sum())
        return np.asarray((bounds <= self.tolerance) | (lengths <= 1))


def build_pieces(
    cells: OpenCells,
    axis: int,
    is_monotone: Bools,
    cell_of_piece: Ints,
    ends: tuple[FloatArray, FloatArray],
) -> Pieces:
    """Pieces (m,) of graphs over u (`axis` 0) or v (1) in cells, with rectangles that contain them.

    `is_monotone` says it of the cells. `ends` are the parameters (2, m) of both ends; they ascend
    along the axis.
    """
    # A piece is in a rectangle: at first from its begin to its end along the axis, the whole cell
    # across.
    begin, end = ends
    rectangle = cells.rectangle.take(cell_of_piece, axis=1) / ONE
    rectangle[2 * axis], rectangle[2 * axis + 1] = begin[axis], end[axis]
    across = 1 - axis
    low, high = rectangle[2 * across], rectangle[2 * across + 1]
    # With slopes of at most K, v is at most K Δu / 2 from the mean of its values at both ends;
    # 2⁻⁵⁰ covers rounding.
    middle = (begin[across] + end[across]) / 2
    radius = bound_slopes(cells, axis)[cell_of_piece] * (end[axis] - begin[axis]) / 2 + 2.0**-50
    np.maximum(low, middle - radius, out=low)
    np.minimum(high, middle + radius, out=high)
    is_tight = is_monotone[cell_of_piece]
    np.copyto(rectangle[::2], np.minimum(begin, end), where=is_tight)
    np.copyto(rectangle[1::2], np.maximum(begin, end), where=is_tight)
    return Pieces(
        rectangle,
        cells.plane[cell_of_piece],
        cells.net[cell_of_piece],
        begin,
        end,
        axis=np.where(is_tight, 2, axis),  # 2: monotone in both parameters
    )


def _classify(nets: FloatArray) -> tuple[Ints, FloatArray, Bools]:
    """Call `classify_cells` for a limited number of cells at a time."""
    slices = row_slices(nets.shape[-1], nets[..., 0].size, MAX_NUMBERS)
    parts = [classify_cells(nets[..., cells]) for cells in slices]
    kind, sense, is_monotone = (np.concatenate(column) for column in zip(*parts, strict=True))
    return kind, sense, is_monotone


def _keep_near(cells: OpenCells) -> OpenCells:
    """The cells that the section may meet; the margin `EDGE_ERROR` covers rounding."""
    checkpoint()
    low, high = cells.nets.min(axis=(0, 1)), cells.nets.max(axis=(0, 1))
    checkpoint()
    return cells.take((low <= EDGE_ERROR) & (high >= -EDGE_ERROR))
