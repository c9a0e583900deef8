"""Rational B-spline curves and surfaces.

References
----------
IGES 5.3, sections 4.23 (126) and 4.24 (128).
"""

from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.splines import (
    build_curve,
    build_surface,
    find_domain,
    segment,
    segment_surface,
)
from service.decoders.iges.entities import Entity
from service.decoders.iges.faults import OnePoint


def read_rational_curve(entity: Entity) -> Curve:
    """A rational B-spline curve (126), cut to its range of parameters."""
    parameters = entity.parameters
    count, degree = parameters.count(0) + 1, parameters.count(1)
    start = 6 + count + degree + 1
    points = parameters.numbers(start + count, 3 * count).reshape(count, 3)
    if (points == points[0]).all():
        raise OnePoint("a spline has no length")
    weights = parameters.numbers(start, count)
    curve = build_curve(
        degree,
        parameters.numbers(6, count + degree + 1),
        points,
        None if parameters.integer(4, 0) and not weights.any() else weights,
    )
    low, high = find_domain(curve)
    first = parameters.number(start + 4 * count, low)
    last = parameters.number(start + 4 * count + 1, high)
    return segment(curve, first, last) if first < last else curve


def read_rational_surface(entity: Entity) -> Surface:
    """A rational B-spline surface (128), cut to its ranges of parameters."""
    parameters = entity.parameters
    rows, columns = parameters.count(0) + 1, parameters.count(1) + 1
    p, q = parameters.count(2), parameters.count(3)
    count = rows * columns
    u, v = 9, 9 + rows + p + 1
    start = v + columns + q + 1
    # In a file the first index runs fastest.
    weights = parameters.numbers(start, count).reshape(columns, rows).T
    points = parameters.numbers(start + count, 3 * count).reshape(columns, rows, 3)
    surface = build_surface(
        (p, q),
        (parameters.numbers(u, rows + p + 1), parameters.numbers(v, columns + q + 1)),
        points.swapaxes(0, 1),
        None if parameters.integer(6, 0) and not weights.any() else weights,
    )
    ends = start + 4 * count
    for axis in range(2):
        low, high = float(surface.knots[axis][0]), float(surface.knots[axis][-1])
        first = parameters.number(ends + 2 * axis, low)
        last = parameters.number(ends + 2 * axis + 1, high)
        if first < last and (first > low or last < high):
            surface = segment_surface(surface, axis, first, last)
    return surface
