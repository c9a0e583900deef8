"""How far edges are from the elementary surfaces of their faces, at their ends."""

from math import cos, sin, tan

import numpy as np

from service.decoders.cad.elementary import Cone, Cylinder, Elementary, Plane, Sphere
from service.decoders.cad.outline import Outline


def find_gap(shape: Elementary, outline: Outline) -> float:
    """The largest distance from the ends of edges to the surface, and of a plane from all edges.

    Control points are as far from a plane as the curve is, or further.
    """
    points = outline.hull if isinstance(shape, Plane) else outline.ends
    if not len(points):
        return 0.0
    x, y, z = shape.frame.locate_all(points)
    if isinstance(shape, Plane):
        away = z
    elif isinstance(shape, Cylinder):
        away = np.hypot(x, y) - shape.radius
    elif isinstance(shape, Cone):
        # On the other side of the apex, radii are negative.
        side = np.where(shape.radius + z * tan(shape.angle) < 0.0, -1.0, 1.0)
        away = (side * np.hypot(x, y) - shape.radius) * cos(shape.angle) - z * sin(shape.angle)
    elif isinstance(shape, Sphere):
        away = np.sqrt(x * x + y * y + z * z) - shape.radius
    else:
        distances = np.hypot(x, y)
        outer = np.abs(np.hypot(distances - shape.major, z) - shape.minor)
        inner = np.abs(np.hypot(distances + shape.major, z) - shape.minor)
        away = np.minimum(outer, inner)  # the inner part of a spindle
    return float(np.abs(away).max())
