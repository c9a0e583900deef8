"""Arcs of a section: pairs of nodes on the border of a cell that are the ends of one piece.

In a graph, in the order of its parameter, beginnings and ends alternate. If f ≤ 0 in the whole
cell, the section meets at most its border. There f = 0 counts as positive: the nodes at both ends
of a run of places with f = 0 are one piece, without length or along a side in the plane.

Singular cells that touch each other are one place, a *crossing*: an arc leads from it to each node
on its border. Two such arcs are joined into one. A crossing without nodes is a point at which the
surface touches the plane.

Sides in the plane are arcs, unless patches that lie in the plane meet there.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.sections.borders import ONE, Borders
from service.engine.sections.cells import ABOVE, BELOW, COPLANAR, OVER_U, OVER_V, SINGULAR
from service.engine.sections.segments import Segments
from service.engine.sections.sides import CellSides, CellTable


@dataclass(frozen=True, eq=False, slots=True)
class Arcs:
    """Arcs, A in number, and crossings.

    Attributes
    ----------
    ends : ndarray of int, shape (A, 2)
        Nodes; crossings follow the nodes of `Segments`.
    sense : ndarray of float64, shape (A,)
        1 where f > 0 lies to the left of the arc in the parameters, −1 to the right, 0 if unknown.
    crossing : ndarray of int, shape (n,)
        The crossing to which each cell belongs; −1 for cells that are not singular.
    touching : ndarray of int, shape (k,)
        Nodes where the surface touches the plane; places and crossings.
    """

    ends: Ints
    sense: FloatArray
    crossing: Ints
    touching: Ints


def find_arcs(cells: CellTable, segments: Segments, borders: Borders) -> Arcs:
    """Find the arcs in all cells."""
    cell, side, root = _incidences(segments)
    node = segments.root_node[root]
    nodes = len(segments.node_net)
    u, v = CellSides.of(cells, borders).parameters(cells, cell, side, segments.root_at[root])
    checkpoint()
    kind = cells.kind[cell]
    key = np.where(kind == OVER_U, u, v)
    around = np.flatnonzero((kind != OVER_U) & (kind != OVER_V))
    rows = cell[around], side[around]
    key[around] = _around(cells, segments, rows, (u[around], v[around]))
    paired = np.flatnonzero(kind != SINGULAR)
    paired = paired[np.lexsort((key[paired], cell[paired]))]
    begin, end = _pairs(cell[paired])
    pairs = np.stack([node[paired[begin]], node[paired[end]]], axis=1)
    owner = cell[paired[begin]]
    loops = pairs[:, 0] == pairs[:, 1]
    keep = ~loops & ~_along_sides(segments, owner, pairs)

    checkpoint()
    flat, flat_sense = _sides_in_plane(cells, segments)
    crossing = _crossings(cells, segments)
    checkpoint()
    is_singular = kind == SINGULAR
    on_border = _cover(segments, cells.kind == SINGULAR)[segments.root_segment[root]] == 1
    is_joined = is_singular & on_border
    spokes, touching = _spokes(crossing[cell[is_joined]] + nodes, node[is_joined], crossing, nodes)
    ends = np.concatenate([pairs[keep], flat, spokes])
    sense = np.concatenate([cells.sense[owner[keep]], flat_sense, np.zeros(len(spokes))])
    # A patch folded to a curve crosses the plane at a node that is on two of its sides.
    free = _free_nodes(segments, ends, cells, pairs[loops, 0])
    touching = np.concatenate([free, touching])
    return Arcs(ends, sense, crossing, touching)


def _incidences(segments: Segments) -> tuple[Ints, Ints, Ints]:
    """All triples (cell, side, root) of a root on a side of a cell."""
    first = np.searchsorted(segments.root_segment, segments.first.ravel())
    last = np.searchsorted(segments.root_segment, segments.last.ravel())
    counts = last - first
    where = np.repeat(np.arange(len(counts)), counts)
    offset = np.arange(len(where)) - np.repeat(np.cumsum(counts) - counts, counts)
    cell, side = np.divmod(where, 4)
    return cell, side, first[where] + offset


def _around(
    cells: CellTable,
    segments: Segments,
    sides: tuple[Ints, Ints],
    at: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Positions of nodes around the borders of cells with one sign of f, to pair neighbours.

    They increase from corner (u₀, v₀) along v₀, u₁, v₁ and back. If this corner lies between two
    nodes of one piece, the first node is moved to the end.
    """
    (cell, side), (u, v) = sides, at
    place = cells.place[:, cell] / ONE
    s, t = (u - place[0]) / (place[1] - place[0]), (v - place[2]) / (place[3] - place[2])
    key = np.choose(side, [3 + (1 - t), 1 + t, s, 2 + (1 - s)])
    is_negative = segments.value[segments.corner[cell, 0]] < 0
    kind = cells.kind[cell]
    shift = np.where(kind == BELOW, ~is_negative, (kind == ABOVE) & is_negative)
    order = np.lexsort((key, cell))
    is_first = np.ones(len(order), bool)
    is_first[1:] = cell[order][1:] != cell[order][:-1]
    moved = order[is_first]
    moved = moved[shift[moved]]
    key[moved] += 8.0
    return np.asarray(key)


