"""Loops of edges: vertices, edges and how loops run along them.

References
----------
ISO 10303-42, clause 5.4: vertex_point, edge_curve, oriented_edge, subedge, edge_loop, poly_loop,
vertex_loop.
"""

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from service.decoders.cad.chains import find_turned
from service.decoders.cad.conics import Ellipse, Line
from service.decoders.cad.content import Coedge, Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import Vector, distance
from service.decoders.cad.parts import PartBuilder
from service.decoders.cad.pieces import cut_between
from service.decoders.cad.splines import evaluate, find_domain, find_ends
from service.decoders.step.curves import SURFACE_CURVES, CurveReader
from service.decoders.step.entities import Entities, unsupported
from service.decoders.step.faults import Fault
from service.decoders.step.records import as_flag, as_reference, as_references, find_references
from service.decoders.step.splines import is_spline

MAX_ORIENTED = 8
"""The most oriented edges, or oriented faces, or subedges, that refer to each other."""

_ORIENTED_EDGE = re.compile(
    r"\s*+ORIENTED_EDGE\s*+\(\s*+'[^']*+'\s*+,\s*+[*$]\s*+,\s*+[*$]\s*+,\s*+#(\d{1,18})\s*+,"
    r"\s*+\.([TF])\.\s*+\)"
)
_EDGE_CURVE = re.compile(
    r"\s*+EDGE_CURVE\s*+\(\s*+'[^']*+'\s*+,\s*+#(\d{1,18})\s*+,\s*+#(\d{1,18})\s*+,"
    r"\s*+#(\d{1,18})\s*+,\s*+\.([TF])\.\s*+\)"
)
_VERTEX_POINT = re.compile(r"\s*+VERTEX_POINT\s*+\(\s*+'[^']*+'\s*+,\s*+#(\d{1,18})\s*+\)")


class EdgeData(NamedTuple):
    """An edge as the file has it; numbers of entities, and whether it runs along its curve."""

    first: int
    last: int
    curve: int
    same_sense: bool


class Source(NamedTuple):
    """Where an edge of the part comes from, and its ends and curve; None for a line."""

    data: EdgeData
    start: Vector
    end: Vector
    curve: Curve | None


class Loop(NamedTuple):
    """A loop of a face; one that is a single vertex has no coedges.

    Attributes
    ----------
    coedges : sequence of Coedge
    vertex : int or None
        The vertex in the part of a loop without coedges.
    """

    coedges: Sequence[Coedge]
    vertex: int | None = None


