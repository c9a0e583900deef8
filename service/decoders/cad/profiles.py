"""Curves that are swept, cut to the pieces that cover the outline of a face."""

from math import acos, atan2, hypot, sqrt, tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import BasisCurve, Ellipse, Hyperbola, Line, Parabola
from service.decoders.cad.content import Curve
from service.decoders.cad.elementary import Range
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import PARALLEL, Frame, Vector, cross, dot, norm
from service.decoders.cad.outline import MARGIN, LocalOutline, Outline, find_range, find_wedge
from service.decoders.cad.splines import segment


def cut_basis(curve: BasisCurve, parameters: Range | None) -> Curve:
    """The piece of a curve over a range of its parameter; None for the whole curve.

    Raises
    ------
    InvalidGeometry
        An unbounded curve has no range.
    """
    if isinstance(curve, Curve):
        return curve if parameters is None else segment(curve, *parameters)
    if parameters is None:
        if isinstance(curve, Ellipse):
            return curve.cut_whole()
        raise InvalidGeometry("an unbounded curve has no ends")
    return curve.cut(*parameters)


def cut_conic(curve: Ellipse | Parabola | Hyperbola, local: FloatArray) -> Curve:
    """The part of a conic that has points with the coordinates (x, y) of its frame, (2, k)."""
    if isinstance(curve, Ellipse):
        wedge = find_wedge(np.arctan2(local[1] * curve.a, local[0] * curve.b).tolist())
        return curve.cut_whole() if wedge is None else curve.cut(*wedge)
    if isinstance(curve, Parabola):
        return curve.cut(*find_range(local[1] / (2.0 * curve.focal_distance)))
    return curve.cut(*find_range(np.arcsinh(local[1] / curve.b)))


def cut_ellipse(frame: Frame, curve: Ellipse, outline: Outline) -> Curve:
    """The part of an ellipse on one side of z of a frame, if it is in a plane with z.

    An ellipse that crosses the axis covers its surface twice, or makes two surfaces that meet on
    the axis. The part is taken that is nearer to the points of edges.
    """
    x, y, normal = (frame.locate(add_origin(frame, each)) for each in curve.frame.directions)
    centre = frame.locate(curve.frame.origin)
    size = max(curve.a, curve.b)
    across = cross((0.0, 0.0, 1.0), normal)  # in the plane, at right angles to the axis
    is_beside = abs(dot(centre, normal)) > PARALLEL * size
    if is_beside or abs(normal[2]) > PARALLEL:
        return curve.cut_whole()
    # The signed distance from the axis is middle + reach cos(t − turn).
    middle, c, s = dot(centre, across), curve.a * dot(x, across), curve.b * dot(y, across)
    reach, turn = hypot(c, s), atan2(s, c)
    if abs(middle) >= reach:
        return curve.cut_whole()
    half = acos(-middle / reach)
    pieces = [
        curve.cut(turn - half, turn + half),
        curve.cut(turn + half, turn - half + tau),
    ]
    if abs(middle) > PARALLEL * reach and outline:
        distances, heights = to_profile(frame.locate_all(outline.on_surface))
        sums = []
        for side in (1.0, -1.0):
            # How far points are from the ellipse, as a share of its size: no samples of a large
            # ellipse would be near enough to tell.
            along, up = side * distances - middle, heights - centre[2]
            across_x, across_y = dot(x, across), dot(y, across)
            shares = np.hypot(
                (along * across_x + up * x[2]) / curve.a, (along * across_y + up * y[2]) / curve.b
            )
            sums.append(float(np.abs(shares - 1.0).sum()))
        return pieces[int(sums[1] < sums[0])]
    return pieces[0]


def to_profile(local: FloatArray) -> FloatArray:
    """Distances from z, and heights, (2, k), of points (3, k)."""
    return np.stack([np.hypot(local[0], local[1]), local[2]])


def cut_line(frame: Frame, line: Line, outline: LocalOutline) -> Curve:
    """The part of a line whose surface of revolution about z of a frame covers an outline."""
    local, size = outline.hull, outline.size
    origin = frame.locate(line.origin)
    dx, dy, dz = direction = frame.locate(add_origin(frame, line.direction))
    length = norm(direction)
    across = hypot(dx, dy)
    # Where the line is nearest to the axis.
    nearest = 0.0
    if across > PARALLEL * length:
        nearest = -(origin[0] * dx + origin[1] * dy) / (across * across)
    closest = hypot(origin[0] + nearest * dx, origin[1] + nearest * dy)
    if abs(dz) > PARALLEL * length:
        t = (local[2] - origin[2]) / dz
        meets = across > PARALLEL * length and closest <= PARALLEL * size
        if meets and outline.count_turns(outline.find_angles()):
            t = np.append(t, nearest)
        low, high = find_range(t, size / length)
        if meets and low < nearest < high:  # a cone, which ends at its apex
            before = nearest - low > high - nearest
            low, high = (low, nearest) if before else (nearest, high)
        return line.cut(low, high)
    # A disc: from its middle outwards.
    radius = float(np.hypot(local[0], local[1]).max()) * (1.0 + MARGIN)
    if not radius > closest:
        raise InvalidGeometry("the edges of a face are not on its surface")
    return line.cut(nearest, nearest + sqrt(radius * radius - closest * closest) / length)


def add_origin(frame: Frame, vector: Vector) -> Vector:
    """A vector as the point at its end."""
    return (
        frame.origin[0] + vector[0],
        frame.origin[1] + vector[1],
        frame.origin[2] + vector[2],
    )
