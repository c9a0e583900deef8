"""Curves of a file as splines in space.

References
----------
IGES 5.3, sections 4.4 (102) and 4.7 (106).
"""

from contextlib import suppress

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import build_polyline
from service.decoders.cad.content import Curve
from service.decoders.cad.splines import build_curve, transform
from service.decoders.iges.arcs import read_arc, read_line
from service.decoders.iges.budget import Budget
from service.decoders.iges.conic_arcs import read_conic_arc
from service.decoders.iges.entities import MAX_NESTING, Entity, IgesFile
from service.decoders.iges.faults import Fault, OnePoint, Unsupported
from service.decoders.iges.offset_curves import read_offset
from service.decoders.iges.power_splines import read_power_curve
from service.decoders.iges.rational_splines import read_rational_curve
from service.decoders.iges.transformations import Transformations

POINTS = frozenset({116, 132})
"""Types of points, which may stand between the curves of a composite curve."""

_POLYLINES = frozenset({1, 2, 3, 11, 12, 13, 63})
_CLOSED = 63


class CurveReader:
    """Reads curves; each is charged to the budget of control points."""

    def __init__(self, file: IgesFile, transformations: Transformations, budget: Budget) -> None:
        self._file = file
        self._transformations = transformations
        self._budget = budget

    def read(self, number: int) -> list[Curve]:
        """The curves of an entity, end to end: several of a composite curve.

        Raises
        ------
        Fault, InvalidGeometry
            The entity is no curve, it is damaged, or nested too deeply.
        """
        return self._read(number, 0)

    def read_one(self, number: int) -> Curve:
        """The curve of an entity that is no composite curve, or has one part only."""
        curves = self.read(number)
        if len(curves) != 1:
            raise Unsupported("a composite curve stands where one curve is needed")
        return curves[0]

    def _read(self, number: int, depth: int) -> list[Curve]:
        entity = self._file.read(number)
        self._budget.visit()
        if entity.type == 102:
            curves = self._read_parts(entity, depth)
        else:
            curves = [self._read_basic(entity)]
        matrix = self._transformations.find(entity.matrix)
        return curves if matrix is None else [transform(curve, matrix) for curve in curves]

    def _read_parts(self, entity: Entity, depth: int) -> list[Curve]:
        if depth == MAX_NESTING:
            raise Fault("composite curves are nested too deeply")
        parameters = entity.parameters
        parts = parameters.pointers(1, parameters.count(0))
        curves: list[Curve] = []
        for part in parts:
            if self._file.type(part) not in POINTS:
                with suppress(OnePoint):
                    curves += self._read(part, depth + 1)
        if not curves:
            raise OnePoint("a composite curve has no parts with a length")
        return curves

    def _read_basic(self, entity: Entity) -> Curve:
        match entity.type:
            case 100:
                curve = read_arc(entity)
            case 104:
                curve = read_conic_arc(entity)
            case 106:
                curve = _read_polyline(entity)
            case 110:
                curve = read_line(entity)
            case 112:
                curve = read_power_curve(entity)
            case 126:
                curve = read_rational_curve(entity)
            case 130:
                base = self._file.read(entity.parameters.pointer(0))
                curve = read_offset(entity, base, self._transformations.find(base.matrix))
            case kind:
                raise Unsupported(f"a curve of type {kind} is not read")
        self._budget.spend(len(curve.points))
        return curve


def _read_polyline(entity: Entity) -> Curve:
    """Points joined by lines; the parameter of a point is its number, from 0."""
    if entity.form not in _POLYLINES:
        raise Unsupported(f"copious data of form {entity.form} are not a curve")
    points = _read_points(entity)
    if entity.form == _CLOSED and (points[0] != points[-1]).any():
        points = np.concatenate([points, points[:1]])
    if (points[1:] == points[:-1]).all(axis=1).any():
        return build_polyline([(x, y, z) for x, y, z in points.tolist()])
    numbers = np.arange(len(points), dtype=np.float64)
    return build_curve(1, np.concatenate([numbers[:1], numbers, numbers[-1:]]), points)


def _read_points(entity: Entity) -> FloatArray:
    """The points of copious data: pairs with one z, triples, or triples with vectors."""
    parameters = entity.parameters
    kind = parameters.integer(0)
    if kind == 1:
        count = parameters.count(1, 2)
        points = np.full((count, 3), parameters.number(2))
        points[:, :2] = parameters.numbers(3, 2 * count).reshape(count, 2)
    else:
        size = 6 if kind == 3 else 3
        count = parameters.count(1, size)
        points = parameters.numbers(2, size * count).reshape(count, size)[:, :3]
    if count < 2:
        raise Fault("a polyline has fewer than two points")
    return points
