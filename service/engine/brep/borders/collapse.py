"""Edges that become one vertex: shorter than their own uncertainty, in chains that are short, too.

Proof in docs/proofs.md: "Edges and their polylines".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.prepared import PreparedBrep
from service.engine.clustering import find_components
from service.engine.trims.spline_shapes import measure_polygons
from service.engine.vectors import length

CHAIN = 0.1
"""A chain of edges collapses if it is at most this share of the tolerance long."""


@dataclass(frozen=True, eq=False, slots=True)
class Collapse:
    """Edges that become points, and the vertices that become one.

    Attributes
    ----------
    is_collapsed : ndarray of bool, shape (E,)
    chains : ndarray of float64, shape (E,)
        The length of the chain of each collapsed edge: no point of an edge of the chain is further
        from the vertex that remains. 0 for other edges.
    ends : ndarray of int, shape (E, 2)
        First and last vertex of each edge, of those that remain.
    """

    is_collapsed: Bools
    chains: FloatArray
    ends: Ints


def collapse_edges(prepared: PreparedBrep, end_gaps: FloatArray, tolerance: float) -> Collapse:
    """The edges that collapse at a tolerance.

    Chains are connected sets of edges that are not longer than their uncertainty. A chain collapses
    as a whole or not at all. A part of which no face would be left keeps all its edges.

    Parameters
    ----------
    end_gaps : ndarray of float64, shape (E, 2)
        Distances between the ends of curves and their vertices.
    """
    count, ends = len(prepared.edge_curves), prepared.edge_vertices
    has_curve = prepared.edge_curves >= 0
    lengths = np.full(count, np.inf)
    lengths[has_curve] = measure_polygons(prepared.curves)[prepared.edge_curves[has_curve]]
    is_short = lengths <= np.minimum(prepared.edge_uncertainties, CHAIN * tolerance)
    chains = np.zeros(count)
    edges = is_short.nonzero()[0]
    if not len(edges):
        return Collapse(is_short, chains, ends)
    root = find_components(len(prepared.vertices), *ends[edges].T)
    chain = root[ends[edges, 0]]
    total = np.bincount(chain, lengths[edges] + end_gaps[edges].sum(axis=1))[chain]
    is_short[edges] = total <= CHAIN * tolerance
    chains[edges] = np.where(is_short[edges], total, 0.0)
    if is_short.any() and _vanish(prepared, is_short).all():
        is_short[:] = False
        chains[:] = 0.0
    merged = find_components(len(prepared.vertices), *ends[is_short].T)
    return Collapse(is_short, chains, merged[ends])


def _vanish(prepared: PreparedBrep, is_collapsed: Bools) -> Bools:
    """Whether each face with loops vanishes: all its edges collapse, but seams and poles."""
    edges, faces = prepared.coedge_edges, prepared.coedge_faces
    used, counts = np.unique(np.array([edges, faces]), axis=1, return_counts=True)
    is_border = (counts == 1) & ~prepared.is_degenerate[used[0]]
    is_kept = np.bincount(used[1], is_border & ~is_collapsed[used[0]]) > 0
    vanishes: Bools = ~is_kept[used[1]]
    return vanishes


def measure_end_gaps(prepared: PreparedBrep, ends: Ints) -> FloatArray:
    """Distances (E, 2) of the first and last points of curves from the vertices `ends` (E, 2).

    They are 0 for edges without a curve.
    """
    gaps = np.zeros(ends.shape)
    edges = (prepared.edge_curves >= 0).nonzero()[0]
    curves, parameters = prepared.edge_curves[edges], prepared.edge_ranges[edges]
    points = prepared.curves.evaluate(curves.repeat(2), parameters.ravel()).reshape(-1, 2, 3)
    gaps[edges] = length(points - prepared.vertices[ends[edges]], -1)
    return gaps
