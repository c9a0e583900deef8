"""The pieces with which the division of edges begins: between vertices and kinks."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, unique_values
from service.engine.brep.prepared import PreparedBrep
from service.engine.vectors import Items

SAME = 2.0**-22
"""Samples nearer than this share of the range of their edge are one."""


@dataclass(frozen=True, eq=False, slots=True)
class EdgePieces(Items):
    """m pieces of edges, each between two parameters."""

    edges: Ints
    low: FloatArray
    high: FloatArray

    def divide(self, parts: Ints) -> "EdgePieces":
        """Each piece in a number of equal parts (m,)."""
        run, number = expand_runs(parts)
        low = self.low[run] + (self.high - self.low)[run] * (number / parts[run])
        high = np.append(low[1:], 0.0)
        high[number == parts[run] - 1] = self.high
        return EdgePieces(self.edges[run], low, high)


def list_first_samples(
    prepared: PreparedBrep, is_point: Bools, ends: Ints
) -> tuple[Ints, FloatArray]:
    """Edges and parameters of the ends of all used edges, and of kinks; sorted by both."""
    used = np.bincount(prepared.coedge_edges).nonzero()[0]
    start, end = prepared.edge_ranges.T
    kinked, kinks = prepared.kinks
    # A closed curve of three to five spans, such as a circle, keeps its breaks.
    closed = used[(ends[used, 0] == ends[used, 1]) & ~is_point[used]]
    spans = prepared.curves.span_count[prepared.edge_curves[closed]]
    closed = closed[(spans >= 3) & (spans <= 5)]
    closed_curves = prepared.edge_curves[closed]
    run, row = expand_runs(
        prepared.curves.span_count[closed_curves] - 1,
        prepared.curves.first_break[closed_curves] + 1,
    )
    inner_edges = np.concatenate([kinked, closed[run]])
    inner = np.concatenate([kinks, prepared.curves.breaks[row]])
    is_used = np.zeros(len(is_point) + 1, bool)
    is_used[used] = ~is_point[used]
    margin = SAME * (end - start)[inner_edges]
    keep = is_used[inner_edges]
    keep &= (inner > start[inner_edges] + margin) & (inner < end[inner_edges] - margin)
    edges = np.concatenate([used, used, inner_edges[keep]])
    parameters = np.concatenate([start[used], end[used], inner[keep]])
    order = np.lexsort((parameters, edges))
    edges, parameters = edges[order], parameters[order]
    new = np.ones(len(edges), bool)
    new[1:] = edges[1:] != edges[:-1]
    new[1:] |= parameters[1:] - parameters[:-1] > SAME * (end - start)[edges[1:]]
    return edges[new], parameters[new]


def count_least_pieces(is_point: Bools, ends: Ints, used: Ints) -> Ints:
    """The least number of pieces of each edge (E,), so that no two chords are between two vertices.

    It is 3 for closed edges, 2 for edges with the same two vertices, else 1.
    """
    least = np.ones(len(is_point), np.intp)
    edges = used[~is_point[used]]
    low, high = ends[edges].min(axis=1), ends[edges].max(axis=1)
    number = unique_values(low << 32 | high)[1]
    count = np.bincount(number)[number]
    least[edges] = np.where(low == high, 3, np.where(count > 1, 2, 1))
    return least
