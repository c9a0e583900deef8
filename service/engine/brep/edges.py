"""Samples of the edges of a part: one list for all faces, so that faces share their vertices."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints


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
    positions: FloatArray

    @property
    def counts(self) -> Ints:
        """Numbers (E,) of samples of each edge."""
        return np.diff(self.offsets)
