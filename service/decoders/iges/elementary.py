"""Planes, cylinders, cones, spheres and tori, and surfaces at a distance from them.

References
----------
IGES 5.3, sections 4.10 (108), 4.31 (140), 4.44 to 4.49 (190 to 198).
"""

from math import radians

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.elementary import Cone, Cylinder, Elementary, Plane, Sphere, Torus
from service.decoders.cad.frames import Frame, Vector, build_frame, dot
from service.decoders.iges.entities import Entity, IgesFile
from service.decoders.iges.faults import Fault, Unsupported
from service.decoders.iges.transformations import Transformations

ELEMENTARY = frozenset({108, 190, 192, 194, 196, 198})


class ElementaryReader:
    """Reads elementary surfaces."""

    def __init__(self, file: IgesFile, transformations: Transformations) -> None:
        self._file = file
        self._transformations = transformations

    def read(self, entity: Entity) -> Elementary:
        """The surface of an entity, without its own matrix."""
        parameters = entity.parameters
        match entity.type:
            case 108:
                normal = parameters.numbers(0, 3)
                square = float(normal @ normal)
                if not square > 0:
                    raise Fault("a plane has no normal")
                origin = to_vector(normal * (parameters.number(3, 0.0) / square))
                return Plane(build_frame(origin, to_vector(normal)))
            case 190:
                return Plane(self._read_frame(entity, 0, 1, 2))
            case 192:
                return Cylinder(self._read_frame(entity, 0, 1, 3), parameters.number(2))
            case 194:
                frame = self._read_frame(entity, 0, 1, 4)
                return Cone(frame, parameters.number(2), radians(parameters.number(3)))
            case 196:
                return Sphere(self._read_frame(entity, 0, 2, 3), parameters.number(1))
            case _:
                frame = self._read_frame(entity, 0, 1, 4)
                return Torus(frame, parameters.number(2), parameters.number(3))

    def _read_frame(self, entity: Entity, origin: int, axis: int, reference: int) -> Frame:
        """A frame of the entities at three positions: a point, and directions along z and x."""
        parameters = entity.parameters
        return build_frame(
            self._read_point(parameters.pointer(origin)),
            self._read_direction(parameters.pointer(axis)),
            self._read_direction(parameters.pointer(reference)) if entity.form == 1 else None,
        )

    def _read_point(self, number: int) -> Vector:
        """A point (116)."""
        entity = self._file.read(number, 116)
        point = np.append(entity.parameters.numbers(0, 3), 1.0)
        matrix = self._transformations.find(entity.matrix)
        return to_vector(point if matrix is None else matrix @ point)

    def _read_direction(self, number: int) -> Vector | None:
        if not number:
            return None
        entity = self._file.read(number, 123)
        direction = np.append(entity.parameters.numbers(0, 3), 0.0)
        matrix = self._transformations.find(entity.matrix)
        return to_vector(direction if matrix is None else matrix @ direction)

    def read_offset(self, entity: Entity) -> tuple[Elementary, int]:
        """The surface at a distance from another one, on the side of a vector (140).

        Returns
        -------
        surface : Elementary
            Without the matrix of the offset surface.
        matrix : int
            The entry of the matrix of the other surface.
        """
        parameters = entity.parameters
        base = self._file.read(parameters.pointer(4))
        if base.type not in ELEMENTARY:
            raise Unsupported(f"an offset of a surface of type {base.type} is not read")
        shape = self.read(base)
        side = to_vector(parameters.numbers(0, 3))
        if isinstance(shape, Plane):
            outwards = dot(side, shape.frame.z)
        elif base.form == 1:
            # In the middle of the parameters, 0 to 360 degrees, the normal is opposite to x.
            outwards = -dot(side, shape.frame.x)
        else:
            raise Unsupported("an offset of a surface without parameters is not read")
        distance = parameters.number(3)
        return shape.offset(distance if outwards > 0 else -distance), base.matrix


def to_vector(values: FloatArray) -> Vector:
    """The first three of some numbers."""
    x, y, z = values[:3].tolist()
    return x, y, z
