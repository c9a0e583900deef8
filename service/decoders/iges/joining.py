"""Joins faces that each have sides of their own, where whole sides agree.

Ends of sides that are nearer than the tolerance become one vertex. Two sides between the same
vertices become one edge if no point of one is further than the tolerance from the other; the side
that was read first stays, and the distance of the other is the uncertainty of the edge. Borders
that agree only in part stay open.

Some files state a resolution that their own loops do not have. Then the sides that are still alone
are joined up to twice the largest gap in a loop.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.cad.splines import reverse
from service.decoders.iges.distances import are_opposite, bound_distance
from service.decoders.iges.points import find_clusters
from service.decoders.iges.rings import match_rings
from service.decoders.iges.shapes import find_all_ends, measure_size
from service.decoders.iges.sides import Side

MOST_TRIED = 16
"""The most edges between two vertices with which a side is compared."""

SHORT = 4.0
"""A side that begins and ends at one vertex is a point if it is at most this many tolerances
long."""

MAX_GAP = 1e-2
"""The ends of sides that follow each other may be this far apart, as a share of the loop's size."""


@dataclass(frozen=True, eq=False, slots=True)
class JoinedEdge:
    """An edge.

    Attributes
    ----------
    curve : Curve
        That of the side that was read first.
    vertices : tuple of two ints
    distance : float
        How far the curves of all its sides may be from it and from the true ones.
    face : int
        The face of this side; −1 if another side of this face may be joined with it, at a seam.
    is_shared : bool
        Whether it has two sides; an edge never has more.
    """

    curve: Curve
    vertices: tuple[int, int]
    distance: float
    face: int
    is_shared: bool = False


@dataclass(frozen=True, slots=True)
class EdgeUse:
    """The use of an edge by a loop; edge −1 is a pole at a vertex."""

    edge: int
    is_reversed: bool
    pcurve: Curve | None
    vertex: int = -1


@dataclass(frozen=True, eq=False, slots=True)
class Joined:
    """Faces with shared edges.

    Attributes
    ----------
    points : ndarray of float64, shape (V, 3)
        The vertices, with some that nothing uses.
    edges : list of JoinedEdge
    loops : list of lists of lists of EdgeUse
        The loops of each face.
    """

    points: FloatArray
    edges: list[JoinedEdge]
    loops: list[list[list[EdgeUse]]]


Loops: TypeAlias = Sequence[Sequence[Side]]


def join_sides(
    faces: Sequence[Loops], has_seams: Sequence[bool], tolerance: float, most: float
) -> tuple[Joined, dict[int, str]]:
    """The faces, given by the sides of their loops, with shared edges.

    Parameters
    ----------
    has_seams : sequence of bool
        Whether the surface of each face is closed, so that two sides of the face may be one edge.
        Those of other faces may not, however narrow a face is.
    tolerance : float
    most : float
        The largest tolerance for sides that are still alone.

    Returns
    -------
    joined : Joined
        Faces that can't be joined have no loops.
    faults : dict
        The reasons for these faces, by their numbers.
    """
    joiner = _Joiner(faces, has_seams, tolerance)
    joiner.join_rest(most)
    joiner.join_rings()
    return joiner.joined, joiner.faults


