"""Surfaces of linear extrusion and of revolution, cut to the outline of a face.

Where the swept curve is unbounded (a line, a parabola, a hyperbola), it is cut so that the surface
covers the outline.

References
----------
ISO 10303-42, clause 4.4 (surface_of_linear_extrusion, surface_of_revolution).
"""

from dataclasses import dataclass
from math import asinh, hypot

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.conics import BasisCurve, Ellipse, Line, Parabola
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
from service.decoders.cad.outline import MARGIN, Outline, find_range
from service.decoders.cad.profiles import (
    cut_basis,
    cut_conic,
    cut_ellipse,
    cut_line,
)
from service.decoders.cad.splines import (
    build_curve,
    elevate,
    find_domain,
    insert_knots,
    project_points,
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
        return self._build(cut_conic(curve, local), find_range(v, size / length))

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
            return self._build(frame, cut_ellipse(frame, curve, outline), None)
        if isinstance(curve, Curve):
            return self._build(frame, curve, None)
        local = outline.locate(frame)
        reach = float(np.sqrt(np.square(local.hull).sum(axis=0)).max()) * (1.0 + MARGIN)
        if isinstance(curve, Line):
            return self._build(frame, cut_line(frame, curve, local), None)
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


def _outer(values: Range, vector: Vector) -> FloatArray:
    """Both multiples of a vector, (2, 3)."""
    return np.array([scale(vector, value) for value in values])