class EdgeReader:
    """Reads vertices, edges and loops of one part into its builder.

    Attributes
    ----------
    builder : PartBuilder
    curves : CurveReader
    """

    def __init__(
        self, entities: Entities, curves: CurveReader, builder: PartBuilder, tolerance: float
    ) -> None:
        self._entities = entities
        self.curves = curves
        self.builder = builder
        self._tolerance = tolerance
        self._broken: dict[int, str] = {}  # reasons of edges that cannot be read
        self._sources: dict[int, Source] = {}

    def read_loop(self, number: int) -> Loop:
        """The loop with a number, in its own direction.

        Raises
        ------
        InvalidGeometry
        """
        entity = self._entities.read(number)
        if entity.keyword == "EDGE_LOOP":
            numbers = as_references(entity.parameter(1))
            return Loop(self._turn_swapped([self._read_oriented(each) for each in numbers]))
        if entity.keyword == "POLY_LOOP":
            return Loop(self._read_polygon(as_references(entity.parameter(1))))
        if entity.keyword == "VERTEX_LOOP":
            return Loop([], self._read_vertex(as_reference(entity.parameter(1)))[0])
        raise unsupported(entity, "a loop")

    def find_source(self, edge: int) -> Source | None:
        """The source of an edge of the part; None if it is a side of a polygon, or a pole."""
        return self._sources.get(edge)

    def find_span(self, source: Source) -> tuple[float, float] | None:
        """The parameters of the ends of an edge on its curve, if the edge runs at these.

        None for arcs of circles, ellipses and hyperbolas: their curves have other parameters.
        """
        basis, same_sense = self.curves.read(source.data.curve)
        if isinstance(basis, Line):
            return basis.find_parameter(source.start), basis.find_parameter(source.end)
        if source.curve is None or not isinstance(basis, Curve):
            return None
        low, high = find_domain(source.curve)
        is_forward = same_sense == source.data.same_sense
        if source.start != source.end:
            # On an open curve there is one piece between two points, whatever the file says.
            begin = tuple(evaluate(basis, [low])[0].tolist())
            is_forward = distance(begin, source.start) <= distance(begin, source.end)
        return (low, high) if is_forward else (high, low)

    def _turn_swapped(self, coedges: list[Coedge]) -> list[Coedge]:
        """The coedges of a loop; those of edges with swapped vertices are turned around."""
        ends = [self.builder.find_ends(coedge) for coedge in coedges]
        if not ends or all(a[1] == b[0] for a, b in pairwise([*ends, ends[0]])):
            return coedges
        for number in find_turned(ends, [self._can_turn(each.edge) for each in coedges]):
            each = coedges[number]
            coedges[number] = Coedge(each.edge, not each.is_reversed, each.pcurve)
        return coedges

    def _can_turn(self, edge: int) -> bool:
        """Whether an edge is the only piece of its curve between its vertices."""
        source = self._sources.get(edge)
        if source is None:
            return False
        basis = self.curves.read(source.data.curve).curve
        if isinstance(basis, Curve):
            first, last = map(tuple, find_ends(basis).tolist())
            return distance(first, last) > self._tolerance
        return not isinstance(basis, Ellipse)

    def _read_oriented(self, number: int) -> Coedge:
        is_forward = True
        for _ in range(MAX_ORIENTED):
            match = self._entities.match(number, _ORIENTED_EDGE)
            if match is not None:
                number, same = int(match[1]), match[2] == "T"
            else:
                entity = self._entities.read(number)
                if entity.keyword != "ORIENTED_EDGE":
                    return Coedge(self._read_edge(number), not is_forward)
                number, same = as_reference(entity.parameter(3)), as_flag(entity.parameter(4))
            is_forward ^= not same
            edge = self.builder.find_edge(number)
            if edge is not None:
                self._entities.budget.charge_characters(1)
                return Coedge(edge, not is_forward)
            if self._entities.match(number, _EDGE_CURVE):
                return Coedge(self._read_edge(number), not is_forward)
        raise Fault("oriented edges refer to each other")

    def _read_edge(self, number: int) -> int:
        """The number of an edge in the part."""
        edge = self.builder.find_edge(number)
        if edge is not None:
            return edge
        if number in self._broken:
            raise Fault(self._broken[number])
        try:
            return self._add_edge(number, self._read_data(number))
        except (InvalidGeometry, ArithmeticError) as error:
            self._broken[number] = f"edge #{number}: {find_reason(error)}"
            raise Fault(self._broken[number]) from None

    def _add_edge(self, number: int, data: EdgeData) -> int:
        builder, budget = self.builder, self._entities.budget
        first, start = self._read_vertex(data.first)
        last, end = self._read_vertex(data.last)
        is_loop = start == end
        try:
            curve, same_sense = self.curves.read(data.curve)
        except InvalidGeometry:
            if is_loop and self._is_point(data.curve):
                return builder.add_pole(number, first)
            raise
        piece = cut_between(
            curve,
            start,
            end,
            same_sense=same_sense == data.same_sense,
            is_loop=is_loop,
            tolerance=self._tolerance,
        )
        budget.count_points(2 if piece.curve is None else len(piece.curve.points))
        edge = builder.add_edge(number, (first, last), piece.curve, gap=piece.gap)
        self._sources[edge] = Source(data, start, end, piece.curve)
        return edge

    def _read_data(self, number: int) -> EdgeData:
        """The attributes of an edge; a part of another edge is on the same curve."""
        match = self._entities.match(number, _EDGE_CURVE)
        if match is not None:
            return EdgeData(int(match[1]), int(match[2]), int(match[3]), match[4] == "T")
        edge = entity = self._entities.read(number)
        for _ in range(MAX_ORIENTED):
            if entity.keyword == "EDGE_CURVE":
                first, last = as_reference(edge.parameter(1)), as_reference(edge.parameter(2))
                curve, same_sense = entity.parameter(3), as_flag(entity.parameter(4))
                return EdgeData(first, last, as_reference(curve), same_sense)
            if entity.keyword != "SUBEDGE":
                break
            entity = self._entities.read(as_reference(entity.parameter(3)))
        raise unsupported(entity, "an edge")

    def _read_vertex(self, number: int) -> tuple[int, Vector]:
        """The number of a vertex in the part, and its point."""
        match = self._entities.match(number, _VERTEX_POINT)
        if match is not None:
            point = self._entities.point(int(match[1]))
        else:
            entity = self._entities.read(number)
            if entity.keyword == "CARTESIAN_POINT":
                point = self._entities.point(number)
            elif entity.keyword == "VERTEX_POINT":
                point = self._entities.point(as_reference(entity.parameter(1)))
            else:
                raise unsupported(entity, "a vertex")
        return self.builder.add_vertex(number, point), point

    def _read_polygon(self, numbers: list[int]) -> list[Coedge]:
        """The lines of a loop of points; points with equal coordinates are one vertex."""
        builder = self.builder
        points = [self._entities.point(number) for number in numbers]
        vertices = [builder.add_vertex(("point", point), point) for point in points]
        coedges = []
        for first, last in zip(vertices, [*vertices[1:], *vertices[:1]], strict=True):
            if first == last:
                continue
            key = "line", min(first, last), max(first, last)
            edge = builder.find_edge(key)
            if edge is None:
                self._entities.budget.count_points(2)
                edge = builder.add_edge(key, key[1:])
            coedges.append(Coedge(edge, first > last))
        if not coedges:
            raise Fault("the points of a loop are one point")
        return coedges

    def _is_point(self, number: int) -> bool:
        """Whether a curve is a spline all of whose control points are equal: a pole."""
        try:
            entity = self._entities.read(number)
            for _ in range(MAX_ORIENTED):
                if entity.keyword not in SURFACE_CURVES:
                    break
                entity = self._entities.read(as_reference(entity.parameter(1)))
            if not is_spline(entity, "CURVE"):
                return False
            points = self._entities.points(find_references(list(entity.parts.values())))
        except Fault:
            return False
        return len(points) > 1 and bool((points == points[0]).all())


def find_reason(error: InvalidGeometry | ArithmeticError) -> str:
    """Why an entity cannot be read."""
    return error.reason if isinstance(error, InvalidGeometry) else "its numbers are out of range"
