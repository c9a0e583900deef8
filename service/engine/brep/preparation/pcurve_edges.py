"""Edges of loops that are given by parameter curves alone: the curves S(c(t)) of space."""

from dataclasses import replace

import numpy as np

from service.engine.brep.preparation.topology import ADDED, Topology
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.composition import MOST, compose_curves
from service.engine.trims.spline_shapes import measure_polygons

NO_EDGE = -1

GOAL = 0.01
"""Curves of a high degree are interpolated up to this share of the tolerance."""


def add_pcurve_edges(
    surfaces: ClosedSurfaces, topology: Topology, tolerance: float, most: int = MOST
) -> Topology:
    """Edges and vertices for the coedges without an edge (`NO_EDGE`).

    An edge that is nowhere longer than `tolerance` is degenerate: the parameter curve runs along a
    pole. Each coedge begins at a vertex of its own, where the coedge before it in the loop ends.
    Curves of a degree above `most` are interpolated.
    """
    rows = (topology.coedge_edges == NO_EDGE).nonzero()[0]
    if not len(rows):
        return topology
    face, pcurves = topology.coedge_faces[rows], topology.pcurves.take(rows)
    curves = compose_curves(surfaces, face, pcurves, GOAL * tolerance, most)
    is_reversed = topology.coedge_reversed[rows]
    begin_t = np.where(is_reversed, curves.end, curves.start)
    begins = curves.evaluate(np.arange(len(rows)), begin_t)
    topology, vertices = topology.add_vertices(begins, tolerance)
    # The loops have such coedges only.
    starts, counts = (
        x[topology.coedge_loops[rows]] for x in (topology.loop_starts, topology.loop_counts)
    )
    vertex = np.full(len(topology.coedge_edges), -1)
    vertex[rows] = vertices
    following = starts + (rows - starts + 1) % counts
    is_point = measure_polygons(curves) <= tolerance
    # A pole begins and ends at one vertex.
    for row in is_point.nonzero()[0].tolist():
        old, new = vertex[following[row]], vertex[rows[row]]
        vertex[vertex == old] = new
    ends = np.stack([vertex[rows], vertex[following]], axis=1)
    ends = np.where(is_reversed[:, np.newaxis], ends[:, ::-1], ends)
    edges = np.empty(len(rows), np.intp)
    lines, points = (~is_point).nonzero()[0], is_point.nonzero()[0]
    topology, edges[lines] = topology.add_edges(ends[lines], curves.take(lines), ADDED, tolerance)
    if len(points):
        topology, edges[points] = topology.add_edges(ends[points], None, ADDED, tolerance)
        ranges = topology.edge_ranges.copy()
        ranges[edges[points]] = np.stack([pcurves.start[points], pcurves.end[points]], axis=1)
        topology = replace(topology, edge_ranges=ranges)
    coedge_edges = topology.coedge_edges.copy()
    coedge_edges[rows] = edges
    return replace(topology, coedge_edges=coedge_edges)
