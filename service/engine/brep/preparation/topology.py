"""Vertices, edges, loops and coedges of a brep as columns, while its regions are being made."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs
from service.engine.trims.splines import Splines

ADDED = -1
"""The source of edges that were added: natural borders, poles, edges of parameter curves alone."""

SEAM = -2
"""The source of private seams."""


@dataclass(frozen=True, eq=False)
class Topology:
    """V vertices, E edges, L loops of C coedges; the names are those of `PreparedBrep`.

    Attributes
    ----------
    curves : Splines
        Curves of space.
    pcurves : Splines
        C curves, in parameters of the surfaces, at the parameters of their edges.
    loop_sources : ndarray of int, shape (L,)
        The loop of the model of which a loop is, or which gave its first coedge; −1 for natural
        loops.
    is_given : ndarray of bool, shape (C,)
        Whether the request has a parameter curve for the coedge that is used, or was a guess.
    is_replaced : ndarray of bool, shape (C,)
    is_open : ndarray of bool, shape (C,)
        Whether the parameter curve is still to be made: the coedge is a pole.
    gaps : ndarray of float64, shape (C,)
        Proved gaps; NaN where they are not known yet.
    """

    vertices: FloatArray
    vertex_uncertainties: FloatArray
    edge_vertices: Ints
    edge_curves: Ints
    edge_ranges: FloatArray
    edge_uncertainties: FloatArray
    is_degenerate: Bools
    edge_sources: Ints
    curves: Splines
    loop_faces: Ints
    loop_counts: Ints
    loop_sources: Ints
    coedge_edges: Ints
    coedge_reversed: Bools
    pcurves: Splines
    is_given: Bools
    is_replaced: Bools
    is_open: Bools
    gaps: FloatArray

    @cached_property
    def loop_starts(self) -> Ints:
        """The first coedge of each loop, (L,)."""
        return np.cumsum(self.loop_counts) - self.loop_counts

    @cached_property
    def coedge_loops(self) -> Ints:
        """The loop of each coedge, (C,)."""
        return np.repeat(np.arange(len(self.loop_counts)), self.loop_counts)

    @cached_property
    def coedge_faces(self) -> Ints:
        """The face of each coedge, (C,)."""
        faces: Ints = self.loop_faces[self.coedge_loops]
        return faces

    @cached_property
    def coedge_vertices(self) -> Ints:
        """The vertices (2, C) at which coedges begin and end, along their loops."""
        ends = self.edge_vertices[self.coedge_edges]
        ends = np.where(self.coedge_reversed[:, np.newaxis], ends[:, ::-1], ends)
        return np.ascontiguousarray(ends.T)

    @cached_property
    def ends(self) -> FloatArray:
        """The parameters (2, C, 2) at which coedges begin and end, along their loops."""
        every = np.arange(len(self.coedge_edges))
        parameters = self.edge_ranges[self.coedge_edges].T.ravel()
        ends = self.pcurves.evaluate(np.concatenate([every, every]), parameters)
        ends = ends.reshape(2, -1, 2)
        return np.where(self.coedge_reversed[:, np.newaxis], ends[::-1], ends)

    def take_coedges(
        self, coedges: Ints, loop_faces: Ints, loop_counts: Ints, loop_sources: Ints
    ) -> "Topology":
        """Other loops, of coedges (k,) that exist, between all edges."""
        return replace(
            self,
            loop_faces=loop_faces,
            loop_counts=loop_counts,
            loop_sources=loop_sources,
            coedge_edges=self.coedge_edges[coedges],
            coedge_reversed=self.coedge_reversed[coedges],
            pcurves=self.pcurves.take(coedges),
            is_given=self.is_given[coedges],
            is_replaced=self.is_replaced[coedges],
            is_open=self.is_open[coedges],
            gaps=self.gaps[coedges],
        )

    def drop_faces(self, faces: Ints) -> "Topology":
        """The topology without the loops of some faces."""
        if not len(faces):
            return self
        kept = (~np.isin(self.loop_faces, faces)).nonzero()[0]
        _, coedges = expand_runs(self.loop_counts[kept], self.loop_starts[kept])
        return self.take_coedges(
            coedges, self.loop_faces[kept], self.loop_counts[kept], self.loop_sources[kept]
        )

    def sort_loops(self) -> "Topology":
        """The loops in the order of their faces."""
        if (np.diff(self.loop_faces) >= 0).all():
            return self
        order = self.loop_faces.argsort(kind="stable")
        _, coedges = expand_runs(self.loop_counts[order], self.loop_starts[order])
        return self.take_coedges(
            coedges, self.loop_faces[order], self.loop_counts[order], self.loop_sources[order]
        )

    def add_vertices(self, points: FloatArray, uncertainty: float) -> tuple["Topology", Ints]:
        """With further vertices (k, 3), and their numbers."""
        numbers = len(self.vertices) + np.arange(len(points))
        added = replace(
            self,
            vertices=np.concatenate([self.vertices, points]),
            vertex_uncertainties=np.concatenate(
                [self.vertex_uncertainties, np.full(len(points), uncertainty)]
            ),
        )
        return added, numbers

    def add_edges(
        self, vertices: Ints, curves: Splines | None, source: int, uncertainty: float
    ) -> tuple["Topology", Ints]:
        """With further edges between vertices (k, 2), and their numbers.

        Without curves the edges are degenerate, with the parameters [0, 1].
        """
        count, old = len(vertices), len(self.edge_curves)
        if curves is None:
            numbers, ranges = np.full(count, -1), np.tile([0.0, 1.0], (count, 1))
        else:
            numbers = len(self.curves) + np.arange(count)
            ranges = np.stack([curves.start, curves.end], axis=1)
        added = replace(
            self,
            edge_vertices=np.concatenate([self.edge_vertices, vertices]),
            edge_curves=np.concatenate([self.edge_curves, numbers]),
            edge_ranges=np.concatenate([self.edge_ranges, ranges]),
            edge_uncertainties=np.concatenate(
                [self.edge_uncertainties, np.full(count, uncertainty)]
            ),
            is_degenerate=np.concatenate([self.is_degenerate, np.full(count, curves is None)]),
            edge_sources=np.concatenate([self.edge_sources, np.full(count, source)]),
            curves=self.curves if curves is None else Splines.join([self.curves, curves]),
        )
        return added, old + np.arange(count)

    def add_coedges(
        self,
        edges: Ints,
        is_reversed: Bools,
        pcurves: Splines,
        is_replaced: Bools | None = None,
        gaps: FloatArray | None = None,
    ) -> "Topology":
        """With further coedges (k,) after those that exist; the loops do not have them yet."""
        count = len(edges)
        no = np.zeros(count, bool)
        gaps = np.full(count, np.nan) if gaps is None else gaps
        replaced = no if is_replaced is None else is_replaced
        return replace(
            self,
            coedge_edges=np.concatenate([self.coedge_edges, edges]),
            coedge_reversed=np.concatenate([self.coedge_reversed, is_reversed]),
            pcurves=Splines.join([self.pcurves, pcurves]),
            is_given=np.concatenate([self.is_given, no]),
            is_replaced=np.concatenate([self.is_replaced, replaced]),
            is_open=np.concatenate([self.is_open, no]),
            gaps=np.concatenate([self.gaps, gaps]),
        )
