"""Curves: lines, conics, splines, polylines, trimmed and composite curves.

References
----------
ISO 10303-42, clause 4.4: curve and its subtypes.
"""

from typing import NamedTuple

import numpy as np

from service.decoders.cad.conics import (
    BasisCurve,
    Ellipse,
    Hyperbola,
    Line,
    Parabola,
    build_polyline,
)
from service.decoders.cad.content import Curve
from service.decoders.cad.frames import Vector, scale, unit
from service.decoders.cad.inversion import find_parameters
from service.decoders.cad.profiles import cut_basis
from service.decoders.cad.splines import find_domain, find_ends, join, reverse, segment, transform
from service.decoders.step.entities import Entities, Entity, unsupported
from service.decoders.step.faults import Fault
from service.decoders.step.placements import read_direction, read_frame, read_matrix, read_point
from service.decoders.step.records import (
    MAX_NESTING,
    Parameter,
    Typed,
    as_enumeration,
    as_flag,
    as_list,
    as_number,
    as_reference,
    as_references,
)
from service.decoders.step.splines import is_spline, read_spline_curve

SURFACE_CURVES = ("SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE", "BOUNDED_SURFACE_CURVE")
CONICS = ("CIRCLE", "ELLIPSE", "PARABOLA", "HYPERBOLA")
COMPOSITES = (
    "COMPOSITE_CURVE",
    "COMPOSITE_CURVE_ON_SURFACE",
    "BOUNDARY_CURVE",
    "OUTER_BOUNDARY_CURVE",
)

MEETING = 1e-3
"""Segments of a composite curve may be apart by this share of its size; the joint is in the
middle."""


class Directed(NamedTuple):
    """A curve, and whether it runs in the direction of the entity that was asked for."""

    curve: BasisCurve
    same_sense: bool = True


