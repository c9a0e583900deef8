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
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.clustering import find_components
from service.engine.parts.sections.borders import (
    Borders,
    CurvePieces,
    clear_heights,
    measure_heights,
)
from service.engine.sections.cells import THICKNESS, LocalPlanes
from service.engine.sections.coefficients import find_roots
from service.engine.vectors import Items

Sides: TypeAlias = NDArray[np.int8]
"""Sides of edges or vertices: −1 below, 0 near, 1 above."""

REACH = 4 * THICKNESS
"""This is added to gaps, for rounding and for heights that count as zero."""

TOUCHING = 8 * THICKNESS
"""Points of edges that are at most this far from a plane are in it."""

NONE = 2
"""The side beyond the end of an edge."""


@dataclass(frozen=True, eq=False, slots=True)
class SignChanges(Items):
    """k sign changes of polynomials over pieces of curves.

    Attributes
    ----------
    piece, column : ndarray of int, shape (k,)
        The piece, and the number of the plane among those of the call.
    t : ndarray of float64, shape (k,)
        The parameter of the curve.
    from_negative : ndarray of bool, shape (k,)
        Whether the polynomial is negative before the change.
    """

    piece: Ints
    column: Ints
    t: FloatArray
    from_negative: Bools


@dataclass(frozen=True, eq=False, slots=True)
class Joints(Items):
    """J joints.

    Attributes
    ----------
    edge, column : ndarray of int, shape (J,)
        The edge, and the number of the plane among those of the call.
    t : ndarray of float64, shape (J,)
        The parameter of the edge.
    """

    edge: Ints
    column: Ints
    t: FloatArray

    def __len__(self) -> int:
        return len(self.t)


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


def find_changes(
    pieces: CurvePieces, rows: Ints, coefficients: FloatArray, weights: FloatArray
) -> SignChanges:
    """The sign changes inside pieces; zero counts as positive, and double roots do not count.

    Parameters
    ----------
    rows : ndarray of int, shape (r,)
        The pieces.
    coefficients : ndarray of float64, shape (n+1, r, m)
    weights : ndarray of float64, shape (n+1, r, 1)
    """
    is_negative = coefficients < 0
    row, column = (is_negative[1:] != is_negative[:-1]).any(axis=0).nonzero()
    chosen = coefficients[:, row, column]
    threshold = THICKNESS * weights[:, row, 0].min(axis=0)
    number, share = find_roots(chosen, threshold)
    same = np.zeros(len(number), bool)
    same[1:] = (number[1:] == number[:-1]) & (share[1:] == share[:-1])
    same[:-1] |= same[1:]
    number, share = number[~same], share[~same]
    before = np.arange(len(number)) - np.searchsorted(number, number)
    from_negative = is_negative[0, row, column][number] ^ (before % 2 == 1)
    piece = rows[row[number]]
    low, high = pieces.low[piece], pieces.high[piece]
    return SignChanges(piece, column[number], low + share * (high - low), from_negative)


@dataclass(frozen=True, eq=False, slots=True)
class _NearParts(Items):
    """Near parts of edges: from `low` to `high`, with the sides before and after, or `NONE`."""

    edge: Ints
    column: Ints
    low: FloatArray
    high: FloatArray
    before: Ints
    after: Ints


@dataclass(frozen=True, eq=False, slots=True)
class _EdgeStates:
    """The sides −1, 0 (near), 1 of edges at their starts and ends, (E, m) each, and near parts.

    `roots` are the sign changes of the heights of edges that are somewhere near.
    """

    start: Sides
    end: Sides
    parts: _NearParts
    roots: Joints


def find_edge_sides(borders: Borders, planes: LocalPlanes, numbers: Ints) -> EdgeSides:
    """The sides of all edges and vertices with respect to planes `numbers` (m,)."""
    states = _find_states(borders, planes, numbers)
    ends = np.concatenate([states.start, states.end])
    vertex = borders.edge_vertices.T.ravel()
    order = vertex.argsort(kind="stable")
    used, first = np.unique(vertex[order], return_index=True)
    low, high = np.ones((2, len(borders.vertices), len(numbers)), np.int8)
    low[used] = np.minimum.reduceat(ends[order], first, axis=0)
    high[used] = np.maximum.reduceat(ends[order], first, axis=0)
    is_near = (low != high) | (low == 0)
    side = low.copy()
    sets = _find_near_sets(borders, states, is_near)
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


