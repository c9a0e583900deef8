"""Sides of cells cut into segments that all cells on them share, and the roots of f on these.

Cells of different sizes meet along a line. All of their sides on it are dyadic, so that two of them
lie in each other or apart: the smallest are the *segments*, and each side is a row of them, but for
gaps where f has no root. Whatever cell asks, a root is found once, on its segment, and is a *node*;
so neighbours share their nodes, and polylines close. Likewise the sign of f at a place that is the
corner of several cells is decided once, and the polynomial of each segment is given the signs of
its ends: the numbers of two patches may differ there by rounding. Zero counts as positive.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.sections.borders import LINE, ONE, Borders
from service.engine.sections.cells import Cells
from service.engine.sections.flatness import is_zero
from service.engine.sections.roots import roots
from service.surface.sides import BEGINS, ENDS

TINY = 2.0**-1000
"""What a coefficient becomes whose sign is wrong by rounding."""


@dataclass(frozen=True, eq=False, slots=True)
class CellTable:
    """Cells of all groups, n in number, one after another; columns as of `Cells`.

    `parts` are the cells of each group, `first` the number of the first of each.
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
        """The cells of some groups."""
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
        """Numbers f at the corners of cells, (n, 4)."""
        ends = [
            np.stack([p.rows[0][:, 0], p.rows[0][:, -1], p.rows[1][:, 0], p.rows[1][:, -1]], axis=1)
            for p in self.parts
        ]
        return np.concatenate(ends)


@dataclass(frozen=True, eq=False, slots=True)
class Segments:
    """Segments, places and nodes of cells.

    Attributes
    ----------
    corner : ndarray of int, shape (n, 4)
        Number of the place at each corner of a cell; place k is node k.
    value : ndarray of float64, shape (V,)
        f at places.
    first, last : ndarray of int, shape (n, 4)
        The segments of a side: first … last − 1.
    ends : ndarray of int, shape (G, 2)
        Places at which segments begin and end.
    in_plane : ndarray of bool, shape (G,)
        Segments that lie in the plane.
    side_in_plane : ndarray of bool, shape (n, 4)
        Sides of cells that do.
    backward : ndarray of bool, shape (n, 4)
        Sides that run against their line.
    root_segment, root_node : ndarray of int, shape (R,)
        Roots, ascending by segment: the segment, the node.
    root_at : ndarray of float64, shape (R,)
        Coordinate on the line.
    node_net, node_plane : ndarray of int, shape (N,)
    node_place : ndarray of float64, shape (2, N)
        Where nodes are: a net, and its parameters.
    """

    corner: Ints
    value: FloatArray
    first: Ints
    last: Ints
    ends: Ints
    in_plane: Bools
    side_in_plane: Bools
    backward: Bools
    root_segment: Ints
    root_node: Ints
    root_at: FloatArray
    node_net: Ints
    node_plane: Ints
    node_place: FloatArray


