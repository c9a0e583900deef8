"""Near sets: near parts of edges that meet at vertices, each of which has one side.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.clustering import find_components
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.edge_states import NONE, EdgeStates
from service.engine.sections.cells import THICKNESS


@dataclass(frozen=True, eq=False, slots=True)
class NearSets:
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


def find_near_sets(borders: Borders, states: EdgeStates, is_near: Bools) -> NearSets:
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
    return NearSets(
        vertex, column, label, low[label], high[label], has_edges[label], whole, links[0]
    )
