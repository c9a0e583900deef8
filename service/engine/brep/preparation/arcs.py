"""Loops as lists of arcs of coedges, while they are cut, with the edges that this makes or splits.

Nothing is added to the columns of the topology before all faces are cut: each column grows once.
"""

from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.brep.preparation.topology import Topology
from service.engine.trims.closure import ClosedSurfaces

SAME = 1e-9
"""Splits of an edge that are nearer than this share of its range are one."""


@dataclass(frozen=True, eq=False, slots=True)
class Arc:
    """A part of a coedge, as a loop runs along it, moved by (2,) in the parameters.

    `begin` and `end` are parameters of the edge; `begin` is greater where the coedge is reversed.
    """

    coedge: int
    begin: float
    end: float
    shift: FloatArray

    def move(self, shift: FloatArray) -> "Arc":
        """The arc, moved further."""
        return replace(self, shift=self.shift + shift)


ArcLoop: TypeAlias = list[Arc]


@dataclass(frozen=True, eq=False, slots=True)
class NewEdge:
    """An edge between two vertices, along the segment between two places of a face, from 0 to 1.

    At a pole its curve is one point.
    """

    vertices: tuple[int, int]
    face: int
    begin: FloatArray
    end: FloatArray
    source: int
    is_pole: bool


@dataclass(frozen=True, eq=False, slots=True)
class NewCoedge:
    """A coedge of an edge, along the segment between two places, in the edge's direction."""

    edge: int
    begin: FloatArray
    end: FloatArray
    is_reversed: bool


@dataclass(eq=False)
class CutLoops:
    """The loops of faces that are cut, with new vertices, edges and coedges, and splits of edges.

    Attributes
    ----------
    surfaces : ClosedSurfaces
    topology : Topology
        Before any cut. The numbers of new vertices, edges and coedges follow those that it has.
    loops : dict
        The loops of each face that was cut, with the loops of the model from which they came.
    splits : dict
        For each edge, parameters at which it is split, with the vertices there.
    vertices : list of ndarray of float64, shape (3,)
    edges : list of NewEdge
    coedges : list of NewCoedge
    """

    surfaces: ClosedSurfaces
    topology: Topology
    loops: dict[int, list[tuple[int, ArcLoop]]] = field(default_factory=dict)
    splits: dict[int, list[tuple[float, int]]] = field(default_factory=dict)
    vertices: list[FloatArray] = field(default_factory=list)
    edges: list[NewEdge] = field(default_factory=list)
    coedges: list[NewCoedge] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.old_edges = len(self.topology.edge_curves)
        self.old_coedges = len(self.topology.coedge_edges)

    def list_arcs(self, loop: int) -> ArcLoop:
        """The whole coedges of a loop of the topology."""
        first = int(self.topology.loop_starts[loop])
        last = first + int(self.topology.loop_counts[loop])
        edges = self.topology.coedge_edges[first:last]
        ends = self.topology.edge_ranges[edges]
        ends = np.where(self.topology.coedge_reversed[first:last, np.newaxis], ends[:, ::-1], ends)
        return [Arc(first + k, a, b, np.zeros(2)) for k, (a, b) in enumerate(ends.tolist())]

    def find_edge(self, coedge: int) -> int:
        """The edge of a coedge."""
        if coedge < self.old_coedges:
            return int(self.topology.coedge_edges[coedge])
        return self.coedges[coedge - self.old_coedges].edge

    def find_range(self, edge: int) -> tuple[float, float]:
        """The first and the last parameter of an edge."""
        if edge >= self.old_edges:
            return 0.0, 1.0
        start, end = self.topology.edge_ranges[edge].tolist()
        return start, end

    def find_vertices(self, edge: int) -> tuple[int, int]:
        """The vertices at which an edge begins and ends."""
        if edge >= self.old_edges:
            return self.edges[edge - self.old_edges].vertices
        first, last = self.topology.edge_vertices[edge].tolist()
        return first, last

    def is_pole(self, edge: int) -> bool:
        """Whether an edge is degenerate."""
        if edge >= self.old_edges:
            return self.edges[edge - self.old_edges].is_pole
        return bool(self.topology.is_degenerate[edge])

    def find_shapes(self, coedges: Ints) -> tuple[Ints, Ints]:
        """Degrees and numbers of spans (m,) of the parameter curves of coedges."""
        degree, spans = np.ones((2, len(coedges)), np.intp)
        old = (coedges < self.old_coedges).nonzero()[0]
        pcurves = self.topology.pcurves
        degree[old], spans[old] = pcurves.degree[coedges[old]], pcurves.span_count[coedges[old]]
        return degree, spans

    def evaluate(self, coedges: Ints, t: FloatArray) -> FloatArray:
        """The places (m, 2) of coedges at parameters of their edges."""
        is_old = coedges < self.old_coedges
        if is_old.all():
            return self.topology.pcurves.evaluate(coedges, t)
        places = np.empty((len(coedges), 2))
        old, new = is_old.nonzero()[0], (~is_old).nonzero()[0]
        if len(old):
            places[old] = self.topology.pcurves.evaluate(coedges[old], t[old])
        lines = [self.coedges[k - self.old_coedges] for k in coedges[new].tolist()]
        begin, end = np.array([[line.begin, line.end] for line in lines]).swapaxes(0, 1)
        places[new] = begin + t[new, np.newaxis] * (end - begin)
        return places

    def add_vertex(self, point: FloatArray) -> int:
        """A new vertex at a point (3,)."""
        self.vertices.append(point)
        return len(self.topology.vertices) + len(self.vertices) - 1

    def add_edge(self, edge: NewEdge) -> int:
        """A new edge."""
        self.edges.append(edge)
        return self.old_edges + len(self.edges) - 1

    def add_coedge(self, coedge: NewCoedge) -> Arc:
        """A new coedge, as an arc."""
        self.coedges.append(coedge)
        begin, end = (1.0, 0.0) if coedge.is_reversed else (0.0, 1.0)
        return Arc(self.old_coedges + len(self.coedges) - 1, begin, end, np.zeros(2))

    def split(self, coedge: int, t: float) -> int:
        """The vertex at which the edge of a coedge is split at a parameter."""
        edge = self.find_edge(coedge)
        start, end = self.find_range(edge)
        for other, vertex in self.splits.get(edge, []):
            if abs(other - t) <= SAME * (end - start):
                return vertex
        if self.is_pole(edge):
            vertex = self.find_vertices(edge)[0]
        elif edge < self.old_edges:
            curve = self.topology.edge_curves[[edge]]
            vertex = self.add_vertex(self.topology.curves.evaluate(curve, np.array([t]))[0])
        else:
            new = self.edges[edge - self.old_edges]
            place = new.begin + t * (new.end - new.begin)
            face = np.array([new.face])
            vertex = self.add_vertex(self.surfaces.evaluate(face, place[np.newaxis])[0])
        self.splits.setdefault(edge, []).append((t, vertex))
        return vertex
