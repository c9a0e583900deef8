"""Surfaces of linear extrusion and of revolution, cut to the outline of a face.

Where the swept curve is unbounded (a line, a parabola, a hyperbola), it is cut so that the surface
covers the outline.

References
----------
ISO 10303-42, clause 4.4 (surface_of_linear_extrusion, surface_of_revolution).
"""

from dataclasses import dataclass
from math import acos, asinh, atan2, hypot, sqrt, tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import BasisCurve, Ellipse, Hyperbola, Line, Parabola
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.elementary import Range
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import (
    LEAST,
    PARALLEL,
    Frame,
    Vector,
    build_frame,
    check_point,
    cross,
    dot,
    norm,
    scale,
    subtract,
    unit,
)
from service.decoders.cad.outline import MARGIN, LocalOutline, Outline, find_range, find_wedge
from service.decoders.cad.splines import (
    build_curve,
    elevate,
    find_domain,
    insert_knots,
    project_points,
    segment,
)
from service.decoders.cad.turning import finish_surface, turn_points

ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Extrusion:
    """The surface C(u) + v · vector."""

    curve: BasisCurve
    vector: Vector

    def __post_init__(self) -> None:
        check_point(self.vector)
        if not norm(self.vector) > LEAST:
            raise InvalidGeometry("the direction of an extrusion has no length")

    def cut(self, outline: Outline) -> Surface:
        """The part that covers an outline."""
        curve, length = self.curve, norm(self.vector)
        size = outline.locate(build_frame(ORIGIN)).size
        if isinstance(curve, Line):
            u, v = self._locate_on_plane(curve, outline.hull)
            step = size / norm(curve.direction)
            return self._build(curve.cut(*find_range(u, step)), find_range(v, size / length))
        if isinstance(curve, Curve):
            direction = np.array(unit(self.vector))
            along = (outline.hull * direction).sum(axis=1)
            own = (project_points(curve.points) * direction).sum(axis=1)
            low, high = float(along.min() - own.max()), float(along.max() - own.min())
            return self._build(curve, find_range(np.array([low, high]) / length, size / length))
        local, v = self._locate_on_conic(curve.frame, outline.hull)
        return self._build(_cut_conic(curve, local), find_range(v, size / length))

    def trim(self, u: Range | None, v: Range) -> Surface:
        """The part of a range of the curve's parameter, None for all of it, and a range of v."""
        return self._build(cut_basis(self.curve, u), v)

    def _build(self, curve: Curve, v: Range) -> Surface:
        net = np.empty((len(curve.points), 2, 4))
        net[:] = curve.points[:, np.newaxis]
        net[..., :3] += curve.points[:, 3:, np.newaxis] * _outer(v, self.vector)
        knots = np.array([v[0], v[0], v[1], v[1]])
        return finish_surface((curve.degree, 1), (curve.knots, knots), net)

    def _locate_on_plane(self, line: Line, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The parameters of points near the plane of a line that is extruded."""
        a, b = line.direction, self.vector
        aa, ab, bb = dot(a, a), dot(a, b), dot(b, b)
        determinant = aa * bb - ab * ab
        if determinant <= (PARALLEL * PARALLEL) * aa * bb:
            raise InvalidGeometry("a line is extruded along itself")
        rows = (points - line.origin).T
        pa, pb = (sum(row * x for row, x in zip(rows, each, strict=True)) for each in (a, b))
        return (pa * bb - pb * ab) / determinant, (pb * aa - pa * ab) / determinant

    def _locate_on_conic(self, frame: Frame, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points moved along the vector to the plane of a conic, in its frame (2, k); and v."""
        steep = dot(self.vector, frame.z)
        if abs(steep) <= PARALLEL * norm(self.vector):
            raise InvalidGeometry("a conic is extruded in its own plane")
        local = frame.locate_all(points)
        v = local[2] / steep
        local[0] -= v * dot(self.vector, frame.x)
        local[1] -= v * dot(self.vector, frame.y)
        return local[:2], v


@dataclass(frozen=True, slots=True)
class Revolution:
    """The surface of a curve that turns about an axis: u is the angle, v the curve's parameter."""

    curve: BasisCurve
    origin: Vector
    axis: Vector

    def __post_init__(self) -> None:
        check_point(self.origin)
        unit(self.axis)

    def cut(self, outline: Outline) -> Surface:
        """The part that covers an outline: a full turn, or a wedge if the outline is in a half."""
        frame = build_frame(self.origin, self.axis)
        curve = self.curve
        if isinstance(curve, Ellipse):
            return self._build(frame, _cut_ellipse(frame, curve, outline), None)
        if isinstance(curve, Curve):
            return self._build(frame, curve, None)
        local = outline.locate(frame)
        reach = float(np.sqrt(np.square(local.hull).sum(axis=0)).max()) * (1.0 + MARGIN)
        if isinstance(curve, Line):
            return self._build(frame, _cut_line(frame, curve, local), None)
        reach += norm(subtract(curve.frame.origin, self.origin))
        if isinstance(curve, Parabola):
            most = reach / (2.0 * curve.focal_distance)
        else:
            most = asinh(reach / curve.b)
        # A parabola that turns about its own axis covers its surface twice.
        is_own = norm(cross(curve.frame.x, frame.z)) <= PARALLEL and (
            hypot(*frame.locate(curve.frame.origin)[:2]) <= PARALLEL * reach
        )
        return self._build(frame, curve.cut(0.0 if is_own else -most, most), None)

    def trim(self, u: Range, v: Range | None) -> Surface:
        """The part of a range of angles and of a range of the curve's parameter, or all of it."""
        frame = build_frame(self.origin, self.axis)
        return self._build(frame, cut_basis(self.curve, v), u)

    def _build(self, frame: Frame, curve: Curve, wedge: Range | None) -> Surface:
        weights = curve.points[:, 3]
        local = np.empty_like(curve.points)
        local[:, :3] = (frame.locate_all(project_points(curve.points)) * weights).T
        local[:, 3] = weights
        # Ends on the axis become poles, which are one point exactly.
        distances = np.hypot(local[:, 0], local[:, 1])
        ends = [0, -1]
        is_pole = distances[ends] <= 1e-12 * np.abs(local[:, :3]).max()
        local[np.array(ends)[is_pole], :2] = 0.0
        return turn_points(frame, curve.degree, curve.knots, local, wedge)


Swept = Extrusion | Revolution


def rule(first: Curve, second: Curve) -> Surface:
    """The ruled surface (1 − v) C(u) + v D(u) over [0, 1]², of two curves of any degrees.

    The domains of both curves are mapped to [0, 1]; points with equal parameters are joined.

    Raises
    ------
    InvalidGeometry
    """
    degree = max(first.degree, second.degree)
    pair = [_over_unit_interval(elevate(curve, degree)) for curve in (first, second)]
    values = [np.unique(curve.knots, return_counts=True) for curve in pair]
    missing: list[list[float]] = []
    for own, other in (values, values[::-1]):
        counts = dict(zip(own[0].tolist(), own[1].tolist(), strict=True))
        missing.append(
            [
                knot
                for knot, count in zip(*(column.tolist() for column in other), strict=True)
                for _ in range(count - counts.get(knot, 0))
            ]
        )
    nets = [insert_knots(curve, knots) for curve, knots in zip(pair, missing, strict=True)]
    knots = np.array([0.0, 0.0, 1.0, 1.0])
    net = np.stack([curve.points for curve in nets], axis=1)
    return finish_surface((degree, 1), (nets[0].knots, knots), net)


def _over_unit_interval(curve: Curve) -> Curve:
    """The curve over [0, 1], its knots rounded so that nearly equal ones of two curves agree."""
    low, high = find_domain(curve)
    knots = np.round((curve.knots - low) / (high - low), 12)
    return build_curve(curve.degree, knots, project_points(curve.points), curve.points[:, 3])


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


def _cut_conic(curve: Ellipse | Parabola | Hyperbola, local: FloatArray) -> Curve:
    """The part of a conic that has points with the coordinates (x, y) of its frame, (2, k)."""
    if isinstance(curve, Ellipse):
        wedge = find_wedge(np.arctan2(local[1] * curve.a, local[0] * curve.b).tolist())
        return curve.cut_whole() if wedge is None else curve.cut(*wedge)
    if isinstance(curve, Parabola):
        return curve.cut(*find_range(local[1] / (2.0 * curve.focal_distance)))
    return curve.cut(*find_range(np.arcsinh(local[1] / curve.b)))


def _cut_ellipse(frame: Frame, curve: Ellipse, outline: Outline) -> Curve:
    """The part of an ellipse on one side of z of a frame, if it is in a plane with z.

    An ellipse that crosses the axis covers its surface twice, or makes two surfaces that meet on
    the axis. The part is taken that is nearer to the points of edges.
    """
    x, y, normal = (frame.locate(_add_origin(frame, each)) for each in curve.frame.directions)
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
        distances, heights = _to_profile(frame.locate_all(outline.on_surface))
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


def _to_profile(local: FloatArray) -> FloatArray:
    """Distances from z, and heights, (2, k), of points (3, k)."""
    return np.stack([np.hypot(local[0], local[1]), local[2]])


def _cut_line(frame: Frame, line: Line, outline: LocalOutline) -> Curve:
    """The part of a line whose surface of revolution about z of a frame covers an outline."""
    local, size = outline.hull, outline.size
    origin = frame.locate(line.origin)
    dx, dy, dz = direction = frame.locate(_add_origin(frame, line.direction))
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


def _add_origin(frame: Frame, vector: Vector) -> Vector:
    """A vector as the point at its end."""
    return (
        frame.origin[0] + vector[0],
        frame.origin[1] + vector[1],
        frame.origin[2] + vector[2],
    )


def _outer(values: Range, vector: Vector) -> FloatArray:
    """Both multiples of a vector, (2, 3)."""
    return np.array([scale(vector, value) for value in values])
