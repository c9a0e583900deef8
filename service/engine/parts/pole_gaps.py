"""How far the poles of faces are from their vertices.

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


def bound_pole_gaps(prepared: PreparedBrep) -> FloatArray:
    """Bounds (C,) of sup |V − S(c(t))| for the coedges c of poles with the vertex V; else 0."""
    gaps = np.zeros(len(prepared.coedge_edges))
    rows = np.flatnonzero(prepared.edge_curves[prepared.coedge_edges] < 0)
    if not len(rows):
        return gaps
    count, edge = len(rows), prepared.coedge_edges[rows]
    face, places = prepared.coedge_faces[rows], prepared.places
    two = np.full(count, 2)
    poles = Splines.of(
        CurveTable(
            np.ones(count, np.intp),
            two,
            prepared.vertices[prepared.edge_vertices[edge, 0]].repeat(2, axis=0),
            np.ones(2 * count),
            np.zeros(count, bool),
            prepared.edge_ranges[edge].repeat(2, axis=1).ravel(),
        )
    )
    scale = places.extent[face] / SIZE
    pcurves = prepared.pcurves.take(rows).map_points(-places.origin[face] / scale, scale)
    surfaces = ClosedSurfaces.open(prepared.surfaces)
    gaps[rows] = bound_gaps(surfaces, face, poles, np.arange(count), pcurves).bound
    return gaps
