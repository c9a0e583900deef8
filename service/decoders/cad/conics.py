"""Lines and conics by their parameters in ISO 10303-42, and their pieces as exact curves.

A piece of an ellipse, a parabola or a hyperbola is a rational curve of degree 2. Its knots are the
parameters of the conic, which for an ellipse are angles; between knots the parameter of the spline
is near that of the conic, not equal to it. Arcs are divided into pieces of at most a quarter turn.

References
----------
ISO 10303-42, clause 4.4 (line, circle, ellipse, hyperbola, parabola); Piegl and Tiller, The NURBS
Book, 2nd ed., sections 7.3 to 7.5.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import asinh, atan2, ceil, cos, cosh, isfinite, pi, sin, sinh, tau
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import (
    LEAST,
    MAX_COORDINATE,
    Frame,
    Vector,
    add,
    check_point,
    distance,
    dot,
    norm,
    scale,
    subtract,
)
from service.surface.knots import find_least_span

FULL = 1e-9
"""An arc that is at most this angle away from a full turn, or from a point, is a full turn."""

MAX_HALF_ANGLE = 12.0
"""The greatest half of a hyperbola's parameter range in one piece: the weight is its cosh."""


@dataclass(frozen=True, slots=True)
class Line:
    """The line origin + t · direction; the direction need not have the length 1."""

    origin: Vector
    direction: Vector

    def __post_init__(self) -> None:
        check_point(self.origin)
        if not LEAST < norm(self.direction) <= MAX_COORDINATE:
            raise InvalidGeometry("a line has no direction, or a too large one")

    def evaluate(self, t: float) -> Vector:
        """The point at a parameter."""
        return add(self.origin, scale(self.direction, t))

    def find_parameter(self, point: Vector) -> float:
        """The parameter of the nearest point."""
        along = dot(subtract(point, self.origin), self.direction)
        return along / dot(self.direction, self.direction)

    def cut(self, first: float, last: float) -> Curve:
        """The curve of degree 1 over [first, last]."""
        rows = [(*self.evaluate(t), 1.0) for t in (first, last)]
        return _finish(1, [first, first, last, last], rows)


@dataclass(frozen=True, slots=True)
class Ellipse:
    """The ellipse origin + a cos t · x + b sin t · y; a circle if a = b."""

    frame: Frame
    a: float
    b: float

    def __post_init__(self) -> None:
        _check_sizes(self.a, self.b)

    def evaluate(self, t: float) -> Vector:
        """The point at an angle."""
        return self.frame.place(self.a * cos(t), self.b * sin(t))

    def find_parameter(self, point: Vector) -> float:
        """The parameter, −π to π, of a point on the ellipse; of others that of a near point."""
        x, y, _ = self.frame.locate(point)
        return atan2(y * self.a, x * self.b)

    def cut(self, first: float, last: float) -> Curve:
        """The arc from angle `first` to the next angle `last`, at most a full turn."""
        sweep = find_sweep(first, last)
        count = max(1, ceil(sweep / (pi / 2) - FULL))
        step = sweep / count
        weight = cos(step / 2)
        place, a, b = self.frame.place, self.a, self.b
        angles = [first + k * step for k in range(count)]
        angles.append(first + sweep)
        x, y, z = place(a * cos(first), b * sin(first))
        rows = [(x, y, z, 1.0)]
        for k in range(count):
            middle = first + (k + 0.5) * step
            x, y, z = place(a * cos(middle) / weight, b * sin(middle) / weight)
            rows.append((x * weight, y * weight, z * weight, weight))
            angle = angles[k + 1]
            x, y, z = place(a * cos(angle), b * sin(angle))
            rows.append((x, y, z, 1.0))
        if sweep == tau:
            rows[-1] = rows[0]
        return _finish(2, _double(angles), rows)

    def cut_whole(self) -> Curve:
        """The whole ellipse, from the end of its first axis."""
        return self.cut(0.0, tau)


@dataclass(frozen=True, slots=True)
class Parabola:
    """The parabola origin + f t² · x + 2 f t · y, with the focal distance f."""

    frame: Frame
    focal_distance: float

    def __post_init__(self) -> None:
        _check_sizes(self.focal_distance)

    def evaluate(self, t: float) -> Vector:
        """The point at a parameter."""
        return self.frame.place(self.focal_distance * t * t, 2.0 * self.focal_distance * t)

    def find_parameter(self, point: Vector) -> float:
        """The parameter of the point with the same coordinate y."""
        return self.frame.locate(point)[1] / (2.0 * self.focal_distance)

    def cut(self, first: float, last: float) -> Curve:
        """The piece over [first, last], a polynomial."""
        focal, place = self.focal_distance, self.frame.place
        corner = place(focal * first * last, focal * (first + last))
        rows = [(*point, 1.0) for point in (self.evaluate(first), corner, self.evaluate(last))]
        return _finish(2, [first] * 3 + [last] * 3, rows)