class _Joiner:
    """Joins the sides of faces, one after another."""

    def __init__(self, faces: Sequence[Loops], has_seams: Sequence[bool], tolerance: float) -> None:
        self.faults: dict[int, str] = {}
        self._tolerance = tolerance
        self._curves: list[Curve] = []
        rows = [[list(map(self._add_row, loop)) for loop in loops] for loops in faces]
        self._sizes = [measure_size(curve) for curve in self._curves]
        self._ends = find_all_ends(self._curves) if self._curves else np.empty((0, 2, 3))
        points = self._ends.reshape(-1, 3)
        self._vertices = find_clusters(points, tolerance).reshape(-1, 2).tolist()
        self._parents: dict[int, int] = {}
        self._open: dict[tuple[int, int], list[int]] = defaultdict(list)
        self._largest_gap = 0.0
        self.joined = Joined(points, [], [])
        for number, own in enumerate(rows):
            self._link_ends(number, own)
        for number, (loops, own) in enumerate(zip(faces, rows, strict=True)):
            uses: list[list[EdgeUse]] = []
            if number not in self.faults:
                face = -1 if has_seams[number] else number
                uses = [self._join_loop(*pair, face) for pair in zip(loops, own, strict=True)]
            if not all(uses):
                self.faults[number] = "a loop is one point"
                uses = []
            self.joined.loops.append(uses)

    def _add_row(self, side: Side) -> int:
        """The number of the curve of a side; −1 for a pole."""
        if side.curve is None:
            return -1
        self._curves.append(side.curve)
        return len(self._curves) - 1

    def _link_ends(self, number: int, loops: Sequence[Sequence[int]]) -> None:
        """Make one vertex of the end of each side of a face and the start of the next one."""
        pairs = []
        for loop in loops:
            rows = [row for row in loop if row >= 0]
            size = max((self._sizes[row] for row in rows), default=0.0)
            for first, second in zip(rows, [*rows[1:], *rows[:1]], strict=True):
                pairs.append((self._vertices[first][1], self._vertices[second][0]))
                gap = np.linalg.norm(self._ends[first, 1] - self._ends[second, 0])
                if not gap <= MAX_GAP * size:
                    self.faults[number] = "a loop is open"
                    return
                self._largest_gap = max(self._largest_gap, float(gap))
        for first, second in pairs:
            a, b = sorted((self._find(first), self._find(second)))
            self._parents[b] = a

    def _find(self, vertex: int) -> int:
        """The vertex that stands for a vertex."""
        while (parent := self._parents.get(vertex, vertex)) != vertex:
            above = self._parents.get(parent, parent)
            self._parents[vertex] = above
            vertex = above
        return vertex

    def _join_loop(self, loop: Sequence[Side], rows: Sequence[int], face: int) -> list[EdgeUse]:
        """The uses of edges of a loop; none if the loop is one point."""
        uses: list[EdgeUse] = []
        first = next((row for row in rows if row >= 0), None)
        if first is None:
            return uses
        vertex = self._find(self._vertices[first][0])
        has_edge = False
        for side, row in zip(loop, rows, strict=True):
            if row < 0:
                uses.append(EdgeUse(-1, False, side.pcurve, vertex))
                continue
            start, vertex = map(self._find, self._vertices[row])
            if start == vertex and self._sizes[row] <= SHORT * self._tolerance:
                continue
            uses.append(self._join_side(side, row, (start, vertex), face))
            has_edge = True
        return uses if has_edge else []

    def _join_side(self, side: Side, row: int, ends: tuple[int, int], face: int) -> EdgeUse:
        """The use of an edge that has one side so far, or of a new edge."""
        edges = self.joined.edges
        new = JoinedEdge(self._curves[row], ends, side.deviation, face)
        found = self._find_edge(new, self._tolerance)
        if found is not None:
            edge, is_opposite, distance = found
            self._share(edge, max(distance, side.deviation))
            return _turn(EdgeUse(edge, False, side.pcurve), edge, is_opposite)
        self._open[min(ends), max(ends)].append(len(edges))
        edges.append(new)
        return EdgeUse(len(edges) - 1, False, side.pcurve)

    def _find_edge(self, new: JoinedEdge, tolerance: float) -> tuple[int, bool, float] | None:
        """The edge with one side along a new one, whether it runs against it, and how far away."""
        start, end = map(self._find, new.vertices)
        for edge in self._open[min(start, end), max(start, end)][-MOST_TRIED:]:
            known = self.joined.edges[edge]
            if known.face == new.face >= 0:
                continue
            is_opposite = self._find(known.vertices[0]) != start
            if start == end:
                is_opposite = are_opposite(known.curve, new.curve)
            distance = bound_distance(known.curve, new.curve, is_opposite, tolerance)
            if distance <= tolerance:
                return edge, is_opposite, distance
        return None

    def _share(self, edge: int, distance: float) -> None:
        """Note that an edge has a second side, at a distance."""
        known = self.joined.edges[edge]
        start, end = map(self._find, known.vertices)
        bucket = self._open[min(start, end), max(start, end)]
        tried = bucket[-MOST_TRIED:]
        del bucket[tried.index(edge) - len(tried)]
        largest = max(known.distance, distance)
        self.joined.edges[edge] = replace(known, distance=largest, is_shared=True)

    def join_rest(self, most: float) -> None:
        """Join sides that are still alone, up to twice the largest gap in a loop."""
        tolerance = min(2.0 * self._largest_gap, most)
        edges = self.joined.edges
        alone = [
            number
            for number, edge in enumerate(edges)
            if not edge.is_shared and measure_size(edge.curve) > SHORT * tolerance
        ]
        if tolerance <= self._tolerance or len(alone) < 2:
            return
        ends = [self._find(vertex) for number in alone for vertex in edges[number].vertices]
        clusters = find_clusters(self.joined.points[ends], tolerance).tolist()
        for vertex, cluster in zip(ends, clusters, strict=True):
            a, b = sorted((self._find(vertex), self._find(ends[cluster])))
            self._parents[b] = a
        self._open = defaultdict(list)
        replaced: dict[int, tuple[int, bool]] = {}
        for number in alone:
            found = self._find_edge(edges[number], tolerance)
            if found is None:
                start, end = map(self._find, edges[number].vertices)
                self._open[min(start, end), max(start, end)].append(number)
            else:
                edge, is_opposite, distance = found
                self._share(edge, max(distance, edges[number].distance))
                replaced[number] = edge, is_opposite
        self._replace(replaced)

    def join_rings(self) -> None:
        """Join closed sides that begin at different points, if one of them is alone in its loop."""
        edges = self.joined.edges
        loops = [loop for face in self.joined.loops for loop in face]
        alone = {loop[0].edge for loop in loops if len(loop) == 1}
        rings = [
            number
            for number, edge in enumerate(edges)
            if not edge.is_shared and self._find(edge.vertices[0]) == self._find(edge.vertices[1])
        ]
        movable = [number in alone for number in rings]
        replaced: dict[int, tuple[int, bool]] = {}
        for match in match_rings([edges[n].curve for n in rings], movable, self._tolerance):
            moved, kept = rings[match.moved], rings[match.kept]
            replaced[moved] = kept, match.is_opposite
            distance = max(edges[kept].distance, edges[moved].distance, match.distance)
            edges[kept] = replace(edges[kept], distance=distance, is_shared=True)
        for loop in loops:
            if loop[0].edge in replaced:
                # Its curve of parameters begins elsewhere.
                loop[0] = replace(_turn(loop[0], *replaced[loop[0].edge]), pcurve=None)

    def _replace(self, replaced: Mapping[int, tuple[int, bool]]) -> None:
        """Use edges in place of others, and vertices in place of those that are one now."""
        edges = self.joined.edges
        for number, known in enumerate(edges):
            first, last = map(self._find, known.vertices)
            edges[number] = replace(known, vertices=(first, last))
        for loop in (loop for loops in self.joined.loops for loop in loops):
            for position, use in enumerate(loop):
                if use.edge in replaced:
                    loop[position] = _turn(use, *replaced[use.edge])
                elif use.edge < 0:
                    loop[position] = replace(use, vertex=self._find(use.vertex))


def _turn(use: EdgeUse, edge: int, is_opposite: bool) -> EdgeUse:
    """The use of an edge in place of another one, which may run in the opposite direction."""
    if not is_opposite:
        return replace(use, edge=edge)
    pcurve = None if use.pcurve is None else reverse(use.pcurve)
    return EdgeUse(edge, not use.is_reversed, pcurve)
