"""Samples of the edges of a part: one list for all faces, so that faces share their vertices."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_begins
from service.engine.brep.prepared import PreparedBrep
from service.surface.spline_tables import find_starts


@dataclass(frozen=True, eq=False, slots=True)
class EdgeSamples:
    """T samples of E edges: edge after edge, and in ascending order of parameters.

    Sample i and sample i + 1 of one edge are the ends of a *piece* of the edge, which has the
    number i; its image in the mesh is the straight line between their vertices, the *chord*. The
    first and the last sample of an edge are its vertices, whatever the gap between them and the
    ends of the curve.

    Attributes
    ----------
    edges : ndarray of int, shape (T,)
        The edge of each sample, in ascending order.
    parameters : ndarray of float64, shape (T,)
        The parameter of each sample; that of a pole or of a collapsed edge only serves parameter
        curves.
    offsets : ndarray of int, shape (E + 1,)
        The samples of edge e are those from `offsets[e]` to `offsets[e + 1] - 1`; an edge without
        coedges has none.
    vertices : ndarray of int, shape (T,)
        The vertex of the mesh at each sample: its row in `positions`. All samples of a pole or of
        a collapsed edge have one vertex.
    bounds : ndarray of float64, shape (T,)
        For piece i, no point of the curve over it is further than this from the chord; 0 for the
        last sample of an edge, and for poles.
    is_point : ndarray of bool, shape (E,)
        Whether an edge is one point of the mesh: a pole (degenerate edge), or collapsed.
    ends : ndarray of int, shape (E, 2)
        The first and the last vertex of each edge. Those of edges that collapsed are one.
    positions : ndarray of float64, shape (N, 3)
        The vertices of the part, then one vertex for each inner sample of an edge that is not a
        point.
    """

    edges: Ints
    parameters: FloatArray
    offsets: Ints
    vertices: Ints
    bounds: FloatArray
    is_point: Bools
    ends: Ints
    positions: FloatArray

    @property
    def counts(self) -> Ints:
        """Numbers (E,) of samples of each edge."""
        return self.offsets[1:] - self.offsets[:-1]

    @property
    def edge_bounds(self) -> FloatArray:
        """For each edge (E,), no point of its curve is further than this from its polyline."""
        bounds = np.zeros(len(self.is_point))
        first = find_begins(self.edges)
        if len(first):
            bounds[self.edges[first]] = np.maximum.reduceat(self.bounds, first)
        return bounds

    @classmethod
    def number(
        cls,
        prepared: PreparedBrep,
        *,
        edges: Ints,
        parameters: FloatArray,
        bounds: FloatArray,
        is_point: Bools,
        ends: Ints,
        known: FloatArray,
    ) -> "EdgeSamples":
        """Number the vertices of samples, and evaluate those that are not known.

        Parameters
        ----------
        known : ndarray of float64, shape (T, 3)
            Positions of inner samples; NaN where a sample is new.
        """
        offsets = find_starts(np.bincount(edges, minlength=len(is_point)))
        is_inner = np.ones(len(edges), bool)
        used = (offsets[1:] - offsets[:-1]).nonzero()[0]
        first, last = offsets[used], offsets[used + 1] - 1
        is_inner[first] = is_inner[last] = False
        is_inner &= ~is_point[edges]
        vertices = ends[edges, 0]
        vertices[last] = ends[used, 1]
        inner = is_inner.nonzero()[0]
        vertices[inner] = len(prepared.vertices) + np.arange(len(inner))
        points = known[inner]
        new = np.isnan(points[:, 0]).nonzero()[0]
        curves = prepared.edge_curves[edges[inner[new]]]
        points[new] = prepared.curves.evaluate(curves, parameters[inner[new]])
        positions = np.concatenate([prepared.vertices, points])
        return cls(edges, parameters, offsets, vertices, bounds, is_point, ends, positions)
