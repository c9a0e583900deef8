"""Curves at a constant distance from lines and circular arcs.

With the tangent T of the other curve and the normal V of the plane, each point is moved by the
distance along V × T, to the left as seen from the tip of V.

References
----------
IGES 5.3, section 4.25 (130).
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.cad.splines import find_domain, project_points, segment, transform
from service.decoders.iges.arcs import find_circle, read_line
from service.decoders.iges.entities import Entity
from service.decoders.iges.faults import Fault, Unsupported

_CONSTANT = 1


def read_offset(entity: Entity, base: Entity, matrix: FloatArray | None) -> Curve:
    """The curve at a distance from another one, whose own matrix is given.

    Raises
    ------
    Fault, InvalidGeometry
        The distance is not constant, or the other curve is neither a line nor an arc.
    """
    parameters = entity.parameters
    if parameters.integer(1) != _CONSTANT:
        raise Unsupported("an offset curve with a distance that changes is not read")
    distance = parameters.number(5)
    normal = parameters.numbers(9, 3)
    if base.type == 110:
        curve = _cut(read_line(base), entity)
        curve = curve if matrix is None else transform(curve, matrix)
        first, last = project_points(curve.points)
        step = np.cross(normal, last - first)
        size = float(np.linalg.norm(step))
        if not size > 0:
            raise Fault("an offset curve has no direction")
        return transform(curve, _move(step * (distance / size)))
    if base.type != 100:
        raise Unsupported(f"an offset of a curve of type {base.type} is not read")
    circle, first_angle, last_angle = find_circle(base)
    arc = circle.cut(parameters.number(12, first_angle), parameters.number(13, last_angle))
    axis = np.array([0.0, 0.0, 1.0])
    center = np.array(circle.frame.origin)
    if matrix is not None:
        arc = transform(arc, matrix)
        axis = np.cross(matrix[:3, 0], matrix[:3, 1])
        center = matrix[:3, :3] @ center + matrix[:3, 3]
    radius = float(np.linalg.norm(project_points(arc.points[:1])[0] - center))
    # Left of a tangent that runs counter-clockwise about the normal is inside.
    inwards = distance if normal @ axis > 0 else -distance
    if not radius > inwards:
        raise Fault("an offset of an arc has no radius")
    about = _move(center) @ np.diag([*[1 - inwards / radius] * 3, 1.0]) @ _move(-center)
    return transform(arc, about)


def _cut(line: Curve, entity: Entity) -> Curve:
    low, high = find_domain(line)
    first, last = entity.parameters.number(12, low), entity.parameters.number(13, high)
    return segment(line, first, last)


def _move(step: FloatArray) -> FloatArray:
    """The matrix (4, 4) of a translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = step
    return matrix
