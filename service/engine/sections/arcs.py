"""Arcs of a section: pairs of nodes on the border of a cell that are the two ends of one piece.

The section is the zero set of f (`cells`) in the cells, and a piece is a connected part of it in
one cell. The nodes are the roots of f on the borders of cells; corners of cells have numbers of
nodes, too (`segments`).

If the section is a graph in a cell, its nodes in the order of the parameter are in turn beginnings
and ends of pieces. If f ≤ 0 in the whole cell, the section meets at most the border of the cell. As
f = 0 counts as positive, the two nodes at the ends of a run of places with f = 0 are the ends of
one piece, which has no length or runs along a side in the plane.

Singular cells that touch each other form one *crossing*. An arc leads from the crossing to each
node on its border. If there are exactly two such arcs, they are joined to one arc. A crossing
without nodes is a point at which the surface touches the plane.

A side of a cell that lies in the plane is an arc, unless it lies between patches that lie in the
plane.

For sections of solids, arcs are as if the plane were a little lower. A side in the plane is an arc
of each cell beside it in which f < 0, and of no other. There are no crossings: in a singular cell,
the nodes at both ends of a run of places with f < 0 are the ends of one piece. So an even number of
arcs meet wherever the surface goes on, and all have senses.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.cancellation import checkpoint
from service.engine.clustering import find_components
from service.engine.sections.borders import ONE
from service.engine.sections.cells import (
    ABOVE,
    BELOW,
    COPLANAR,
    OVER_U,
    OVER_V,
    SINGULAR,
    EndedCells,
)
from service.engine.sections.segments import Segments
from service.engine.sections.sides import CellSides, is_change
from service.surface.sides import BEGINS, ENDS

SENSES_BELOW = np.array([1.0, -1.0, -1.0, 1.0])
"""The sense of sides u₀, u₁, v₀, v₁ of cells with f < 0: side v₀ has f < 0 to its left, since it
runs toward larger u; side u₀ has f < 0 to its right, since it runs toward larger v."""


@dataclass(frozen=True, eq=False, slots=True)
class Arcs:
    """The A arcs of sections in n cells, and their crossings.

    Attributes
    ----------
    ends : ndarray of int, shape (A, 2)
        The nodes at both ends. Crossings have the numbers after the nodes of `Segments`.
    sense : ndarray of float64, shape (A,)
        In the plane of parameters: 1 if f > 0 lies to the left of the arc, −1 if to the right, 0 if
        unknown.
    cell : ndarray of int, shape (A,)
        The cell of each arc; −1 for arcs at crossings.
    crossing : ndarray of int, shape (n,)
        The crossing to which each cell belongs; −1 for cells that are not singular.
    touching : ndarray of int, shape (k,)
        The nodes and crossings at which the surface only touches the plane.
    """

    ends: Ints
    sense: FloatArray
    cell: Ints
    crossing: Ints
    touching: Ints


def find_arcs(
    cells: EndedCells, sides: CellSides, segments: Segments, *, is_lowered: bool = False
) -> Arcs:
    """Find the arcs in all cells; `is_lowered`: as for sections of solids."""
    # One entry for each root on a side of a cell; `key` orders the entries of a cell for pairing.
    side_numbers, root = _find_roots_on_sides(segments)
    cell, side = np.divmod(side_numbers, 4)
    node = segments.root_node[root]
    node_count = len(segments.node_net)
    u, v = sides.convert_to_parameters(cells, cell, side, segments.root_at[root])
    checkpoint()
    kind = cells.kind[cell]
    key = np.where(kind == OVER_U, u, v)
    # Where the section is not a graph, the entries are ordered around the border of the cell.
    around = np.flatnonzero((kind != OVER_U) & (kind != OVER_V))
    key[around] = _find_positions(
        cells, segments, (cell[around], side[around]), (u[around], v[around]), is_lowered
    )
    ordered = np.flatnonzero((kind != SINGULAR) | is_lowered)
    ordered = ordered[np.lexsort((key[ordered], cell[ordered]))]
    begin, end = _pair_entries(cell[ordered])
    pairs = np.stack([node[ordered[begin]], node[ordered[end]]], axis=1)
    cell_of_pair = cell[ordered[begin]]
    is_loop = pairs[:, 0] == pairs[:, 1]
    checkpoint()
    if is_lowered:
        return _find_lowered_arcs(cells, sides, segments, pairs, cell_of_pair)
    is_kept = ~is_loop & ~_are_along_sides(cells, segments, cell_of_pair, pairs).any(axis=1)
    arcs_in_plane, sense_in_plane, cell_in_plane = _find_sides_in_plane(cells, sides, segments)
    crossing = _number_crossings(cells, segments)
    checkpoint()
    # A node is on the border of a crossing if only one singular cell has its segment.
    singular_sides = _count_sides(segments, cells.kind == SINGULAR)[segments.root_segment[root]]
    is_joined = (kind == SINGULAR) & (singular_sides == 1)
    spokes, touching = _find_spokes(
        crossing[cell[is_joined]] + node_count, node[is_joined], crossing, node_count
    )
    ends = np.concatenate([pairs[is_kept], arcs_in_plane, spokes])
    sense = np.concatenate(
        [cells.sense[cell_of_pair[is_kept]], sense_in_plane, np.zeros(len(spokes))]
    )
    cell_of_arc = np.concatenate(
        [cell_of_pair[is_kept], cell_in_plane, np.full(len(spokes), -1, np.intp)]
    )
    # A patch folded to a curve crosses the plane at a node that is on two of its sides.
    free_nodes = _find_free_nodes(segments, ends, cells, pairs[is_loop, 0])
    return Arcs(ends, sense, cell_of_arc, crossing, np.concatenate([free_nodes, touching]))


def _find_lowered_arcs(
    cells: EndedCells, sides: CellSides, segments: Segments, pairs: Ints, cell_of_pair: Ints
) -> Arcs:
    """The arcs for sections of solids; `pairs` (m, 2) are both ends of pieces of cells (m,)."""
    is_loop = pairs[:, 0] == pairs[:, 1]
    # What is left of cells with f ≤ 0 are their sides in the plane.
    is_kept = ~is_loop & (cells.kind[cell_of_pair] != BELOW)
    kept, cell = pairs[is_kept], cell_of_pair[is_kept]
    kind = cells.kind[cell]
    sense = np.where((kind == OVER_U) | (kind == OVER_V), cells.sense[cell], 1.0)
    # Along a side in the plane, f < 0 in the cell.
    row, side = _are_along_sides(cells, segments, cell, kept).nonzero()
    is_forward = kept[row, 0] == segments.corner[cell[row], BEGINS[side]]
    sense[row] = np.where(is_forward, SENSES_BELOW[side], -SENSES_BELOW[side])
    in_plane, sense_in_plane, cell_in_plane = _find_lowered_sides(cells, sides, segments)
    ends = np.concatenate([kept, in_plane])
    free_nodes = _find_free_nodes(segments, ends, cells, pairs[is_loop, 0])
    return Arcs(
        ends,
        np.concatenate([sense, sense_in_plane]),
        np.concatenate([cell, cell_in_plane]),
        np.full(len(cells), -1),
        np.setdiff1d(free_nodes, segments.ends[segments.in_plane]),
    )


def _find_roots_on_sides(segments: Segments) -> tuple[Ints, Ints]:
    """All pairs (side, root) of a root on a side of a cell; sides have the numbers of `sides`."""
    first = np.searchsorted(segments.root_segment, segments.first.ravel())
    last = np.searchsorted(segments.root_segment, segments.last.ravel())
    return expand_runs(last - first, first)  # the roots first … last − 1 are on a side


def _find_positions(
    cells: EndedCells,
    segments: Segments,
    sides: tuple[Ints, Ints],
    parameters: tuple[FloatArray, FloatArray],
    is_lowered: bool,
) -> FloatArray:
    """The positions of nodes around the borders of their cells, by which neighbours are paired.

    In these cells the section is not a graph. Positions increase from the corner (u₀, v₀) along the
    sides v₀, u₁, v₁ and u₀. If this corner lies between two nodes of one piece, the first node gets
    a position at the end. This is so if the sign at the corner is not that of the cell: in a cell
    of kind `BELOW`, f = 0 counts as positive; in a cell of kind `ABOVE`, the sign at a corner,
    which all cells at the corner share, may be negative by rounding. For sections of solids,
    singular cells are like cells of kind `ABOVE`.
    """
    (cell, side), (u, v) = sides, parameters
    rectangle = cells.rectangle[:, cell] / ONE
    s = (u - rectangle[0]) / (rectangle[1] - rectangle[0])
    t = (v - rectangle[2]) / (rectangle[3] - rectangle[2])
    key = np.choose(side, [3 + (1 - t), 1 + t, s, 2 + (1 - s)])
    is_negative = segments.value[segments.corner[cell, 0]] < 0
    kind = cells.kind[cell]
    is_above = (kind == ABOVE) | (is_lowered & (kind == SINGULAR))
    must_move = np.where(kind == BELOW, ~is_negative, is_above & is_negative)
    order = np.lexsort((key, cell))
    first_nodes = order[is_change(cell[order])]
    first_nodes = first_nodes[must_move[first_nodes]]
    key[first_nodes] += 8.0  # after all others, which are at most 4
    return np.asarray(key)


def _pair_entries(cell: Ints) -> tuple[Ints, Ints]:
    """Pair the first and second entry of each cell, the third and fourth, and so on.

    `cell` is the sorted list of the cells of all entries. Returns the positions in this list of the
    first, and of the second entries of all pairs.
    """
    every = np.arange(len(cell))
    start = np.maximum.accumulate(np.where(is_change(cell), every, 0))
    first_of_pair = every[:-1][((every - start) % 2 == 0)[:-1] & (cell[:-1] == cell[1:])]
    return first_of_pair, first_of_pair + 1


def _are_along_sides(cells: EndedCells, segments: Segments, cell: Ints, pairs: Ints) -> Bools:
    """Which pairs of nodes (m, 2) are both ends of sides of their cells in the plane: (m, 4)."""
    sides = segments.corner[cell][:, np.stack([BEGINS, ENDS], axis=1)]  # (…, 4 sides, 2 ends)
    ends = pairs[:, np.newaxis]
    is_side = (ends == sides).all(axis=2) | (ends[..., ::-1] == sides).all(axis=2)
    is_in_plane = ~np.any(cells.sides, axis=0).T
    return np.asarray(is_side & is_in_plane[cell])


def _count_sides(segments: Segments, is_chosen: Bools) -> Ints:
    """For each segment, how many sides of the chosen cells contain it: shape (G,)."""
    # Each side adds 1 at its first segment and −1 after its last: the running sum is the count.
    change = np.zeros(len(segments.ends) + 1, np.intp)
    np.add.at(change, segments.first[is_chosen].ravel(), 1)
    np.add.at(change, segments.last[is_chosen].ravel(), -1)
    return np.cumsum(change)[:-1]


def _find_sides_in_plane(
    cells: EndedCells, sides: CellSides, segments: Segments
) -> tuple[Ints, FloatArray, Ints]:
    """Segments in the plane as arcs, their senses, and a cell of each."""
    is_coplanar = cells.kind == COPLANAR
    is_inside = _count_sides(segments, is_coplanar) > 1
    is_inside &= _count_sides(segments, ~is_coplanar) == 0
    arc_segments = np.flatnonzero(segments.in_plane & ~is_inside)
    sign_of_f = np.sign(cells.corner_values.sum(axis=0))
    sense = sign_of_f[:, np.newaxis] * -SENSES_BELOW
    sense[sides.step.reshape(-1, 4) < 0] *= -1
    sense_of_segment = np.zeros(len(segments.ends))
    # A side of one segment gives its sense to the segment.
    is_single = segments.last - segments.first == 1
    np.add.at(sense_of_segment, segments.first[is_single], sense[is_single])
    sense_of_arc = np.sign(sense_of_segment[arc_segments])
    return segments.ends[arc_segments], sense_of_arc, segments.side[arc_segments] // 4


def _find_lowered_sides(
    cells: EndedCells, sides: CellSides, segments: Segments
) -> tuple[Ints, FloatArray, Ints]:
    """Segments in the plane as arcs of each cell with f ≤ 0; their senses and cells.

    A segment between two cells with f > 0 is two arcs, there and back.
    """
    is_in_plane = ~np.any(cells.sides, axis=0).T & (cells.kind == BELOW)[:, np.newaxis]
    side = np.flatnonzero(is_in_plane & sides.has_length.reshape(-1, 4))
    first, last = segments.first.ravel()[side], segments.last.ravel()[side]
    row, segment = expand_runs(last - first, first)
    sense = SENSES_BELOW[side % 4]
    sense[sides.step[side] < 0] *= -1
    is_above = (cells.corner_values.min(axis=0) >= 0) & (cells.kind != COPLANAR)
    is_ridge = segments.in_plane & (_count_sides(segments, is_above) == 2)
    ridge = np.flatnonzero(is_ridge).repeat(2)
    return (
        np.concatenate([segments.ends[segment], segments.ends[ridge]]),
        np.concatenate([sense[row], np.tile([1.0, -1.0], len(ridge) // 2)]),
        np.concatenate([side[row], segments.side[ridge]]) // 4,
    )


def _number_crossings(cells: EndedCells, segments: Segments) -> Ints:
    """For each cell the number of its crossing, (n,); −1 for cells that are not singular.

    Singular cells that touch each other belong to the same crossing.
    """
    singular = np.flatnonzero(cells.kind == SINGULAR)
    crossing = np.full(len(cells), -1)
    if not len(singular):
        return crossing
    first, last = segments.first[singular].ravel(), segments.last[singular].ravel()
    side, segment = expand_runs(last - first, first)
    cell_of_side = np.repeat(singular, 4)
    # A graph whose vertices are all cells, then all corners, then all segments; a singular cell is
    # connected with its corners and segments.
    n, corners = len(cells), len(segments.value)
    first_vertices = np.concatenate([cell_of_side, cell_of_side[side]])
    second_vertices = np.concatenate([n + segments.corner[singular].ravel(), n + corners + segment])
    label = find_components(n + corners + len(segments.ends), first_vertices, second_vertices)
    crossing[singular] = np.unique(label[singular], return_inverse=True)[1]
    return crossing


def _find_spokes(hub: Ints, node: Ints, crossing: Ints, node_count: int) -> tuple[Ints, Ints]:
    """The arcs from crossings to nodes on their borders, and the crossings without arcs.

    `hub` and `node` are the crossing and the node of each arc. A node that meets a crossing an even
    number of times is inside the crossing and has no arc. A crossing with two nodes becomes one arc
    between these nodes.
    """
    pairs, counts = np.unique(np.stack([hub, node], axis=1), axis=0, return_counts=True)
    pairs = pairs[counts % 2 == 1]
    hubs, degree = np.unique(pairs[:, 0], return_counts=True)
    has_two_nodes = np.isin(pairs[:, 0], hubs[degree == 2])
    joined_pairs = pairs[has_two_nodes, 1].reshape(-1, 2)
    touching = np.setdiff1d(np.unique(crossing[crossing >= 0]) + node_count, hubs)
    return np.concatenate([joined_pairs, pairs[~has_two_nodes]]), touching


def _find_free_nodes(segments: Segments, ends: Ints, cells: EndedCells, loops: Ints) -> Ints:
    """Find the nodes without arcs at which the surface meets the plane.

    These are corners with f = 0, double roots, and the nodes `loops`, at which both ends of a piece
    are one node, unless they are corners: by rounding, both sides at a corner may have a root there
    although f ≠ 0.
    """
    is_free = np.zeros(len(segments.node_net), bool)
    is_free[: len(segments.value)] = segments.value == 0
    is_free[segments.root_node[np.diff(segments.root_node, prepend=-1) == 0]] = True
    is_free[loops[loops >= len(segments.value)]] = True
    is_free[ends[ends < len(is_free)]] = False
    is_free[segments.corner[(cells.kind == SINGULAR) | (cells.kind == COPLANAR)]] = False
    return np.flatnonzero(is_free)
