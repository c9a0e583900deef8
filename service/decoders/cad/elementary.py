"""Planes, cylinders, cones, spheres and tori, cut to the outline of a face, as exact splines.

The parameters are those of ISO 10303-42: lengths, and angles in radians. Along an angle the
parameter of the spline equals the angle at each quarter turn, and is near it between.

References
----------
ISO 10303-42, clause 4.4 (elementary_surface and its subtypes).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, cos, pi, tan, tau
from typing import TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Surface
from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import LEAST, MAX_COORDINATE, Frame, add, scale
from service.decoders.cad.outline import Outline, find_wedge
from service.decoders.cad.turning import build_arc, finish_surface, turn_profile

Range: TypeAlias = tuple[float, float]

AT_APEX = 1e-9
"""Points nearer to the axis of a cone than this share of the largest distance have no angle."""

SAME_RADIUS = 1e-9
"""A torus whose radii differ by at most this share touches itself in one point."""


@dataclass(frozen=True, slots=True)
class Plane:
    """The plane origin + u · x + v · y."""

    frame: Frame

    def cut(self, outline: Outline) -> Surface:
        """The rectangle around an outline."""
        local = outline.locate(self.frame)
        return self.trim(local.find_range(0), local.find_range(1))

    def trim(self, u: Range, v: Range) -> Surface:
        """The rectangle of two ranges of lengths."""
        place = self.frame.place
        net = np.array([[(*place(a, b), 1.0) for b in v] for a in u])
        return finish_surface((1, 1), (_ends(u), _ends(v)), net)

    def measure(self, points: FloatArray) -> FloatArray:
        """Distances (k,) of points (k, 3) from the surface."""
        distances: FloatArray = np.abs(self.frame.locate_all(points)[2])
        return distances

    def offset(self, distance: float) -> "Plane":
        """The plane at a distance along the normal."""
        return Plane(_lift(self.frame, distance))


@dataclass(frozen=True, slots=True)
class Cylinder:
    """The cylinder origin + r (cos u · x + sin u · y) + v · z."""

    frame: Frame
    radius: float

    def __post_init__(self) -> None:
        _check_radius(self.radius)

    def cut(self, outline: Outline) -> Surface:
        """The part between the heights of an outline; a wedge, if the outline is in a half."""
        local = outline.locate(self.frame)
        return self._build(local.find_range(2), find_wedge(local.find_angles()))

    def trim(self, u: Range, v: Range) -> Surface:
        """The part of a range of angles and a range of heights."""
        return self._build(v, u)

    def measure(self, points: FloatArray) -> FloatArray:
        """Distances (k,) of points (k, 3) from the surface."""
        x, y, _ = self.frame.locate_all(points)
        distances: FloatArray = np.abs(np.hypot(x, y) - self.radius)
        return distances

    def offset(self, distance: float) -> "Cylinder":
        """The cylinder at a distance outwards."""
        return Cylinder(self.frame, self.radius + distance)

    def _build(self, v: Range, wedge: Range | None) -> Surface:
        profile = np.array([(self.radius, height, 1.0) for height in v])
        return turn_profile(self.frame, 1, _ends(v), profile, wedge)


@dataclass(frozen=True, slots=True)
class Cone:
    """The cone origin + (r + v tan φ) (cos u · x + sin u · y) + v · z.

    Attributes
    ----------
    radius : float
        At the origin. That of an offset cone may be negative, if its apex is above the origin.
    angle : float
        The half of the angle at the apex, φ, in radians.
    """

    frame: Frame
    radius: float
    angle: float

    def __post_init__(self) -> None:
        if not abs(self.radius) <= MAX_COORDINATE:
            raise InvalidGeometry("the radius of a cone is not finite or too large")
        if not 1e-9 < abs(self.angle) < pi / 2 - 1e-9:
            raise InvalidGeometry("the angle of a cone is not between 0 and 90 degrees")

    @property
    def apex(self) -> float:
        """The height v of the apex."""
        return -self.radius / tan(self.angle)

    def cut(self, outline: Outline) -> Surface:
        """The part between the heights of an outline, on one side of the apex.

        A face is on one side of the apex, because a surface crosses itself there. It is the side
        with the greater part of the outline. A face around which loops run includes the apex.
        """
        local = outline.locate(self.frame)
        low, high = local.find_range(2)
        angles, apex = local.find_angles(), self.apex
        if local.count_turns(angles):
            low, high = min(low, apex), max(high, apex)
        if low < apex < high:
            low, high = (low, apex) if apex - low > high - apex else (apex, high)
        distances = np.hypot(local.hull[0], local.hull[1])
        is_away = (distances > AT_APEX * distances.max()).tolist()
        angles = [angle for angle, away in zip(angles, is_away, strict=True) if away]
        if self.radius + (low + high) / 2 * tan(self.angle) < 0.0:
            # The point of a negative radius is opposite to its angle.
            angles = [angle - pi if angle > 0.0 else angle + pi for angle in angles]
        return self._build((low, high), find_wedge(angles))

    def trim(self, u: Range, v: Range) -> Surface:
        """The part of a range of angles and a range of heights."""
        return self._build(v, u)

    def measure(self, points: FloatArray) -> FloatArray:
        """Distances (k,) of points (k, 3) from the surface, measured along its normals."""
        x, y, z = self.frame.locate_all(points)
        radii = np.abs(self.radius + z * tan(self.angle))
        distances: FloatArray = np.abs(np.hypot(x, y) - radii) * cos(self.angle)
        return distances

    def offset(self, distance: float) -> "Cone":
        """The cone at a distance outwards."""
        return Cone(self.frame, self.radius + distance / cos(self.angle), self.angle)

    def _build(self, v: Range, wedge: Range | None) -> Surface:
        slope, apex = tan(self.angle), self.apex
        radii = [0.0 if height == apex else self.radius + height * slope for height in v]
        profile = np.array([(r, height, 1.0) for r, height in zip(radii, v, strict=True)])
        return turn_profile(self.frame, 1, _ends(v), profile, wedge)


@dataclass(frozen=True, slots=True)
class Sphere:
    """The sphere origin + r cos v (cos u · x + sin u · y) + r sin v · z."""

    frame: Frame
    radius: float

    def __post_init__(self) -> None:
        _check_radius(self.radius)

    def cut(self, _: Outline) -> Surface:
        """The whole sphere: a face may be on either side of its edges."""
        return self._build((-pi / 2, pi / 2), None)

    def trim(self, u: Range, v: Range) -> Surface:
        """The part of two ranges of angles."""
        return self._build((max(v[0], -pi / 2), min(v[1], pi / 2)), u)

    def measure(self, points: FloatArray) -> FloatArray:
        """Distances (k,) of points (k, 3) from the surface."""
        x, y, z = self.frame.locate_all(points)
        distances: FloatArray = np.abs(np.sqrt(x * x + y * y + z * z) - self.radius)
        return distances

    def offset(self, distance: float) -> "Sphere":
        """The sphere at a distance outwards."""
        return Sphere(self.frame, self.radius + distance)

    def _build(self, v: Range, wedge: Range | None) -> Surface:
        knots, arc = build_arc(*v)
        profile = arc * (self.radius, self.radius, 1.0)
        _close_poles(profile, [abs(angle) >= pi / 2 for angle in v])
        return turn_profile(self.frame, 2, knots, profile, wedge)


@dataclass(frozen=True, slots=True)
class Torus:
    """The torus origin + (R + r cos v) (cos u · x + sin u · y) + r sin v · z.

    If r > R it crosses itself on the axis, and a face is on its outer or on its inner part.

    Attributes
    ----------
    major, minor : float
        R and r.
    is_outer : bool or None
        Which part it is, if r > R; None if the outline tells it.
    """

    frame: Frame
    major: float
    minor: float
    is_outer: bool | None = None

    def __post_init__(self) -> None:
        _check_radius(self.minor)
        if not 0.0 <= self.major <= MAX_COORDINATE:
            raise InvalidGeometry("the radius of a torus is negative or too large")

    def cut(self, outline: Outline) -> Surface:
        """The whole torus, or its outer or inner part."""
        return self._build(self._find_part(outline), None)

    def trim(self, u: Range, v: Range) -> Surface:
        """The part of two ranges of angles."""
        return self._build(v, u)

    def measure(self, points: FloatArray) -> FloatArray:
        """Distances (k,) of points (k, 3) from the surface, from the nearer part of a spindle."""
        outer, inner = self._measure_parts(points)
        return np.minimum(outer, inner) if self.minor > self.major else outer

    def offset(self, distance: float) -> "Torus":
        """The torus at a distance outwards."""
        return Torus(self.frame, self.major, self.minor + distance, self.is_outer)

    def _find_part(self, outline: Outline) -> Range:
        """The range of v in which the surface does not cross itself."""
        if self.minor <= self.major * (1.0 - SAME_RADIUS):
            return 0.0, tau
        pole = acos(max(-1.0, -self.major / self.minor))
        if self.minor <= self.major * (1.0 + SAME_RADIUS):
            pole = pi
        is_outer = self.is_outer
        if is_outer is None:
            is_outer = not outline or not self._are_inner(outline.on_surface)
        return (-pole, pole) if is_outer else (pole, tau - pole)

    def _are_inner(self, points: FloatArray) -> bool:
        """Whether points (k, 3) are nearer to the inner part of a spindle than to the outer."""
        outer, inner = self._measure_parts(points)
        return float(inner.sum()) < float(outer.sum())

    def _measure_parts(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances of points (k, 3) from the outer part, and from the inner part of a spindle."""
        x, y, z = self.frame.locate_all(points)
        distances = np.hypot(x, y)
        outer = np.abs(np.hypot(distances - self.major, z) - self.minor)
        return outer, np.abs(np.hypot(distances + self.major, z) - self.minor)

    def _build(self, v: Range, wedge: Range | None) -> Surface:
        knots, arc = build_arc(*v)
        profile = arc * (self.minor, self.minor, 1.0)
        profile[:, 0] += self.major * arc[:, 2]
        radii = [self.major + self.minor * cos(angle) for angle in v]
        _close_poles(profile, [abs(r) <= SAME_RADIUS * self.minor for r in radii])
        return turn_profile(self.frame, 2, knots, profile, wedge)


Elementary: TypeAlias = Plane | Cylinder | Cone | Sphere | Torus


def find_gap(surface: Elementary, outline: Outline) -> float:
    """The largest distance of the ends and middles of edges from their surface."""
    points = outline.on_surface
    return float(surface.measure(points).max()) if len(points) else 0.0


def _check_radius(radius: float) -> None:
    """Refuse a radius that is not positive, or too large."""
    if not LEAST < radius <= MAX_COORDINATE:
        raise InvalidGeometry("a radius is not positive, or too large")


def _close_poles(profile: FloatArray, is_pole: Sequence[bool]) -> None:
    """Put the ends of a profile exactly on the axis."""
    for row, closed in zip((0, -1), is_pole, strict=True):
        if closed:
            profile[row, 0] = 0.0


def _ends(values: Range) -> FloatArray:
    """The knots of degree 1 over a range."""
    return np.array([values[0], values[0], values[1], values[1]])


def _lift(frame: Frame, height: float) -> Frame:
    """The frame moved along its z."""
    if not abs(height) <= MAX_COORDINATE:
        raise InvalidGeometry("a distance is not finite or too large")
    return frame.move(add(frame.origin, scale(frame.z, height)))