def find_segments(cells: CellTable, borders: Borders) -> Segments:
    """The segments of all sides of cells, and the roots on them."""
    corner, chosen = _corners(cells, borders)
    value = cells.corner_values().ravel()[chosen]
    sides = _Sides.of(cells, borders)
    order = np.lexsort((-sides.high, sides.low, sides.across, sides.line, sides.plane))
    order = order[sides.has_length[order]]
    is_first = _changes(sides.plane[order], sides.line[order], sides.across[order])
    run = np.cumsum(is_first).astype(np.int64)
    low, high = sides.low[order], sides.high[order]
    is_new = _changes(run, low, high)
    lone = np.flatnonzero(is_new)
    # Of sides that lie in each other the next is inside.
    following = np.append(lone[1:], -1)
    smallest = (run[following] != run[lone]) | (low[following] >= high[lone])
    smallest[-1:] = True
    chosen_sides = lone[smallest]
    key = (run << 32) | low
    first, last = np.zeros((2, len(cells.net) * 4), np.intp)
    begins = key[chosen_sides]
    first[order] = np.searchsorted(begins, key)
    last[order] = np.searchsorted(begins, (run << 32) | high)

    side = order[chosen_sides]
    cell, number = np.divmod(side, 4)
    ends = np.stack([corner[cell, BEGINS[number]], corner[cell, ENDS[number]]], axis=1)
    turned = sides.backward[side]
    ends[turned] = ends[turned, ::-1]
    segment, t, in_plane = _segment_roots(cells, side, turned, value[ends])
    span = (high - low)[chosen_sides]
    at = low[chosen_sides][segment] + t * span[segment]
    node = np.where(t == 0, ends[segment, 0], ends[segment, 1])
    inner = np.flatnonzero((t > 0) & (t < 1))
    again = np.zeros(len(inner), bool)  # the second of a double root is the node of the first
    again[1:] = (np.diff(segment[inner]) == 0) & (np.diff(t[inner]) == 0)
    node[inner] = len(value) - 1 + np.cumsum(~again)
    inner = inner[~again]

    places = _corner_places(cells)[:, chosen]
    owner, which = np.divmod(side[segment[inner]], 4)
    net = np.concatenate([cells.net[chosen // 4], cells.net[owner]])
    plane = np.concatenate([cells.plane[chosen // 4], cells.plane[owner]])
    where = sides.local(cells, owner, which, at[inner])
    zero = np.concatenate(
        [np.stack([is_zero(row) for row in part.rows], axis=1) for part in cells.parts]
    )
    return Segments(
        corner,
        value,
        first.reshape(-1, 4),
        last.reshape(-1, 4),
        ends,
        in_plane,
        zero,
        sides.backward.reshape(-1, 4),
        segment,
        node,
        at,
        net,
        plane,
        np.concatenate([places, where], axis=1),
    )


def root_places(
    cells: CellTable, borders: Borders, cell: Ints, side: Ints, at: FloatArray
) -> FloatArray:
    """Parameters (2, k) of roots on sides of cells in the nets of these."""
    return _Sides.of(cells, borders).local(cells, cell, side, at)


def _changes(*columns: Ints) -> Bools:
    """Where a row of sorted columns differs from the one before."""
    found = np.ones(len(columns[0]), bool)
    found[1:] = False
    for column in columns:
        found[1:] |= column[1:] != column[:-1]
    return found


@dataclass(frozen=True, eq=False, slots=True)
class _Sides:
    """Sides of cells, (4 n,): the line, the coordinate across it, the interval along it."""

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
    def of(cells: CellTable, borders: Borders) -> "_Sides":
        """The sides of all cells."""
        n = len(cells.net)
        line, across, low, high, start, step = np.zeros((6, n, 4), np.intp)
        has_length = np.ones((n, 4), bool)
        for side in range(4):
            along = 1 - side // 2
            outer = cells.place[side] == (side % 2) * ONE
            own = borders.line[cells.net, side]
            line[:, side] = np.where(outer, own, borders.count + 2 * cells.net + side // 2)
            across[:, side] = np.where(outer, 0, cells.place[side])
            start[:, side] = np.where(outer, borders.start[cells.net, side], 0)
            step[:, side] = np.where(outer, borders.step[cells.net, side], 1)
            ends = start[:, side] + step[:, side] * cells.place[2 * along : 2 * along + 2]
            low[:, side], high[:, side] = ends.min(axis=0), ends.max(axis=0)
            has_length[:, side] = ~(outer & borders.is_point[own])
        plane = np.repeat(cells.plane, 4)
        return _Sides(
            plane,
            line.ravel(),
            across.ravel(),
            low.ravel(),
            high.ravel(),
            (step < 0).ravel(),
            has_length.ravel(),
            start.ravel(),
            step.ravel(),
        )

    def local(self, cells: CellTable, cell: Ints, side: Ints, at: FloatArray) -> FloatArray:
        """Parameters (2, k) of places at coordinates on the lines of sides."""
        k = 4 * cell + side
        along = (at - self.start[k]) / self.step[k] / ONE
        fixed = cells.place[side, cell] / ONE
        is_u = side < 2
        return np.stack([np.where(is_u, fixed, along), np.where(is_u, along, fixed)])


def _corner_places(cells: CellTable) -> FloatArray:
    """Parameters (2, 4 n) of the corners of cells."""
    u, v = cells.place[[0, 0, 1, 1]], cells.place[[2, 3, 2, 3]]
    return np.stack([u.T.ravel(), v.T.ravel()]) / ONE


def _corners(cells: CellTable, borders: Borders) -> tuple[Ints, Ints]:
    """Numbers of the places at corners (n, 4), and for each the first of the 4 n corners there."""
    n = len(cells.net)
    names = np.zeros((2, n, 4), np.int64)
    for corner in range(4):
        u, v = cells.place[corner // 2], cells.place[2 + corner % 2]
        names[0, :, corner] = borders.count + cells.net
        names[1, :, corner] = u * LINE + v
        for side, t, other in ((2 + corner % 2, v, u), (corner // 2, u, v)):
            rows = np.flatnonzero(t == (side % 2) * ONE)
            net = cells.net[rows]
            line = borders.line[net, side]
            x = borders.start[net, side] + borders.step[net, side] * other[rows]
            at_end = (x == 0) | (x == LINE) | borders.is_point[line]
            end = borders.ends[line, (x == LINE).astype(np.intp)]
            names[0, rows, corner] = np.where(at_end, end[:, 0], line)
            names[1, rows, corner] = np.where(at_end, end[:, 1], x)
    plane = np.repeat(cells.plane, 4)
    first_name, second_name = names.reshape(2, -1)
    order = np.lexsort((second_name, first_name, plane))
    is_new = _changes(plane[order], first_name[order], second_name[order])
    number = np.empty(4 * n, np.intp)
    number[order] = np.cumsum(is_new) - 1
    return number.reshape(n, 4), order[is_new]


def _segment_roots(
    cells: CellTable, side: Ints, turned: Bools, ends: FloatArray
) -> tuple[Ints, FloatArray, Bools]:
    """Roots on segments, each a side (G,) of a cell: segment, t on it; and which are in the plane.

    `ends` (G, 2) are the values of f whose signs count.
    """
    cell, number = np.divmod(side, 4)
    in_plane = np.zeros(len(side), bool)
    found: list[tuple[Ints, FloatArray]] = []
    group = np.searchsorted(cells.first, cell, side="right") - 1
    for k, part in enumerate(cells.parts):
        for which, rows_of_side in enumerate(part.rows):
            some = np.flatnonzero((group == k) & (number == which))
            rows = rows_of_side[cell[some] - cells.first[k]]
            rows = np.where(turned[some, np.newaxis], rows[:, ::-1], rows)
            in_plane[some] = is_zero(rows)
            for end, sign in ((0, ends[some, 0] < 0), (-1, ends[some, 1] < 0)):
                wrong = (rows[:, end] < 0) != sign
                rows[wrong, end] = np.where(sign[wrong], -TINY, 0.0)
            row, t = roots(rows, part.floor[cell[some] - cells.first[k]])
            found.append((some[row], t))
    segment, t = (np.concatenate(each) for each in zip(*found, strict=True))
    order = np.lexsort((t, segment))
    return segment[order], t[order], in_plane
