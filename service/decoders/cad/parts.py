"""Builds parts of faces that share edges, from what a reader finds in a file.

A reader names vertices and edges by keys, such as the numbers of entities; each key makes one
vertex or edge. Edges and vertices that faces left out have used stay away from the part.
"""

from collections import Counter
from collections.abc import Hashable, Iterable, Sequence

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Coedge, Curve, Edge, Face, Part, Shell, Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, check_point, distance
from service.decoders.cad.newton import find_middle
from service.decoders.cad.outline import NO_OUTLINE, Outline, enclose_points
from service.decoders.cad.splines import project_points

Color = tuple[float, ...]


class PartBuilder:
    """A part while it is made.

    Attributes
    ----------
    edge_gap, vertex_gap : float
        The largest distance from an edge to its surface, and from a vertex to its edge, so far.
    open_edges : int
        Edges with an odd number of coedges in shells that were said to be closed, so far.
    """

    def __init__(
        self, name: str = "", uncertainty: float | None = None, color: Color | None = None
    ) -> None:
        self.name = name
        self.uncertainty = uncertainty
        self.color = color
        self.edge_gap = 0.0
        self.vertex_gap = 0.0
        self.open_edges = 0
        self._points: list[Vector] = []
        self._vertices: dict[Hashable, int] = {}
        self._at_point: dict[Vector, int] = {}
        self._edges: list[Edge] = []
        self._edge_numbers: dict[Hashable, int] = {}
        self._nets: dict[int, FloatArray] = {}
        self._middles: dict[int, list[float]] = {}
        self._faces: list[Face] = []
        self._shells: list[Shell] = []

    @property
    def face_count(self) -> int:
        """The number of faces so far."""
        return len(self._faces)

    def add_vertex(self, key: Hashable, point: Vector) -> int:
        """The number of the vertex with this key; it is made if it is new.

        Raises
        ------
        InvalidGeometry
            A coordinate is not finite or too large.
        """
        number = self._vertices.get(key)
        if number is None:
            check_point(point)
            # Loops of some files end at one of two vertices that are the very same point.
            number = self._vertices[key] = self._at_point.setdefault(point, len(self._points))
            if number == len(self._points):
                self._points.append(point)
        return number

    def find_point(self, vertex: int) -> Vector:
        """The point of a vertex."""
        return self._points[vertex]

    def find_edge(self, key: Hashable) -> int | None:
        """The number of the edge with this key, or None if there is none yet."""
        return self._edge_numbers.get(key)

    def find_ends(self, coedge: Coedge) -> tuple[int, int]:
        """The vertices from which and to which a loop runs along an edge."""
        first, last = self._edges[coedge.edge].vertices
        return (last, first) if coedge.is_reversed else (first, last)

    def add_edge(
        self,
        key: Hashable,
        vertices: tuple[int, int],
        curve: Curve | None = None,
        *,
        uncertainty: float | None = None,
        gap: float | None = None,
    ) -> int:
        """The number of a new edge: a curve from its first vertex to its second, or a line.

        Parameters
        ----------
        gap : float or None
            The distance from the vertices to the edge, if it is known; otherwise that of the ends
            of the curve.

        Raises
        ------
        InvalidGeometry
            A line has no length.
        """
        first, last = (self._points[vertex] for vertex in vertices)
        if curve is None:
            if first == last:
                raise InvalidGeometry("an edge on a line has no length")
        elif gap is None:
            start, end = project_points(curve.points[[0, -1]]).tolist()
            gap = max(distance(start, first), distance(end, last))
        self.vertex_gap = max(self.vertex_gap, gap or 0.0)
        number = self._edge_numbers[key] = len(self._edges)
        self._edges.append(Edge(vertices, curve, uncertainty=uncertainty))
        return number

    def add_pole(self, key: Hashable, vertex: int) -> int:
        """The number of a new degenerate edge at a vertex."""
        number = self._edge_numbers[key] = len(self._edges)
        self._edges.append(Edge((vertex, vertex), is_degenerate=True))
        return number

    def find_outline(
        self, loops: Sequence[Sequence[Coedge]], vertices: Iterable[int] = ()
    ) -> Outline:
        """The outline of a face with these loops, and with single vertices such as an apex."""
        nets: list[FloatArray] = []
        sizes = []
        for loop in loops:
            size = 0
            for coedge in loop:
                net = self._find_net(coedge.edge)
                nets.append(net[::-1] if coedge.is_reversed else net)
                size += len(net)
            sizes.append(size)
        ends = [points for net in nets for points in (net[0], net[-1])]
        middles = [self._find_middle(coedge.edge) for loop in loops for coedge in loop]
        for vertex in vertices:
            nets.append(np.array([self._points[vertex]]))
            ends.append(nets[-1][0])
        if not nets:
            return NO_OUTLINE
        return Outline(
            np.concatenate(nets), np.array(ends), tuple(sizes), np.array(middles).reshape(-1, 3)
        )

    def add_face(
        self,
        surface: Surface,
        loops: Sequence[Sequence[Coedge]],
        *,
        is_reversed: bool = False,
        turns_with_face: bool = True,
        name: str = "",
        color: Color | None = None,
    ) -> int:
        """The number of a new face.

        Parameters
        ----------
        loops : sequence of sequences of Coedge
            Loops without coedges, which are single vertices in a file, are left out.
        is_reversed : bool
            Whether the face's normal is opposite to du × dv.
        turns_with_face : bool
            Whether the loops have the face's material on their left seen against the face's normal,
            as in STEP, and not against du × dv, as in IGES. The loops of reversed faces are then
            turned around.

        Raises
        ------
        InvalidGeometry
            A loop is open.
        """
        kept = [tuple(loop) for loop in loops if len(loop)]
        for loop in kept:
            self._check_loop(loop)
        if is_reversed and turns_with_face:
            kept = [reverse_loop(loop) for loop in kept]
        self._faces.append(Face(surface, tuple(kept), is_reversed, name, color))
        return len(self._faces) - 1

    def add_shell(self, faces: Iterable[int], is_closed: bool) -> None:
        """Add a shell of faces; without faces nothing is added.

        A shell that is said to be closed is open if some of its edges have an odd number of
        coedges, which `open_edges` counts.
        """
        numbers = tuple(faces)
        if not numbers:
            return
        if is_closed:
            count = self._count_borders(numbers)
            self.open_edges += count
            is_closed = not count
        self._shells.append(Shell(numbers, is_closed))

    def note_gap(self, gap: float) -> None:
        """Record the distance of an edge from a surface."""
        self.edge_gap = max(self.edge_gap, gap)

    def build(self) -> Part | None:
        """The part, or None if it has no faces; faces in no shell are an open shell."""
        if not self._faces:
            return None
        in_shells = {face for shell in self._shells for face in shell.faces}
        loose = tuple(face for face in range(len(self._faces)) if face not in in_shells)
        shells = [*self._shells, Shell(loose, False)] if loose else self._shells
        vertices, edges, faces = self._drop_unused()
        return Part(
            self.name,
            np.array(vertices, np.float64).reshape(-1, 3),
            edges,
            faces,
            tuple(shells),
            self.uncertainty,
            self.color,
        )

    def _count_borders(self, faces: Iterable[int]) -> int:
        """The number of edges that faces use an odd number of times; poles are none."""
        loops = [loop for face in faces for loop in self._faces[face].loops]
        uses = Counter(coedge.edge for loop in loops for coedge in loop)
        return sum(count % 2 for edge, count in uses.items() if not self._edges[edge].is_degenerate)

    def _find_net(self, edge: int) -> FloatArray:
        """Points around an edge, (k, 3): mostly its control points."""
        net = self._nets.get(edge)
        if net is None:
            value = self._edges[edge]
            if value.curve is None:
                net = np.array([self._points[vertex] for vertex in value.vertices])
            else:
                net = enclose_points(project_points(value.curve.points))
            self._nets[edge] = net
        return net

    def _find_middle(self, edge: int) -> list[float]:
        """A point inside an edge."""
        middle = self._middles.get(edge)
        if middle is None:
            value = self._edges[edge]
            if value.curve is None:
                ends = zip(*(self._points[vertex] for vertex in value.vertices), strict=True)
                middle = [(a + b) / 2 for a, b in ends]
            else:
                middle = find_middle(value.curve)
            self._middles[edge] = middle
        return middle

    def _check_loop(self, loop: Sequence[Coedge]) -> None:
        """Refuse a loop whose edges don't follow each other from vertex to vertex."""
        ends = [self.find_ends(coedge) for coedge in loop]
        for (_, last), (first, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
            if last != first:
                raise InvalidGeometry("the edges of a loop do not follow each other")

    def _drop_unused(
        self,
    ) -> tuple[list[Vector], tuple[Edge, ...], tuple[Face, ...]]:
        """Vertices, edges and faces, without the edges and vertices that no face uses."""
        used_edges = {coedge.edge for face in self._faces for loop in face.loops for coedge in loop}
        used = {vertex for edge in used_edges for vertex in self._edges[edge].vertices}
        if len(used_edges) == len(self._edges) and len(used) == len(self._points):
            return self._points, tuple(self._edges), tuple(self._faces)
        vertex_map = {old: new for new, old in enumerate(sorted(used))}
        edge_map = {old: new for new, old in enumerate(sorted(used_edges))}
        edges = []
        for number in edge_map:
            edge = self._edges[number]
            first, last = (vertex_map[vertex] for vertex in edge.vertices)
            edges.append(Edge((first, last), edge.curve, edge.is_degenerate, edge.uncertainty))
        faces = [
            Face(
                face.surface,
                tuple(
                    tuple(Coedge(edge_map[c.edge], c.is_reversed, c.pcurve) for c in loop)
                    for loop in face.loops
                ),
                face.is_reversed,
                face.name,
                face.color,
            )
            for face in self._faces
        ]
        return [self._points[vertex] for vertex in vertex_map], tuple(edges), tuple(faces)


def reverse_loop(loop: Sequence[Coedge]) -> tuple[Coedge, ...]:
    """The loop in the other direction; pcurves run along their edges, so they stay."""
    return tuple(
        Coedge(coedge.edge, not coedge.is_reversed, coedge.pcurve) for coedge in reversed(loop)
    )
