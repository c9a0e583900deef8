"""Surfaces of a file: splines, swept surfaces as splines, and elementary surfaces.

A spline keeps the parameters of the file, so that the file's parameter curves fit it, with one
exception: along circles and other conics the file's parameter is an angle, and that of the spline
only near it between knots.

References
----------
IGES 5.3, sections 4.16 (114), 4.17 (118), 4.19 (120), 4.20 (122) and 4.24 (128).
"""

from dataclasses import dataclass, replace
from math import tau
from typing import TypeAlias

import numpy as np

from service.bases.arrays import AnyArray, FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.elementary import Elementary, Sphere, Torus, find_gap
from service.decoders.cad.outline import Outline
from service.decoders.cad.splines import (
    find_domain,
    join,
    project_points,
    reverse,
    swap_axes,
    transform,
)
from service.decoders.cad.swept import Extrusion, Revolution, rule
from service.decoders.iges.budget import Budget
from service.decoders.iges.curves import CurveReader
from service.decoders.iges.elementary import ELEMENTARY, ElementaryReader, to_vector
from service.decoders.iges.entities import Entity, IgesFile
from service.decoders.iges.faults import Unsupported
from service.decoders.iges.parameters import ParameterMap
from service.decoders.iges.power_splines import read_power_surface
from service.decoders.iges.rational_splines import read_rational_surface
from service.decoders.iges.transformations import Transformations, combine

SPLINES = frozenset({114, 118, 120, 122, 128})
TYPES = ELEMENTARY | SPLINES | {140}
"""Types of surfaces."""

Scales: TypeAlias = tuple[float | None, float | None]

SAME = 1e-9
"""Knots of normalized curves that differ by at most this are equal."""

JOINT = 1e-4
"""The curves of a composite curve may be this far apart, as a share of its size."""


@dataclass(frozen=True, eq=False, slots=True)
class BaseSurface:
    """The surface of a face, before it is cut.

    Attributes
    ----------
    shape : Surface or Elementary
        An elementary surface has no ends.
    matrix : ndarray of float64, shape (4, 4), or None
        Applies to the shape.
    parameters : ParameterMap or None
        The parameters of the file; None for elementary surfaces, on which the file's parameter
        curves are not read.
    """

    shape: Surface | Elementary
    matrix: FloatArray | None = None
    parameters: ParameterMap | None = None

    @property
    def is_bounded(self) -> bool:
        """Whether the surface is a face by itself, without loops."""
        return isinstance(self.shape, Surface | Sphere | Torus)

    def cut(self, outline: Outline) -> Surface:
        """The surface as a spline; an elementary one is cut to the outline of its face."""
        shape, matrix = self.shape, self.matrix
        if not isinstance(shape, Surface):
            shape = shape.cut(self._move_back(outline))
        return shape if matrix is None else transform(shape, matrix)

    def find_gap(self, outline: Outline) -> float:
        """The largest distance of edges from an elementary surface; 0 for other surfaces."""
        if isinstance(self.shape, Surface) or not outline:
            return 0.0
        gap = find_gap(self.shape, self._move_back(outline))
        # A matrix that scales makes the gap longer or shorter.
        return gap if self.matrix is None else gap * float(np.linalg.norm(self.matrix[:3, 0]))

    def _move_back(self, outline: Outline) -> Outline:
        """An outline in the coordinates of the shape."""
        if self.matrix is None or not outline:
            return outline
        back = np.linalg.inv(self.matrix)
        middles = outline.middles
        return replace(
            outline,
            hull=_move(outline.hull, back),
            ends=_move(outline.ends, back),
            middles=None if middles is None else _move(middles, back),
        )


