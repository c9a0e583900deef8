"""How far edges are from their faces, and poles of faces from their vertices.

Proof in docs/proofs.md: "Gaps of edges".
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.gaps import bound_gaps
from service.engine.trims.places import SIZE
from service.engine.trims.splines import Splines
from service.surface.spline_tables import CurveTable


def bound_all_gaps(prepared: PreparedBrep) -> FloatArray:
    """Bounds (C,) of sup |E(t) − S(c(t))| for all coedges c, where E is the vertex of a pole.

    `PreparedBrep.close_gaps` has those of edges that have curves; at poles it is 0.
    """
    gaps = prepared.close_gaps.copy()
    rows = np.flatnonzero(prepared.edge_curves[prepared.coedge_edges] < 0)
    if not len(rows):
        return gaps
    edge, face, places = prepared.coedge_edges[rows], prepared.coedge_faces[rows], prepared.places
    vertices = prepared.vertices[prepared.edge_vertices[edge, 0]]
    poles = _draw_points(vertices, prepared.edge_ranges[edge])
    scale = places.extent[face] / SIZE
    pcurves = prepared.pcurves.take(rows).map_points(-places.origin[face] / scale, scale)
    surfaces = ClosedSurfaces.open(prepared.surfaces)
    gaps[rows] = bound_gaps(surfaces, face, poles, np.arange(len(rows)), pcurves).bound
    return gaps


def _draw_points(points: FloatArray, ranges: FloatArray) -> Splines:
    """Curves that are the points (m, 3), over the ranges (m, 2) of parameters."""
    count = len(points)
    return Splines.of(
        CurveTable(
            np.ones(count, np.intp),
            np.full(count, 2),
            points.repeat(2, axis=0),
            np.ones(2 * count),
            np.zeros(count, bool),
            ranges.repeat(2, axis=1).ravel(),
        )
    )