def _find_states(borders: Borders, planes: LocalPlanes, numbers: Ints) -> _EdgeStates:
    """Where edges are near."""
    pieces, count = borders.edges, len(numbers)
    reach = borders.edge_gaps + REACH
    # Of H − γ ("not above" where negative) and H + γ ("below" where negative), at both ends.
    signs = np.empty((2, 2, len(pieces.curve), count), bool)
    changes: list[list[SignChanges]] = [[], [], []]
    for rows, values in pieces.groups:
        heights, weights = measure_heights(values[..., np.newaxis], planes, numbers)
        margin = weights * reach[pieces.curve[rows]][:, np.newaxis]
        for k, shifted in enumerate((heights - margin, heights + margin)):
            signs[k, 0, rows], signs[k, 1, rows] = shifted[0] < 0, shifted[-1] < 0
            changes[k].append(find_changes(pieces, rows, shifted, weights))
        changes[2].append(find_changes(pieces, rows, clear_heights(heights, weights), weights))
    begins = np.searchsorted(pieces.curve, np.arange(len(borders.edge_vertices)))
    is_curve = ~borders.is_point
    first = begins[is_curve]
    start, end = np.zeros((2, len(is_curve), count), np.int8)
    starts = signs[:, 0, first]
    start[is_curve] = _to_side(starts[0], starts[1])
    _add_point_sides(borders, planes, numbers, start)
    start[~is_curve], end[~is_curve] = start[~is_curve], start[~is_curve]
    events = [_list_events(pieces, SignChanges.join(changes[k]), signs[k], k) for k in range(2)]
    edge, column, t, kind = (np.concatenate(each) for each in zip(*events, strict=True))
    key = edge * count + column
    order = np.lexsort((kind, t, key))
    edge, column, t, kind, key = (each[order] for each in (edge, column, t, kind, key))
    # The signs after each event, from those at the start of the edge and the events of both kinds.
    number = np.searchsorted(key, key)
    own = begins[edge]
    after = []
    for k in range(2):
        total = np.concatenate([[0], np.cumsum(kind == k)])
        odd = (total[1:] - total[number]) % 2 == 1
        after.append(signs[k, 0, own, column] ^ odd)
    state = _to_side(after[0], after[1])
    is_first = np.ones(len(key), bool)
    is_first[1:] = key[1:] != key[:-1]
    previous = np.where(is_first, start[edge, column], np.roll(state, 1))
    changed = state != previous
    edge, column, t, state, previous = (x[changed] for x in (edge, column, t, state, previous))
    end[is_curve] = start[is_curve]
    end[edge, column] = state  # the last change of an edge is assigned last
    parts = _list_near_parts(borders, start, (edge, column, t, previous, state))
    roots = SignChanges.join(changes[2])
    found = Joints(pieces.curve[roots.piece], roots.column, roots.t)
    return _EdgeStates(start, end, parts, found)


def _to_side(is_not_above: Bools, is_below: Bools) -> Sides:
    """1 above, −1 below, 0 near; also 0 if rounding says that both is true."""
    side: Sides = (~is_not_above).astype(np.int8) - is_below.astype(np.int8)
    return side


def _list_events(
    pieces: CurvePieces, changes: SignChanges, signs: Bools, kind: int
) -> tuple[Ints, Ints, FloatArray, Ints]:
    """Edges, columns and parameters of sign changes, also of those between two pieces."""
    follows = (pieces.curve[1:] == pieces.curve[:-1]).nonzero()[0]
    row, column = (signs[1, follows] != signs[0, follows + 1]).nonzero()
    between = follows[row]
    edge = np.concatenate([pieces.curve[changes.piece], pieces.curve[between]])
    columns = np.concatenate([changes.column, column])
    t = np.concatenate([changes.t, pieces.high[between]])
    return edge, columns, t, np.full(len(edge), kind)


def _list_near_parts(
    borders: Borders, start: Sides, changes: tuple[Ints, Ints, FloatArray, Sides, Sides]
) -> _NearParts:
    """Near parts from the changes of sides, sorted by edge, column and parameter."""
    edge, column, t, before, after = changes
    key = edge * start.shape[1] + column
    is_first, is_last = np.ones((2, len(key)), bool)
    is_first[1:] = key[1:] != key[:-1]
    is_last[:-1] = is_first[1:]
    begins = (after == 0).nonzero()[0]
    following = np.minimum(begins + 1, len(key) - 1)
    high = np.where(is_last[begins], borders.edge_ranges[edge[begins], 1], t[following])
    parts = [
        _NearParts(
            edge[begins],
            column[begins],
            t[begins],
            high,
            before[begins],
            np.where(is_last[begins], NONE, after[following]),
        )
    ]
    ends = (is_first & (before == 0)).nonzero()[0]
    none = np.full(len(ends), NONE)
    low = borders.edge_ranges[edge[ends], 0]
    parts.append(_NearParts(edge[ends], column[ends], low, t[ends], none, after[ends]))
    is_whole = start == 0
    is_whole[edge, column] = False
    is_whole[borders.is_point] = False
    edge, column = is_whole.nonzero()
    none = np.full(len(edge), NONE)
    low, high = borders.edge_ranges[edge].T
    parts.append(_NearParts(edge, column, low, high, none, none))
    return _NearParts.join(parts)


