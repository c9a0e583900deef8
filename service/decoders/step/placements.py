"""Placements and transformations: frames and matrices, in the unit of the root.

References
----------
ISO 10303-42, clauses 4.4.14 to 4.4.17 and 4.4.20: axis placements, and
cartesian_transformation_operator_3d with its function base_axis;
ISO 10303-43, clause 4.4.10: item_defined_transformation.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.frames import (
    Frame,
    Vector,
    build_frame,
    cross,
    dot,
    scale,
)
from service.decoders.step.entities import Entities, Entity, unsupported
from service.decoders.step.faults import Fault
from service.decoders.step.records import Parameter, as_number, as_reference, is_omitted

AXES = ("AXIS2_PLACEMENT_3D", "AXIS1_PLACEMENT", "AXIS2_PLACEMENT_2D")
OPERATOR = "CARTESIAN_TRANSFORMATION_OPERATOR_3D"

SMALLEST_SCALE, LARGEST_SCALE = 1e-9, 1e9


def read_point(entities: Entities, parameter: Parameter, factor: float = 1.0) -> Vector:
    """The coordinates of a point, multiplied by a factor."""
    point = entities.point(as_reference(parameter))
    return point if factor == 1.0 else scale(point, factor)


def read_direction(entities: Entities, parameter: Parameter) -> Vector | None:
    """The ratios of a direction; None if it is omitted, or has no length."""
    if is_omitted(parameter):
        return None
    direction = entities.direction(as_reference(parameter))
    return direction if any(direction) else None


def read_frame(entities: Entities, number: int, factor: float = 1.0) -> Frame:
    """The frame of an axis placement; of AXIS1_PLACEMENT and AXIS2_PLACEMENT_2D too."""
    entity = entities.read(number)
    if entity.keyword not in AXES:
        raise unsupported(entity, "a placement")
    origin = read_point(entities, entity.parameter(1), factor)
    if entity.keyword == "AXIS2_PLACEMENT_2D":
        return build_frame(origin, None, read_direction(entities, entity.parameter(2)))
    axis = read_direction(entities, entity.parameter(2))
    has_first = entity.keyword == "AXIS2_PLACEMENT_3D" and len(entity.parameters) > 3
    first = read_direction(entities, entity.parameters[3]) if has_first else None
    return build_frame(origin, axis, first)


def read_matrix(entities: Entities, number: int, factor: float = 1.0) -> FloatArray:
    """The matrix (4, 4) of an axis placement or of a transformation operator.

    An operator may mirror and scale: its columns are the axes d1, d2, d3 of the standard, times the
    scale.
    """
    entity = entities.read(number)
    if OPERATOR in entity.parts:
        return _read_operator(entities, entity, factor)
    frame = read_frame(entities, number, factor)
    return _to_matrix(frame, frame.y)


def _read_operator(entities: Entities, entity: Entity, factor: float) -> FloatArray:
    base = entity.parts.get("CARTESIAN_TRANSFORMATION_OPERATOR")
    # The record of a simple instance begins with one to three names.
    parameters = [*base, *entity.parts[OPERATOR]] if base else entity.parts[OPERATOR]
    if len(parameters) < 5:
        raise Fault("a parameter is missing")
    first, second, origin, scale_parameter, third = parameters[-5:]
    frame = build_frame(
        read_point(entities, origin, factor),
        read_direction(entities, third),
        read_direction(entities, first),
    )
    y = read_direction(entities, second)
    is_mirrored = y is not None and dot(y, cross(frame.z, frame.x)) < 0.0
    matrix = _to_matrix(frame, scale(frame.y, -1.0) if is_mirrored else frame.y)
    size = 1.0 if is_omitted(scale_parameter) else as_number(scale_parameter)
    if not SMALLEST_SCALE <= size <= LARGEST_SCALE:
        raise Fault("the scale of a transformation is not positive, or out of proportion")
    matrix[:3, :3] *= size
    return matrix


def _to_matrix(frame: Frame, y: Vector) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3] = np.array([frame.x, y, frame.z, frame.origin]).T
    return matrix


def map_between(source: FloatArray, target: FloatArray) -> FloatArray | None:
    """The matrix that maps one placement to another, target · source⁻¹; None for the identity.

    `source` is a rotation times a scale, so that its inverse is its transpose by the square of the
    scale.
    """
    linear = source[:3, :3]
    inverse = linear.T / float(np.square(linear[:, 0]).sum())
    matrix = np.eye(4)
    matrix[:3, :3] = target[:3, :3] @ inverse
    matrix[:3, 3] = target[:3, 3] - matrix[:3, :3] @ source[:3, 3]
    return None if np.array_equal(matrix, np.eye(4)) else matrix
