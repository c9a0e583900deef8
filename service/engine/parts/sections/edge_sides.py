"""On which side of planes edges and vertices are, and the joints, at which edges change the side.

An edge is above a plane, below it, or *near* it: not further away than its gap. Where it is above
or below, the borders of all its faces are on the same side. So the faces of an edge may disagree
only where it is near. Near parts of edges that meet at vertices are one *near set*. Each near set
has one side, which all of its faces take for it. Then the faces of an edge agree everywhere, and
the places at which the edge changes its side, its *joints*, are those of all its faces.

A near set between places of one side has this side. Otherwise a near set of a part of one edge has
a joint inside; that of a single vertex has the side of the vertex; and one with whole edges is
above: zero counts as positive, as for the arcs of sections.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.parts.sections.borders import (
    Borders,
    measure_heights,
)
from service.engine.parts.sections.edge_states import (
    NONE,
    EdgeStates,
    Joints,
    NearParts,
    Sides,
    find_states,
)
from service.engine.parts.sections.near_sets import NearSets, find_near_sets
from service.engine.sections.cells import THICKNESS, LocalPlanes

TOUCHING = 8 * THICKNESS
"""Points of edges that are at most this far from a plane are in it."""


@dataclass(frozen=True, eq=False, slots=True)
class EdgeSides:
    """The sides of edges and vertices with respect to m planes.

    Attributes
    ----------
    is_below : ndarray of bool, shape (V, m)
        The side that all faces take for a vertex.
    joints : Joints
    touching : ndarray of float64, shape (k, 3)
        Points of edges and vertices that are in a plane, while all about them is on one side.
    touching_columns : ndarray of int, shape (k,)
        The planes of these.
    flat_edges, flat_columns : ndarray of int, shape (f,)
        Edges that lie in a plane, and these planes.
    """

    is_below: Bools
    joints: Joints
    touching: FloatArray
    touching_columns: Ints
    flat_edges: Ints
    flat_columns: Ints


def find_edge_sides(borders: Borders, planes: LocalPlanes, numbers: Ints) -> EdgeSides:
    """The sides of all edges and vertices with respect to planes `numbers` (m,)."""
    states = find_states(borders, planes, numbers)
    ends = np.concatenate([states.start, states.end])
    vertex = borders.edge_vertices.T.ravel()
    order = vertex.argsort(kind="stable")
    used, first = np.unique(vertex[order], return_index=True)
    low, high = np.ones((2, len(borders.vertices), len(numbers)), np.int8)
    low[used] = np.minimum.reduceat(ends[order], first, axis=0)
    high[used] = np.maximum.reduceat(ends[order], first, axis=0)
    is_near = (low != high) | (low == 0)
    side = low.copy()
    sets = find_near_sets(borders, states, is_near)
    heights = _measure_vertices(borders, planes, numbers, sets.vertex, sets.column)
    flat = _find_flat(borders, planes, numbers, states.parts)
    sets_side = sets.choose_sides(heights, flat)
    side[sets.vertex, sets.column] = sets_side
    joints = _find_joints(borders, states, side)
    touching, columns = _find_touching(borders, planes, numbers, states.parts, (sets, heights))
    return EdgeSides(
        side < 0,
        joints,
        touching,
        columns,
        states.parts.edge[flat],
        states.parts.column[flat],
    )


def _measure_vertices(
    borders: Borders, planes: LocalPlanes, numbers: Ints, vertex: Ints, column: Ints
) -> FloatArray:
    """The heights (k,) of vertices over planes."""
    return planes.heights(numbers[column], borders.vertices[vertex])


def _find_flat(borders: Borders, planes: LocalPlanes, numbers: Ints, parts: NearParts) -> Bools:
    """Which near parts are edges that lie in their planes."""
    flat: Bools = (parts.before == NONE) & (parts.after == NONE)
    rows = flat.nonzero()[0]
    first = np.searchsorted(borders.edges.curve, parts.edge[rows])
    last = np.searchsorted(borders.edges.curve, parts.edge[rows], side="right")
    counts = last - first
    owner = np.repeat(rows, counts)
    piece = np.arange(len(owner)) - np.repeat(counts.cumsum() - counts - first, counts)
    for chosen, values in borders.edges.split(piece):
        own = owner[chosen]
        heights, weights = measure_heights(values, planes, numbers[parts.column[own]])
        is_off = (np.abs(heights) > TOUCHING * weights).any(axis=0)
        flat[own[is_off]] = False
    return flat


def _find_joints(borders: Borders, states: EdgeStates, side: Sides) -> Joints:
    """Where edges change their side, if vertices have the sides (V, m)."""
    found = []
    for end, at in enumerate((states.start, states.end)):
        edge, column = ((at != 0) & (at != side[borders.edge_vertices[:, end]])).nonzero()
        is_curve = ~borders.is_point[edge]
        edge, column = edge[is_curve], column[is_curve]
        found.append(Joints(edge, column, borders.edge_ranges[edge, end]))
    parts = states.parts
    before, after = parts.before.copy(), parts.after.copy()
    at_start, at_end = before == NONE, after == NONE
    ends = borders.edge_vertices[parts.edge].T
    before[at_start] = side[ends[0, at_start], parts.column[at_start]]
    after[at_end] = side[ends[1, at_end], parts.column[at_end]]
    rows = (before != after).nonzero()[0]
    middle = np.where(
        at_start, parts.low, np.where(at_end, parts.high, (parts.low + parts.high) / 2)
    )
    count = side.shape[1]
    key, root_key = (each.edge * count + each.column for each in (parts.take(rows), states.roots))
    root = _find_next(root_key, states.roots.t, key, parts.low[rows])
    is_found = (root >= 0) & (states.roots.t[root] <= parts.high[rows])
    t = (
        np.where(is_found, states.roots.t[root], middle[rows])
        if len(states.roots.t)
        else middle[rows]
    )
    found.append(Joints(parts.edge[rows], parts.column[rows], t))
    return Joints.join(found)


def _find_next(key: Ints, t: FloatArray, wanted: Ints, least: FloatArray) -> Ints:
    """The row with the same key and the least t of at least `least`, (q,); −1 if there is none."""
    keys, values = np.concatenate([key, wanted]), np.concatenate([t, least])
    is_row = np.zeros(len(keys), bool)
    is_row[: len(key)] = True
    order = np.lexsort((is_row, values, keys))
    place = np.where(is_row[order], np.arange(len(order)), len(order))
    following = np.minimum.accumulate(place[::-1])[::-1]
    result = np.full(len(keys), -1)
    found = np.append(order, -1)[following]
    result[order] = found
    result = result[len(key) :]
    return np.where((result >= 0) & (key[result] == wanted) if len(key) else False, result, -1)


def _find_touching(
    borders: Borders,
    planes: LocalPlanes,
    numbers: Ints,
    parts: NearParts,
    vertices: tuple[NearSets, FloatArray],
) -> tuple[FloatArray, Ints]:
    """Points of vertices and edges in planes, where all about them is on one side; their planes.

    `vertices` are the near sets with vertices, and the heights of these.
    """
    sets, heights = vertices
    alone = (sets.low == sets.high) & ~sets.has_edges & (np.abs(heights) <= TOUCHING)
    rows = ((parts.before == parts.after) & (parts.before != NONE)).nonzero()[0]
    piece, share = borders.edges.find(parts.edge[rows], (parts.low + parts.high)[rows] / 2)
    points = borders.edges.evaluate(piece, share)
    column = parts.column[rows]
    is_in_plane = np.abs(planes.heights(numbers[column], points)) <= TOUCHING
    return (
        np.concatenate([borders.vertices[sets.vertex[alone]], points[is_in_plane]]),
        np.concatenate([sets.column[alone], column[is_in_plane]]),
    )
