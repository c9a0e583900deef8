"""A brep that is ready for meshing, whatever the tolerance."""

from dataclasses import dataclass
from functools import cached_property
from math import dist

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.brep.seams import find_seams
from service.engine.trims.border_tree import BorderTree
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.gaps import ENOUGH, bound_gaps
from service.engine.trims.inside import Regions
from service.engine.trims.places import SIZE, Places
from service.engine.trims.spline_shapes import find_kinks
from service.engine.trims.splines import Splines
from service.engine.trims.surfaces import FaceSurfaces
from service.surface.brep_model import BrepModel, SkippedFace

CLOSE = 2.0**-40
"""For questions, bounds of gaps above this share of the diagonal are made closer."""


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
        The lowered brep, for names, colours and shells; its box is that of the prepared brep.
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
    loop_sources : ndarray of int, shape (L,)
        The loop of the model that a loop is, or is a part of; −1 for natural borders.
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
    box : ndarray of float64, shape (2, 3)
        Least and greatest coordinates of vertices, of the control points of edges, and of nets
        restricted to the boxes of the parameter curves.
    known_gaps : ndarray of float64, shape (C,), or None
        Gaps that are proved already; NaN where not.
    periods : ndarray of float64, shape (F, 2), or None
        The lengths of the closed axes of the surfaces, in parameters; 0 for others. None if no
        surface is closed.
    left_out_gap : float
        The largest gap of the faces that are left out because their loops cross, touch or are
        reversed.
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
    loop_sources: Ints
    coedge_edges: Ints
    coedge_faces: Ints
    coedge_loops: Ints
    coedge_reversed: Bools
    is_replaced: Bools
    is_reversed: Bools
    edge_sources: Ints
    model_vertices: int
    skipped_faces: tuple[SkippedFace, ...]
    box: FloatArray
    known_gaps: FloatArray | None = None
    periods: FloatArray | None = None
    left_out_gap: float = 0.0

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of `box`."""
        return dist(*self.box.tolist())

    @property
    def pcurves_replaced(self) -> int:
        """Number of given parameter curves that were made anew."""
        return int(self.is_replaced.sum())

    @cached_property
    def kinks(self) -> tuple[Ints, FloatArray]:
        """Edges, and their parameters, at which a curve or a parameter curve of them has a kink."""
        edges = (self.edge_curves >= 0).nonzero()[0]
        edge_of = np.full(len(self.curves), -1)
        edge_of[self.edge_curves[edges]] = edges
        curve, t = find_kinks(self.curves)
        extent = self.places.extent[self.coedge_faces]
        coedge, pcurve_t = find_kinks(self.pcurves, extent)
        kinked = np.concatenate([edge_of[curve], self.coedge_edges[coedge]])
        return kinked, np.concatenate([t, pcurve_t])

    @cached_property
    def is_border(self) -> Bools:
        """Whether a coedge is a border of its face on the surface, (C,): no seam and no pole."""
        face, edge = self.coedge_faces, self.coedge_edges
        periods = self._periods[face] * (SIZE / self.places.extent[face])
        is_seam = find_seams(self.pcurves, edge, face, self.coedge_reversed, periods)
        is_border: Bools = ~(is_seam | self.is_degenerate[edge])
        return is_border

    @cached_property
    def regions(self) -> Regions:
        """The regions of all faces, for questions whether parameters are inside."""
        return Regions.of(
            self.places,
            BorderTree.of(
                self.pcurves,
                self.coedge_reversed,
                self.loop_counts,
                self.loop_faces,
                len(self.surfaces),
            ),
            loop_faces=self.loop_faces,
            is_border=self.is_border,
            periods=self._periods,
        )

    @property
    def _periods(self) -> FloatArray:
        """The lengths (F, 2) of closed axes, in parameters; 0 for others."""
        return np.zeros((len(self.surfaces), 2)) if self.periods is None else self.periods

    @cached_property
    def gaps(self) -> FloatArray:
        """Proved bounds γ ≥ sup |E(t) − S(c(t))|, shape (C,); 0 for degenerate edges."""
        count = len(self.coedge_edges)
        gaps = np.full(count, np.nan) if self.known_gaps is None else self.known_gaps.copy()
        curve = self.edge_curves[self.coedge_edges]
        gaps[curve < 0] = 0.0
        rows = np.isnan(gaps).nonzero()[0]
        gaps[rows] = self._bound_gaps(rows, ENOUGH)
        return gaps

    @cached_property
    def close_gaps(self) -> FloatArray:
        """The bounds `gaps`, shape (C,), made closer where they are above `CLOSE` diagonals.

        On surfaces that are closed up to a small distance, each end of a period has its own bound.
        """
        gaps = self.gaps.copy()
        is_curved = self.edge_curves[self.coedge_edges] >= 0
        is_closed = is_curved & (self._periods[self.coedge_faces] > 0).any(axis=1)
        rows = (is_closed | (gaps > CLOSE * self.diagonal)).nonzero()[0]
        found = self._bound_gaps(rows, CLOSE)
        gaps[rows] = np.where(is_closed[rows], found, np.minimum(gaps[rows], found))
        return gaps

    def _bound_gaps(self, rows: Ints, enough: float) -> FloatArray:
        """Bounds of the gaps of coedges `rows`; below `enough` diagonals they need not be close."""
        if not len(rows):
            return np.zeros(0)
        face, places = self.coedge_faces[rows], self.places
        scale = places.extent[face] / SIZE
        return bound_gaps(
            ClosedSurfaces.open(self.surfaces),
            face,
            self.curves,
            self.edge_curves[self.coedge_edges[rows]],
            self.pcurves.take(rows).map_points(-places.origin[face] / scale, scale),
            enough=enough * self.diagonal,
        ).bound
