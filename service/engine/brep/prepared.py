"""A brep made ready for meshing: all that does not depend on a tolerance, once for a surface."""

from dataclasses import dataclass
from functools import cached_property
from math import dist

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.chains import join_chains
from service.engine.brep.parameter_curves import ParameterCurves, find_parameter_curves
from service.engine.brep.topology import Topology
from service.engine.trims.boxes import find_part_box
from service.engine.trims.closure import ClosedSurfaces, find_closure
from service.engine.trims.gaps import bound_gaps
from service.engine.trims.places import SIZE, Places
from service.engine.trims.spline_shapes import find_boxes
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.brep_model import BrepModel, SkippedFace

CLOSED = 1e-7
"""Sides of a surface that are nearer than this share of the diagonal are one curve, or a pole."""


@dataclass(frozen=True, eq=False)
class PreparedBrep:
    """A brep whose regions are given: every coedge has a parameter curve, every face has loops.

    The faces are those of the model, with the same numbers. A face without loops is skipped: it
    gets no triangles. The first `model_vertices` vertices are those of the model; natural borders,
    poles, private seams and edges of loops that are given by parameter curves alone come after the
    edges of the model. The region of a face is where its loops have the winding
    number 1; material is on the left of a loop, seen against du × dv. Where a parameter curve does
    not begin at the end of the one before, the straight segment between them belongs to the loop.

    Attributes
    ----------
    model : BrepModel
        The lowered brep, for names, colours and shells.
    surfaces : FaceSurfaces
        The surfaces of all faces.
    places : Places
        The parameters of all faces as whole numbers.
    curves : Splines
        Curves of space, one for each edge that is not degenerate.
    pcurves : Splines
        Parameter curves in places, one for each coedge, in its order. Curve c runs along the edge
        of coedge c at the edge's own parameters, also where the coedge is reversed.
    vertices : ndarray of float64, shape (V, 3)
    vertex_uncertainties : ndarray of float64, shape (V,)
    edge_vertices : ndarray of int, shape (E, 2)
        First and last vertex.
    edge_curves : ndarray of int, shape (E,)
        The number of each edge's curve in `curves`; −1 for degenerate edges.
    edge_ranges : ndarray of float64, shape (E, 2)
        The first and the last parameter of each edge, also of degenerate ones.
    edge_uncertainties : ndarray of float64, shape (E,)
    is_degenerate : ndarray of bool, shape (E,)
        Whether the edge is one point of space: a pole.
    loop_faces : ndarray of int, shape (L,)
        The face of each loop, in ascending order.
    loop_counts : ndarray of int, shape (L,)
        The number of coedges of each loop.
    coedge_edges : ndarray of int, shape (C,)
    coedge_faces : ndarray of int, shape (C,)
    coedge_loops : ndarray of int, shape (C,)
        Edge, face and loop of each coedge, in the order of loops.
    coedge_reversed : ndarray of bool, shape (C,)
        Whether the loop runs against the edge.
    is_replaced : ndarray of bool, shape (C,)
        Whether a parameter curve was made although one was given.
    is_reversed : ndarray of bool, shape (F,)
        Whether the normal of the face is −du × dv.
    edge_sources : ndarray of int, shape (E,)
        The edge of the model that an edge is, or is a piece of; −1 for edges that were added, and
        −2 for private seams, which are no borders of the face.
    model_vertices : int
        The number of vertices of the model.
    skipped_faces : tuple of SkippedFace
        By number; with those that were left out when the brep was created.
    known_gaps : ndarray of float64, shape (C,)
        Gaps that are proved already; NaN where not.
    """

    model: BrepModel
    surfaces: FaceSurfaces
    places: Places
    curves: Splines
    pcurves: Splines
    vertices: FloatArray
    vertex_uncertainties: FloatArray
    edge_vertices: Ints
    edge_curves: Ints
    edge_ranges: FloatArray
    edge_uncertainties: FloatArray
    is_degenerate: Bools
    loop_faces: Ints
    loop_counts: Ints
    coedge_edges: Ints
    coedge_faces: Ints
    coedge_loops: Ints
    coedge_reversed: Bools
    is_replaced: Bools
    is_reversed: Bools
    edge_sources: Ints
    model_vertices: int
    skipped_faces: tuple[SkippedFace, ...]
    known_gaps: FloatArray

    @cached_property
    def box(self) -> FloatArray:
        """The box about vertices, edges and faces, (2, 3).

        Least and greatest coordinates of vertices, of the control points of edges, and of nets
        restricted to the boxes of the parameter curves.
        """
        points = [nets.points.transpose(2, 0, 1).reshape(-1, 3) for nets in self.curves.groups]
        low, high = _box_faces(self.pcurves, self.coedge_faces, len(self.surfaces))
        return np.stack(find_part_box(self.places, low, high, self.vertices, *points))

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of `box`."""
        return dist(*self.box.tolist())

    @property
    def pcurves_replaced(self) -> int:
        """Number of given parameter curves that were made anew."""
        return int(self.is_replaced.sum())

    @cached_property
    def gaps(self) -> FloatArray:
        """Proved bounds γ ≥ sup |E(t) − S(c(t))|, shape (C,); 0 for degenerate edges."""
        gaps = self.known_gaps.copy()
        curve = self.edge_curves[self.coedge_edges]
        gaps[curve < 0] = 0.0
        rows = np.isnan(gaps).nonzero()[0]
        if len(rows):
            face, places = self.coedge_faces[rows], self.places
            scale = places.extent[face] / SIZE
            pcurves = self.pcurves.take(rows).map_points(-places.origin[face] / scale, scale)
            open_surfaces = ClosedSurfaces.open(self.surfaces)
            gaps[rows] = bound_gaps(open_surfaces, face, self.curves, curve[rows], pcurves).bound
        return gaps


def prepare(model: BrepModel) -> PreparedBrep:
    """Make a brep ready for meshing, whatever the tolerance.

    Raises
    ------
    InvalidRequest
        If a face is invalid and the model does not skip invalid faces: `edge_not_on_surface`,
        `pcurve_outside`, `loop_reversed`, `loops_cross`, `loops_touch`.
    """
    diagonal = _measure_model(model)
    surfaces = FaceSurfaces.of(model.surfaces, model.name)
    closed = find_closure(surfaces, CLOSED * diagonal)
    curves = Splines.of(model.curves)
    found = find_parameter_curves(model, closed, curves, diagonal)
    topology = _begin(model, curves, found)
    topology, _ = join_chains(closed, topology, CLOSED * diagonal)
    return _finish(model, surfaces, topology)


def _measure_model(model: BrepModel) -> float:
    """A diagonal of the part from its vertices and edges, or from whole nets if it has none."""
    points = np.concatenate([model.vertices, model.curves.points])
    count = len(np.unique(model.loop_faces))
    if not len(points) or count + len(model.skipped) < model.face_count:
        points = np.concatenate([points, model.surfaces.points])
    return dist(points.min(axis=0), points.max(axis=0))


def _begin(model: BrepModel, curves: Splines, found: ParameterCurves) -> Topology:
    """The topology of a model, with its parameter curves."""
    edge_count = len(model.edge_curves)
    ranges = np.tile([0.0, 1.0], (edge_count, 1))
    curved = model.edge_curves >= 0
    number = model.edge_curves[curved]
    ranges[curved] = np.stack([curves.start[number], curves.end[number]], axis=1)
    # Poles have the parameters of their parameter curves.
    edge = model.coedge_edges
    poles = ((edge >= 0) & ~found.is_open).nonzero()[0]
    poles = poles[model.edge_curves[edge[poles]] < 0]
    start, end = found.pcurves.start, found.pcurves.end
    ranges[edge[poles]] = np.stack([start[poles], end[poles]], axis=1)
    start, end = start.copy(), end.copy()
    start[poles], end[poles] = ranges[edge[poles]].T
    return Topology(
        model.vertices,
        model.vertex_uncertainties,
        model.edge_vertices,
        model.edge_curves,
        ranges,
        model.edge_uncertainties,
        model.is_degenerate,
        np.arange(edge_count),
        curves,
        model.loop_faces,
        model.loop_counts,
        edge,
        model.coedge_reversed,
        found.pcurves.move_ranges(start, end),
        model.coedge_pcurves >= 0,
        found.is_replaced,
        found.is_open | ((edge >= 0) & model.is_degenerate[edge]),
        found.gaps,
    )


def _box_faces(pcurves: Splines, face: Ints, count: int) -> tuple[FloatArray, FloatArray]:
    """The boxes (F, 2) about the parameter curves of each face; empty without any."""
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    if len(face):
        begins = np.flatnonzero(np.diff(face, prepend=-1))
        least, most = find_boxes(pcurves)
        low[face[begins]] = np.minimum.reduceat(least, begins)
        high[face[begins]] = np.maximum.reduceat(most, begins)
    return low, high


def _finish(model: BrepModel, surfaces: FaceSurfaces, topology: Topology) -> PreparedBrep:
    """Places over the boxes of the parameter curves, and these in places."""
    face = topology.coedge_faces
    low, high = _box_faces(topology.pcurves, face, len(surfaces))
    surfaces = surfaces.move_planes(low, high)
    places = Places.of(surfaces, low, high)
    pcurves = topology.pcurves.map_points(places.origin[face], SIZE / places.extent[face])
    return PreparedBrep(
        model=model,
        surfaces=surfaces,
        places=places,
        curves=topology.curves,
        pcurves=pcurves,
        vertices=topology.vertices,
        vertex_uncertainties=topology.vertex_uncertainties,
        edge_vertices=topology.edge_vertices,
        edge_curves=topology.edge_curves,
        edge_ranges=topology.edge_ranges,
        edge_uncertainties=topology.edge_uncertainties,
        is_degenerate=topology.is_degenerate,
        loop_faces=topology.loop_faces,
        loop_counts=topology.loop_counts,
        coedge_edges=topology.coedge_edges,
        coedge_faces=face,
        coedge_loops=topology.coedge_loops,
        coedge_reversed=topology.coedge_reversed,
        is_replaced=topology.is_replaced,
        is_reversed=model.is_reversed,
        edge_sources=topology.edge_sources,
        model_vertices=len(model.vertices),
        skipped_faces=model.skipped,
        known_gaps=topology.gaps,
    )