class CurveReader:
    """Reads the curves of representations with one unit of angles.

    All but lines are kept, because several edges and surfaces may refer to one curve. `level` is
    how many curves refer to each other: curves that refer to themselves end at `MAX_NESTING`.
    """

    def __init__(self, entities: Entities, radians: float) -> None:
        self._entities = entities
        self._radians = radians
        self._known: dict[int, Directed] = {}
        self._pieces: dict[int, BasisCurve] = {}

    def read(self, number: int, level: int = 0) -> Directed:
        """The curve that an edge lies on: of a trimmed curve that without ends.

        Raises
        ------
        InvalidGeometry
        """
        found = self._known.get(number)
        if found is not None:
            if isinstance(found.curve, Curve):
                self._entities.budget.charge_look(len(found.curve.points))
            return found
        entity = self._read_entity(number, level)
        if entity.keyword in SURFACE_CURVES:
            return self.read(as_reference(entity.parameter(1)), level + 1)
        if entity.keyword == "TRIMMED_CURVE":
            basis, same_sense = self.read(as_reference(entity.parameter(1)), level + 1)
            found = Directed(basis, same_sense == as_flag(entity.parameter(4)))
        else:
            found = Directed(self._read_curve(entity, level))
        if not isinstance(found.curve, Line):
            self._known[number] = found
        return found

    def read_piece(self, number: int, level: int = 0) -> BasisCurve:
        """A curve with its ends, if it has ends: what is swept, or a segment of another curve.

        Raises
        ------
        InvalidGeometry
        """
        if number in self._pieces:
            return self._pieces[number]
        entity = self._read_entity(number, level)
        if entity.keyword in SURFACE_CURVES:
            return self.read_piece(as_reference(entity.parameter(1)), level + 1)
        if entity.keyword == "TRIMMED_CURVE":
            curve: BasisCurve = self._trim(entity, level)
        else:
            curve = self._read_curve(entity, level)
        self._pieces[number] = curve
        return curve

    def _read_entity(self, number: int, level: int) -> Entity:
        if level == MAX_NESTING:
            raise Fault("curves refer to curves too deeply")
        return self._entities.read(number)

    def _read_curve(self, entity: Entity, level: int) -> BasisCurve:
        entities, keyword = self._entities, entity.keyword
        if is_spline(entity, "CURVE"):
            return self._count(read_spline_curve(entities, entity))
        if keyword == "LINE":
            origin = read_point(entities, entity.parameter(1))
            return Line(origin, read_vector(entities, entity.parameter(2)))
        if keyword in CONICS:
            return self._read_conic(entity)
        if keyword == "POLYLINE":
            points = entities.points(as_references(entity.parameter(1)))
            return self._count(build_polyline([(x, y, z) for x, y, z in points.tolist()]))
        if keyword in COMPOSITES:
            return self._read_composite(entity, level)
        if keyword == "CURVE_REPLICA":
            curve = self._read_bounded(as_reference(entity.parameter(1)), level + 1)
            return transform(curve, read_matrix(entities, as_reference(entity.parameter(2))))
        raise unsupported(entity, "a curve")

    def _count(self, curve: Curve) -> Curve:
        self._entities.budget.charge_look(len(curve.points))
        return curve

    def _read_bounded(self, number: int, level: int) -> Curve:
        """A curve with its ends, as a spline."""
        return self._count(cut_basis(self.read_piece(number, level), None))

    def _read_conic(self, entity: Entity) -> BasisCurve:
        frame = read_frame(self._entities, as_reference(entity.parameter(1)))
        first = as_number(entity.parameter(2))
        if entity.keyword == "CIRCLE":
            return Ellipse(frame, first, first)
        if entity.keyword == "PARABOLA":
            return Parabola(frame, first)
        second = as_number(entity.parameter(3))
        if entity.keyword == "ELLIPSE":
            return Ellipse(frame, first, second)
        return Hyperbola(frame, first, second)

    def _read_composite(self, entity: Entity, level: int) -> Curve:
        curves: list[Curve] = []
        for number in as_references(entity.parameter(1)):
            # transition, same_sense, parent_curve; a reparametrised segment has a length, too
            segment_ = self._entities.read(number)
            curve = self._read_bounded(as_reference(segment_.parameter(2)), level + 1)
            curves.append(curve if as_flag(segment_.parameter(1)) else reverse(curve))
        size = max((float(np.abs(curve.points).max()) for curve in curves), default=0.0)
        return join(curves, MEETING * size)

    def _trim(self, entity: Entity, level: int) -> Curve:
        """A trimmed curve: its ends are given by points or by parameters, or by both."""
        basis = self.read_piece(as_reference(entity.parameter(1)), level + 1)
        prefers_points = as_enumeration(entity.parameter(5)) == "CARTESIAN"
        first, last = (self._find_end(basis, entity.parameter(k), prefers_points) for k in (2, 3))
        same_sense = as_flag(entity.parameter(4))
        if not same_sense:
            first, last = last, first
        curve = _cut(basis, first, last)
        return curve if same_sense else reverse(curve)

    def _find_end(self, basis: BasisCurve, trims: Parameter, prefers_points: bool) -> float:
        """The parameter of one end."""
        found: dict[bool, Parameter] = {
            isinstance(trim, Typed): trim for trim in as_list(trims) if trim != "$"
        }
        is_parameter = True in found and not (prefers_points and False in found)
        if is_parameter:
            factor = self._radians if isinstance(basis, Ellipse) else 1.0
            return as_number(found[True]) * factor
        if not found:
            raise Fault("the end of a trimmed curve is missing")
        point = read_point(self._entities, found[False])
        if isinstance(basis, Curve):
            return float(find_parameters(basis, np.array([point]))[0][0])
        return basis.find_parameter(point)


def read_vector(entities: Entities, parameter: Parameter) -> Vector:
    """A VECTOR: its direction, of length 1, times its magnitude."""
    entity = entities.read_as(as_reference(parameter), "VECTOR")
    direction = read_direction(entities, entity.parameter(1))
    if direction is None:
        raise Fault("a direction has no length")
    return scale(unit(direction), as_number(entity.parameter(2)))


def _cut(basis: BasisCurve, first: float, last: float) -> Curve:
    """The piece of a curve forwards from one parameter to another, over its seam too."""
    if not isinstance(basis, Curve):
        if isinstance(basis, Ellipse) or first < last:
            return basis.cut(first, last)
        return reverse(basis.cut(last, first))
    if first < last:
        return segment(basis, first, last)
    low, high = find_domain(basis)
    ends = find_ends(basis)
    if not np.abs(ends[1] - ends[0]).max() <= MEETING * np.abs(basis.points[:, :3]).max():
        raise Fault("the ends of a trimmed curve are in the wrong order")
    pieces = [
        segment(basis, *range_) for range_ in ((first, high), (low, last)) if range_[0] < range_[1]
    ]
    return join(pieces, float(np.abs(basis.points[:, :3]).max()) * MEETING)