class SurfaceReader:
    """Reads surfaces; each is charged to the budget of control points."""

    def __init__(
        self,
        file: IgesFile,
        transformations: Transformations,
        curves: CurveReader,
        budget: Budget,
    ) -> None:
        self._file = file
        self._transformations = transformations
        self._elementary = ElementaryReader(file, transformations)
        self._curves = curves
        self._budget = budget

    def read(self, number: int) -> BaseSurface:
        """The surface of an entity, where its own matrix puts it.

        Raises
        ------
        Fault, InvalidGeometry
            The entity is no surface, it is damaged, or of a kind that is not read.
        """
        entity = self._file.read(number)
        matrix = self._transformations.find(entity.matrix)
        if entity.type in ELEMENTARY:
            return BaseSurface(self._elementary.read(entity), matrix)
        if entity.type == 140:
            shape, own = self._elementary.read_offset(entity)
            return BaseSurface(shape, combine(matrix, self._transformations.find(own)))
        surface, scales = self._read_spline(entity)
        self._budget.spend(surface.points.size // 4)
        return BaseSurface(surface, matrix, ParameterMap(scales))

    def _read_spline(self, entity: Entity) -> tuple[Surface, Scales]:
        match entity.type:
            case 114:
                return read_power_surface(entity), (0.0, 0.0)
            case 118:
                return self._read_ruled(entity)
            case 120:
                return self._read_revolution(entity)
            case 122:
                return self._read_cylinder(entity)
            case 128:
                return read_rational_surface(entity), (0.0, 0.0)
            case kind:
                raise Unsupported(f"a surface of type {kind} is not read")

    def _read_profile(self, number: int) -> tuple[Curve, float | None]:
        """The curve of a swept surface, and the scale of its parameter (`ParameterMap`).

        A composite curve becomes one curve.
        """
        curves = self._curves.read(number)
        kinds = {self._file.type(part) for part in self._parts(number)}
        scale = 1.0 if kinds == {100} else None if kinds & {100, 102, 104} else 0.0
        if len(curves) == 1:
            return curves[0], scale
        points = project_points(np.concatenate([curve.points for curve in curves]))
        return join(curves, JOINT * float(np.ptp(points, axis=0).max())), scale

    def _read_revolution(self, entity: Entity) -> tuple[Surface, Scales]:
        """The surface (curve, angle) of revolution."""
        parameters = entity.parameters
        axis = self._curves.read_one(parameters.pointer(0))
        curve, scale = self._read_profile(parameters.pointer(1))
        first, last = parameters.number(2, 0.0), parameters.number(3, tau)
        start, end = project_points(axis.points[[0, -1]])
        revolution = Revolution(curve, to_vector(start), to_vector(end - start))
        return swap_axes(revolution.trim((first, last), None)), (scale, 1.0)

    def _read_cylinder(self, entity: Entity) -> tuple[Surface, Scales]:
        """A tabulated cylinder: a curve that moves along a line; both parameters are 0 to 1."""
        parameters = entity.parameters
        own, scale = self._read_profile(parameters.pointer(0))
        low, high = find_domain(own)
        knots = (own.knots - low) / (high - low)
        knots[own.knots == high] = 1.0
        curve = Curve(own.degree, knots, own.points)
        along = parameters.numbers(1, 3) - project_points(curve.points[:1])[0]
        surface = Extrusion(curve, to_vector(along)).trim(None, (0.0, 1.0))
        return surface, (scale and scale * (high - low), 0.0)

    def _read_ruled(self, entity: Entity) -> tuple[Surface, Scales]:
        """Lines between the points with equal parameters of two curves."""
        parameters = entity.parameters
        numbers = parameters.pointers(0, 2)
        profiles = [self._read_profile(number) for number in numbers]
        first, second = (curve for curve, _ in profiles)
        if parameters.integer(2, 0):
            second = reverse(second)
        if not entity.form and not all(map(self._has_constant_speed, numbers)):
            raise Unsupported("a surface that is ruled by the lengths of curves is not read")
        angles = [
            None if scale is None else scale * _measure_domain(curve) for (curve, scale) in profiles
        ]
        if angles[0] is None or angles[1] is None or abs(angles[0] - angles[1]) > SAME:
            raise Unsupported("a surface that is ruled between conics of different angles")
        surface = rule(first, second)
        # Where weights differ, the spline's second parameter is not the file's.
        weights = surface.points[..., 3]
        is_same = bool((weights[:, 0] == weights[:, 1]).all())
        return surface, (angles[0], 0.0 if is_same else None)

    def _has_constant_speed(self, number: int) -> bool:
        parts = self._parts(number)
        return len(parts) == 1 and self._file.type(parts[0]) in (100, 110)

    def _parts(self, number: int) -> list[int]:
        """The curves of a composite curve, or the curve itself."""
        entity = self._file.read(number)
        if entity.type != 102:
            return [number]
        return entity.parameters.pointers(1, entity.parameters.count(0))


def _move(points: FloatArray, matrix: AnyArray) -> FloatArray:
    """Points (k, 3) after an affine map (4, 4)."""
    moved: FloatArray = points @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def _measure_domain(curve: Curve) -> float:
    low, high = find_domain(curve)
    return high - low
