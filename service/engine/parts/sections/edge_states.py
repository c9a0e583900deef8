"""Where edges are above planes, below them or near them, and where they change the side.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.parts.sections.borders import (
    Borders,
    CurvePieces,
    clear_heights,
    measure_heights,
)
from service.engine.parts.sections.sign_changes import SignChanges, find_changes
from service.engine.sections.cells import THICKNESS, LocalPlanes
from service.engine.vectors import Items

Sides: TypeAlias = NDArray[np.int8]
"""Sides of edges or vertices: −1 below, 0 near, 1 above."""


REACH = 4 * THICKNESS
"""This is added to gaps, for rounding and for heights that count as zero."""


NONE = 2
"""The side beyond the end of an edge."""


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
class NearParts(Items):
    """Near parts of edges: from `low` to `high`, with the sides before and after, or `NONE`."""

    edge: Ints
    column: Ints
    low: FloatArray
    high: FloatArray
    before: Ints
    after: Ints


@dataclass(frozen=True, eq=False, slots=True)
class EdgeStates:
    """The sides −1, 0 (near), 1 of edges at their starts and ends, (E, m) each, and near parts.

    `roots` are the sign changes of the heights of edges that are somewhere near.
    """

    start: Sides
    end: Sides
    parts: NearParts
    roots: Joints


def find_states(borders: Borders, planes: LocalPlanes, numbers: Ints) -> EdgeStates:
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
    return EdgeStates(start, end, parts, found)


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
) -> NearParts:
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
        NearParts(
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
    parts.append(NearParts(edge[ends], column[ends], low, t[ends], none, after[ends]))
    is_whole = start == 0
    is_whole[edge, column] = False
    is_whole[borders.is_point] = False
    edge, column = is_whole.nonzero()
    none = np.full(len(edge), NONE)
    low, high = borders.edge_ranges[edge].T
    parts.append(NearParts(edge, column, low, high, none, none))
    return NearParts.join(parts)


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
