"""Arcs along the borders of a cut: seams, and the sides of poles, with their edges and vertices."""

from dataclasses import dataclass, field

import numpy as np

from service.bases.arrays import FloatArray
from service.engine.brep.preparation.arcs import ArcLoop, CutLoops, NewCoedge, NewEdge
from service.engine.brep.preparation.topology import ADDED, SEAM
from service.engine.trims.closure import ClosedSurfaces


@dataclass(eq=False)
class SeamMaker:
    """Makes the edges and coedges of the cut of one face across an axis.

    Attributes
    ----------
    surfaces : ClosedSurfaces
    work : CutLoops
        Gets the new vertices, edges and coedges.
    face, axis : int
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
        return self.work.add_vertex(point[0])

    def make_pole_vertex(self, end: int, side: float) -> int:
        """The vertex at a pole."""
        if end not in self.poles:
            self.poles[end] = self.add_vertex(self.place(self.line, side))
        return self.poles[end]

    def make_pole(self, vertex: int, side: float, *, from_high: bool) -> ArcLoop:
        """The arc along the side of a pole, from one border to the other."""
        low, high = self.place(self.line, side), self.place(self.line, side)
        high[self.axis] += self._period
        begin, end = (high, low) if from_high else (low, high)
        edge = NewEdge((vertex, vertex), self.face, begin, end, ADDED, is_pole=True)
        coedge = NewCoedge(self.work.add_edge(edge), begin, end, is_reversed=False)
        return [self.work.add_coedge(coedge)]

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
            vertices = vertices[1], vertices[0]
        across = self.line + (self._period if is_high else 0.0)
        begin, end = self.place(across, low), self.place(across, high)
        if key not in self.seams:
            edge = NewEdge(vertices, self.face, begin, end, SEAM, is_pole=False)
            self.seams[key] = self.work.add_edge(edge)
        return [self.work.add_coedge(NewCoedge(self.seams[key], begin, end, is_down))]

    @property
    def _period(self) -> float:
        """The length of the domain along the axis."""
        return float(self.surfaces.period[self.face, self.axis])
