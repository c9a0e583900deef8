"""Arcs along the borders of a cut: seams, and the sides of poles, with their edges and vertices."""

from dataclasses import dataclass, field

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.brep.arcs import Arc, ArcLoop, CutLoops
from service.engine.brep.topology import ADDED, SEAM
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.composition import compose_curves
from service.engine.trims.piecewise import make_segments


@dataclass(eq=False)
class SeamMaker:
    """Makes the edges and coedges of the cut of one face across an axis.

    Attributes
    ----------
    surfaces : ClosedSurfaces
    work : CutLoops
        Gets the new vertices, edges and coedges.
    face, axis : int
    tolerance : float
        Uncertainty of new edges and vertices. Model units.
    line : float
        The coordinate of the line across the axis.
    seams : dict
        The edge of each part of the line.
    poles : dict
        The vertex at each end of the other axis.
    """

    surfaces: ClosedSurfaces
    work: CutLoops
    face: int
    axis: int
    tolerance: float
    line: float = 0.0
    seams: dict[tuple[int, int], int] = field(default_factory=dict)
    poles: dict[int, int] = field(default_factory=dict)

    def place(self, across: float, along: float) -> FloatArray:
        """The parameters (2,) at a coordinate across the line, and one along it."""
        place = np.empty(2)
        place[self.axis], place[1 - self.axis] = across, along
        return place

    def add_vertex(self, place: FloatArray) -> int:
        """A new vertex at a point of the surface."""
        point = self.surfaces.evaluate(np.array([self.face]), place[np.newaxis])
        self.work.topology, numbers = self.work.topology.add_vertices(point, self.tolerance)
        return int(numbers[0])

    def make_pole_vertex(self, end: int, side: float) -> int:
        """The vertex at a pole."""
        if end not in self.poles:
            self.poles[end] = self.add_vertex(self.place(self.line, side))
        return self.poles[end]

    def make_pole(self, vertex: int, side: float, *, from_high: bool) -> ArcLoop:
        """The arc along the side of a pole, from one border to the other."""
        low, high = self.place(self.line, side), self.place(self.line, side)
        high[self.axis] += self._period
        ends = (high, low) if from_high else (low, high)
        self.work.topology, edges = self.work.topology.add_edges(
            np.array([[vertex, vertex]]), None, ADDED, self.tolerance
        )
        return [self._add_coedge(int(edges[0]), ends[0], ends[1], is_reversed=False)]

    def make_seam(
        self,
        key: tuple[int, int],
        ends: tuple[float, float],
        vertices: tuple[int, int],
        *,
        is_high: bool,
    ) -> ArcLoop:
        """The arc of a seam along one border; its edge runs along the other axis upwards.

        `key` tells the part of the line: the edge is made once for both borders.
        """
        is_down = ends[1] < ends[0]
        low, high = min(ends), max(ends)
        if is_down:
            vertices = vertices[::-1]
        across = self.line + (self._period if is_high else 0.0)
        begin, end = self.place(across, low), self.place(across, high)
        if key not in self.seams:
            line = make_segments(begin[np.newaxis], end[np.newaxis], np.array([[0.0, 1.0]]))
            curve = compose_curves(self.surfaces, np.array([self.face]), line, self.tolerance)
            self.work.topology, edges = self.work.topology.add_edges(
                np.array([vertices]), curve, SEAM, self.tolerance
            )
            self.seams[key] = int(edges[0])
        return [self._add_coedge(self.seams[key], begin, end, is_reversed=is_down)]

    def _add_coedge(
        self, edge: int, begin: FloatArray, end: FloatArray, *, is_reversed: bool
    ) -> Arc:
        """A new coedge, with the segment between two places as its parameter curve."""
        line = make_segments(begin[np.newaxis], end[np.newaxis], np.array([[0.0, 1.0]]))
        number = len(self.work.topology.coedge_edges)
        self.work.topology = self.work.topology.add_coedges(
            np.array([edge]), np.array([is_reversed]), line
        )
        return self.work.make_arc(number)

    @property
    def _period(self) -> float:
        """The length of the domain along the axis."""
        return float(self.surfaces.period[self.face, self.axis])
