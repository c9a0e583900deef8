"""Lines and circular arcs.

References
----------
IGES 5.3, sections 4.3 (100) and 4.13 (110).
"""

from math import atan2, hypot, tau

import numpy as np

from service.decoders.cad.conics import Ellipse
from service.decoders.cad.content import Curve
from service.decoders.cad.frames import Frame
from service.decoders.iges.entities import Entity
from service.decoders.iges.faults import OnePoint, Unsupported

SAME_POINT = 1e-9
"""An arc whose ends are this close, as a share of the radius, is a full circle."""

LINE_KNOTS = np.array([0.0, 0.0, 1.0, 1.0])
"""The knots of a line."""


def read_arc(entity: Entity) -> Curve:
    """A circular arc, counter-clockwise from its start to its end; its knots are angles."""
    circle, first, last = find_circle(entity)
    return circle.cut(first, last)


def find_circle(entity: Entity) -> tuple[Ellipse, float, float]:
    """The circle of an arc, and the angles at which the arc begins and ends."""
    z, x, y, start_x, start_y, end_x, end_y = entity.parameters.numbers(0, 7).tolist()
    radius = hypot(start_x - x, start_y - y)
    frame = Frame((x, y, z), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    circle = Ellipse(frame, radius, radius)
    first = atan2(start_y - y, start_x - x) % tau
    if hypot(end_x - start_x, end_y - start_y) <= SAME_POINT * radius:
        return circle, first, first + tau
    last = atan2(end_y - y, end_x - x) % tau
    return circle, first, last if last > first else last + tau


def read_line(entity: Entity) -> Curve:
    """A line between two points, over [0, 1]."""
    if entity.form:
        raise Unsupported("a line without an end is not read")
    ends = entity.parameters.numbers(0, 6).reshape(2, 3)
    if (ends[0] == ends[1]).all():
        raise OnePoint("a line has no length")
    points = np.ones((2, 4))
    points[:, :3] = ends
    return Curve(1, LINE_KNOTS, points)
