"""Surfaces: planes, cylinders, cones, spheres, tori, swept ones, splines, offsets and copies.

References
----------
ISO 10303-42, clause 4.4: surface and its subtypes.
"""

from dataclasses import replace
from typing import NamedTuple, TypeAlias

from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.elementary import Cone, Cylinder, Elementary, Plane, Sphere, Torus
from service.decoders.cad.frames import Frame, transform_frame
from service.decoders.cad.outline import Outline
from service.decoders.cad.splines import transform
from service.decoders.cad.swept import Extrusion, Revolution
from service.decoders.step.curves import CurveReader, read_vector
from service.decoders.step.entities import Entities, Entity, unsupported
from service.decoders.step.faults import Fault
from service.decoders.step.placements import read_frame, read_matrix
from service.decoders.step.records import MAX_NESTING, as_flag, as_number, as_reference
from service.decoders.step.splines import is_spline, read_spline_surface

Shape: TypeAlias = Surface | Elementary | Extrusion | Revolution

ELEMENTARY = (
    "PLANE",
    "CYLINDRICAL_SURFACE",
    "CONICAL_SURFACE",
    "SPHERICAL_SURFACE",
    "TOROIDAL_SURFACE",
    "DEGENERATE_TOROIDAL_SURFACE",
)
SWEPT = ("SURFACE_OF_LINEAR_EXTRUSION", "SURFACE_OF_REVOLUTION")

LEAST_ANGLE = 1e-9
"""A cone with a smaller angle is a cylinder."""


class Oriented(NamedTuple):
    """A surface, and how it is related to the entity that was asked for.

    Attributes
    ----------
    shape : Surface, Elementary, Extrusion or Revolution
    same_sense : bool
        Whether its normal is that of the entity.
    number : int or None
        The number of the entity, if the spline that `cut` returns has the entity's parameters.
    """

    shape: Shape
    same_sense: bool = True
    number: int | None = None

    def cut(self, outline: Outline) -> Surface:
        """The surface as a spline; one that is no spline is cut to an outline."""
        return self.shape if isinstance(self.shape, Surface) else self.shape.cut(outline)


class SurfaceReader:
    """Reads the surfaces of representations with one unit of angles; splines are kept."""

    def __init__(self, entities: Entities, radians: float, curves: CurveReader) -> None:
        self._entities = entities
        self._radians = radians
        self._curves = curves
        self._known: dict[int, Oriented] = {}

    def read(self, number: int, level: int = 0) -> Oriented:
        """The surface with a number.

        Raises
        ------
        InvalidGeometry
        """
        found = self._known.get(number)
        if found is None:
            if level == MAX_NESTING:
                raise Fault("surfaces refer to surfaces too deeply")
            found = self._read(self._entities.read(number), level)
            self._known[number] = found
        return found

    def _read(self, entity: Entity, level: int) -> Oriented:
        keyword = entity.keyword
        if keyword in ("RECTANGULAR_TRIMMED_SURFACE", "CURVE_BOUNDED_SURFACE"):
            return self._read_bounded(entity, level)
        if keyword == "OFFSET_SURFACE":
            return self._offset(entity, level)
        if keyword == "SURFACE_REPLICA":
            return self._replicate(entity, level)
        shape = self._read_shape(entity)
        base = shape.curve if isinstance(shape, Extrusion) else shape
        keeps_parameters = isinstance(base, Surface | Curve)
        return Oriented(shape, number=entity.number if keeps_parameters else None)

    def _read_shape(self, entity: Entity) -> Shape:
        """A surface that refers to no other surface."""
        keyword = entity.keyword
        if is_spline(entity, "SURFACE"):
            return read_spline_surface(self._entities, entity)
        if keyword not in SWEPT:
            return self._read_elementary(entity)
        curve = self._curves.read_piece(as_reference(entity.parameter(1)))
        if keyword == "SURFACE_OF_LINEAR_EXTRUSION":
            return Extrusion(curve, read_vector(self._entities, entity.parameter(2)))
        axis = read_frame(self._entities, as_reference(entity.parameter(2)))
        return Revolution(curve, axis.origin, axis.z)

    def _read_bounded(self, entity: Entity, level: int) -> Oriented:
        """The surface of which a bounded one is a part, because a face has bounds of its own."""
        shape, same_sense, _ = self.read(as_reference(entity.parameter(1)), level + 1)
        if entity.keyword == "RECTANGULAR_TRIMMED_SURFACE":
            same_sense ^= as_flag(entity.parameter(6)) != as_flag(entity.parameter(7))
        return Oriented(shape, same_sense)

    def _read_elementary(self, entity: Entity) -> Elementary:
        keyword = entity.keyword
        if keyword not in ELEMENTARY:
            raise unsupported(entity, "a surface")
        frame = read_frame(self._entities, as_reference(entity.parameter(1)))
        if keyword == "PLANE":
            return Plane(frame)
        radius = as_number(entity.parameter(2))
        if keyword == "CYLINDRICAL_SURFACE":
            return Cylinder(frame, radius)
        if keyword == "SPHERICAL_SURFACE":
            return Sphere(frame, radius)
        second = as_number(entity.parameter(3))
        if keyword == "CONICAL_SURFACE":
            angle = second * self._radians
            return (
                Cylinder(frame, radius) if abs(angle) < LEAST_ANGLE else Cone(frame, radius, angle)
            )
        is_outer = as_flag(entity.parameter(4)) if keyword.startswith("DEGENERATE") else None
        return Torus(frame, radius, second, is_outer)

    def _offset(self, entity: Entity, level: int) -> Oriented:
        """The offset of a plane or of a curved elementary surface: one of the same kind."""
        shape, same_sense, _ = self.read(as_reference(entity.parameter(1)), level + 1)
        distance = as_number(entity.parameter(2))
        if isinstance(shape, Surface | Extrusion | Revolution):
            kind = "spline" if isinstance(shape, Surface) else "swept"
            raise Fault(f"its surface is an offset of a {kind} surface")
        return Oriented(shape.offset(distance if same_sense else -distance), same_sense)

    def _replicate(self, entity: Entity, level: int) -> Oriented:
        shape, same_sense, _ = self.read(as_reference(entity.parameter(1)), level + 1)
        matrix = read_matrix(self._entities, as_reference(entity.parameter(2)))
        if isinstance(shape, Surface):
            return Oriented(transform(shape, matrix), same_sense)
        if isinstance(shape, Extrusion | Revolution):
            raise Fault("the replica of a swept surface is not read")
        frame: Frame | None = transform_frame(shape.frame, matrix)
        if frame is None:
            raise Fault(
                "the replica of an elementary surface that is scaled or mirrored is not read"
            )
        return Oriented(replace(shape, frame=frame), same_sense)