@dataclass(frozen=True, slots=True)
class Hyperbola:
    """The branch origin + a cosh t · x + b sinh t · y."""

    frame: Frame
    a: float
    b: float

    def __post_init__(self) -> None:
        _check_sizes(self.a, self.b)

    def evaluate(self, t: float) -> Vector:
        """The point at a parameter."""
        if not abs(t) < 700.0:
            raise InvalidGeometry("a hyperbola is too long")
        return self.frame.place(self.a * cosh(t), self.b * sinh(t))

    def find_parameter(self, point: Vector) -> float:
        """The parameter of the point with the same coordinate y."""
        return asinh(self.frame.locate(point)[1] / self.b)

    def cut(self, first: float, last: float) -> Curve:
        """The piece over [first, last]; its weights are 1 and cosh of half the range."""
        half, middle = (last - first) / 2, (first + last) / 2
        if not abs(half) <= MAX_HALF_ANGLE:
            raise InvalidGeometry("a piece of a hyperbola is too long")
        ends = self.evaluate(first), self.evaluate(last)
        weight = cosh(half)
        corner = self.frame.place(self.a * cosh(middle) / weight, self.b * sinh(middle) / weight)
        rows = [(*ends[0], 1.0), (*scale(corner, weight), weight), (*ends[1], 1.0)]
        return _finish(2, [first] * 3 + [last] * 3, rows)


Conic: TypeAlias = Ellipse | Parabola | Hyperbola
BasisCurve: TypeAlias = Line | Conic | Curve
"""Curves that edges, trimmed curves and swept surfaces refer to."""


def find_sweep(first: float, last: float) -> float:
    """The angle from one angle forwards to another: above 0, at most a full turn.

    Raises
    ------
    InvalidGeometry
        An angle is not finite.
    """
    sweep = last - first
    if not isfinite(sweep):
        raise InvalidGeometry("an angle is not finite")
    if not 0.0 < sweep <= tau:
        sweep %= tau
    return tau if sweep <= FULL or sweep >= tau - FULL else sweep


def build_polyline(points: Sequence[Vector]) -> Curve:
    """The curve of degree 1 through points, by its chord lengths; equal neighbours are one point.

    Raises
    ------
    InvalidGeometry
        There are not two different points.
    """
    kept, knots = list(points[:1]), [0.0]
    for point in points[1:]:
        step = distance(point, kept[-1])
        if step > 0.0:
            kept.append(point)
            knots.append(knots[-1] + step)
    if len(kept) < 2:
        raise InvalidGeometry("a polyline has no length")
    return _finish(1, [knots[0], *knots, knots[-1]], [(*point, 1.0) for point in kept])


def _check_sizes(*sizes: float) -> None:
    """Refuse radii and distances that are not positive, or too large."""
    if not all(LEAST < size <= MAX_COORDINATE for size in sizes):
        raise InvalidGeometry("a radius or a semi-axis is not positive, or too large")


def _double(angles: Sequence[float]) -> list[float]:
    """Knots of degree 2: the inner ones twice, the ends three times."""
    knots = [angles[0]]
    for angle in angles:
        knots += (angle, angle)
    knots.append(angles[-1])
    return knots


def _finish(degree: int, knots: list[float], rows: Sequence[tuple[float, ...]]) -> Curve:
    """The curve of homogeneous points, unless they are too large, or it has no length.

    Raises
    ------
    InvalidGeometry
    """
    points: FloatArray = np.array(rows)
    if not np.abs(points).max() <= MAX_COORDINATE:  # true for NaN, too
        raise InvalidGeometry("a piece of a curve is too large, or not finite")
    if not knots[-1] - knots[0] >= find_least_span(knots[0], knots[-1]):
        raise InvalidGeometry("a piece of a curve has no length")
    # Every second point is on a conic, and has the weight 1.
    if all(row == rows[0] for row in rows[degree::degree]):
        raise InvalidGeometry("a piece of a curve is a point")
    return Curve(degree, np.array(knots), points)