def _add_point_sides(borders: Borders, planes: LocalPlanes, numbers: Ints, side: Sides) -> None:
    """Set the sides of edges that are points, from the images of their coedges."""
    images = borders.images
    edge = borders.coedge_edges[images.curve]
    is_point = borders.is_point[edge]
    if not is_point.any():
        return
    low, high = np.full((2, *side.shape), [[[np.inf]], [[-np.inf]]])
    piece = is_point.nonzero()[0]
    for rows, values in images.split(piece):
        heights, weights = measure_heights(values[..., np.newaxis], planes, numbers)
        heights /= weights
        np.minimum.at(low, edge[piece[rows]], heights.min(axis=0))
        np.maximum.at(high, edge[piece[rows]], heights.max(axis=0))
    points = borders.is_point.nonzero()[0]
    near = REACH + borders.edge_gaps[points][:, np.newaxis]
    side[points] = _to_side(~(low[points] > near), high[points] < -near)


@dataclass(frozen=True, eq=False, slots=True)
class _NearSets:
    """Near sets: vertices (k,) that are near, the set of each, and the sides about the sets.

    Attributes
    ----------
    vertex, column, label : ndarray of int, shape (k,)
    low, high : ndarray of int, shape (k,)
        The least and the greatest side about the set of each vertex; 2 and −2 without any.
    has_edges : ndarray of bool, shape (k,)
        Whether the set has whole edges.
    parts : ndarray of int, shape (w,)
        The near parts that are whole edges.
    set_of_part : ndarray of int, shape (w,)
        A vertex (one of the k) of each.
    """

    vertex: Ints
    column: Ints
    label: Ints
    low: Ints
    high: Ints
    has_edges: Bools
    parts: Ints
    set_of_part: Ints

    def choose_sides(self, heights: FloatArray, flat: Bools) -> Ints:
        """The side of each vertex; `flat` says which near parts are edges that lie in a plane."""
        is_flat = np.zeros(len(self.label), bool)
        is_flat[self.label[self.set_of_part[flat[self.parts]]]] = True
        same = (self.low == self.high) & ~is_flat[self.label]
        own = np.where((heights < -THICKNESS) & ~self.has_edges, -1, 1)
        side: Ints = np.where(same, self.low, own)
        return side


def _find_near_sets(borders: Borders, states: _EdgeStates, is_near: Bools) -> _NearSets:
    """The near sets with vertices."""
    vertex, column = is_near.nonzero()
    number = np.full(is_near.shape, -1)
    number[vertex, column] = np.arange(len(vertex))
    parts = states.parts
    whole = ((parts.before == NONE) & (parts.after == NONE)).nonzero()[0]
    links = number[borders.edge_vertices[parts.edge[whole]].T, parts.column[whole]]
    label = find_components(len(vertex), links[0], links[1])
    low, high = np.full((2, len(vertex)), [[2], [-2]])
    # The sides of ends of edges that are not near there, and those beyond near parts.
    ends = []
    for end, at in enumerate((states.start, states.end)):
        edge, own = ((at != 0) & is_near[borders.edge_vertices[:, end]]).nonzero()
        is_curve = ~borders.is_point[edge]
        edge, own = edge[is_curve], own[is_curve]
        ends.append((borders.edge_vertices[edge, end], own, at[edge, own]))
        beyond, here = (parts.after, parts.before) if end == 0 else (parts.before, parts.after)
        rows = ((here == NONE) & (beyond != NONE)).nonzero()[0]
        ends.append(
            (borders.edge_vertices[parts.edge[rows], end], parts.column[rows], beyond[rows])
        )
    own_vertex, own_column, side = (np.concatenate(each) for each in zip(*ends, strict=True))
    own_label = label[number[own_vertex, own_column]]
    np.minimum.at(low, own_label, side)
    np.maximum.at(high, own_label, side)
    has_edges = np.zeros(len(vertex), bool)
    has_edges[label[links[0]]] = True
    return _NearSets(
        vertex, column, label, low[label], high[label], has_edges[label], whole, links[0]
    )


def _measure_vertices(
    borders: Borders, planes: LocalPlanes, numbers: Ints, vertex: Ints, column: Ints
) -> FloatArray:
    """The heights (k,) of vertices over planes."""
    return planes.heights(numbers[column], borders.vertices[vertex])


def _find_flat(borders: Borders, planes: LocalPlanes, numbers: Ints, parts: _NearParts) -> Bools:
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


def _find_joints(borders: Borders, states: _EdgeStates, side: Sides) -> Joints:
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
    parts: _NearParts,
    vertices: tuple[_NearSets, FloatArray],
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