def _pairs(cell: Ints) -> tuple[Ints, Ints]:
    """Pair the first and second, then the third and fourth entry of each cell, and so on.

    Returns the positions of the first and of the second entries in the sorted list.
    """
    begins = np.ones(len(cell), bool)
    begins[1:] = cell[1:] != cell[:-1]
    start = np.maximum.accumulate(np.where(begins, np.arange(len(cell)), 0))
    even = np.flatnonzero((np.arange(len(cell)) - start) % 2 == 0)
    even = even[even + 1 < len(cell)]
    even = even[cell[even] == cell[even + 1]]
    return even, even + 1


def _along_sides(segments: Segments, cell: Ints, pairs: Ints) -> Bools:
    """Which pairs of nodes are both ends of a side of their cell that lies in the plane."""
    along = np.zeros(len(cell), bool)
    for side, (a, b) in enumerate(((0, 1), (2, 3), (0, 2), (1, 3))):
        one, other = segments.corner[cell, a], segments.corner[cell, b]
        same = (pairs[:, 0] == one) & (pairs[:, 1] == other)
        same |= (pairs[:, 0] == other) & (pairs[:, 1] == one)
        along |= same & segments.side_in_plane[cell, side]
    return along


def _cover(segments: Segments, chosen: Bools) -> Ints:
    """For each segment the number of sides of the chosen cells that contain it, (G,)."""
    change = np.zeros(len(segments.ends) + 1, np.intp)
    np.add.at(change, segments.first[chosen].ravel(), 1)
    np.add.at(change, segments.last[chosen].ravel(), -1)
    return np.cumsum(change)[:-1]


def _sides_in_plane(cells: CellTable, segments: Segments) -> tuple[Ints, FloatArray]:
    """Segments in the plane as arcs, and their senses."""
    is_coplanar = cells.kind == COPLANAR
    inside = (_cover(segments, is_coplanar) > 1) & (_cover(segments, ~is_coplanar) == 0)
    arcs = np.flatnonzero(segments.in_plane & ~inside)
    side_of_plane = np.sign(cells.corner_values().sum(axis=1))
    # If f > 0 above v₀, the arc runs toward larger u; if f > 0 right of u₀, toward smaller v.
    sense = side_of_plane[:, np.newaxis] * np.array([-1.0, 1.0, 1.0, -1.0])
    sense[segments.backward] *= -1
    total = np.zeros(len(segments.ends))
    single = segments.last - segments.first == 1
    np.add.at(total, segments.first[single], sense[single])
    return segments.ends[arcs], np.sign(total[arcs])


def _crossings(cells: CellTable, segments: Segments) -> Ints:
    """Numbers (n,) of the groups of singular cells that touch each other; −1 for other cells."""
    singular = np.flatnonzero(cells.kind == SINGULAR)
    crossing = np.full(len(cells.kind), -1)
    if not len(singular):
        return crossing
    first, last = segments.first[singular].ravel(), segments.last[singular].ravel()
    counts = last - first
    owner = np.repeat(np.repeat(singular, 4), counts)
    offset = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    n, places = len(cells.kind), len(segments.value)
    one = np.concatenate([np.repeat(singular, 4), owner])
    other = np.concatenate(
        [n + segments.corner[singular].ravel(), n + places + np.repeat(first, counts) + offset]
    )
    label = components(n + places + len(segments.ends), one, other)
    crossing[singular] = np.unique(label[singular], return_inverse=True)[1]
    return crossing


def components(count: int, one: Ints, other: Ints) -> Ints:
    """Connected components of a graph of `count` vertices: the least vertex of each, (count,)."""
    label = np.arange(count)
    while True:
        checkpoint()
        least = np.minimum(label[one], label[other])
        following = label.copy()
        for ends in (one, other):
            np.minimum.at(following, label[ends], least)
        while not np.array_equal(following[following], following):
            following = following[following]
        if np.array_equal(following, label):
            return label
        label = following


def _spokes(hub: Ints, node: Ints, crossing: Ints, nodes: int) -> tuple[Ints, Ints]:
    """Arcs from crossings to nodes on their borders, and crossings without any.

    A node between two sides of one crossing has no arc; a crossing with two nodes is one arc
    between these.
    """
    pairs, counts = np.unique(np.stack([hub, node], axis=1), axis=0, return_counts=True)
    pairs = pairs[counts % 2 == 1]
    hubs, degree = np.unique(pairs[:, 0], return_counts=True)
    twofold = np.isin(pairs[:, 0], hubs[degree == 2])
    through = pairs[twofold, 1].reshape(-1, 2)
    touching = np.setdiff1d(np.unique(crossing[crossing >= 0]) + nodes, hubs)
    return np.concatenate([through, pairs[~twofold]]), touching


def _free_nodes(segments: Segments, ends: Ints, cells: CellTable, loops: Ints) -> Ints:
    """Find nodes without arcs where the surface meets the plane: corners, double roots, loops."""
    is_free = np.zeros(len(segments.node_net), bool)
    is_free[: len(segments.value)] = segments.value == 0
    again = np.diff(segments.root_node, prepend=-1) == 0
    is_free[segments.root_node[again]] = True
    is_free[loops[loops >= len(segments.value)]] = True
    is_free[ends[ends < len(is_free)]] = False
    is_free[segments.corner[(cells.kind == SINGULAR) | (cells.kind == COPLANAR)]] = False
    return np.flatnonzero(is_free)
