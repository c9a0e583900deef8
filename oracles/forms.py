"""Signed distances of solids in closed form: negative inside, exact everywhere.

Points have the shape (m, 3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from oracles.brep_documents import Array, Index

STEPS = 2000
"""The most steps along a ray."""


class Form(Protocol):
    """A solid whose distances are known."""

    def measure(self, points: Array) -> Array:
        """Signed distances (m,) of points from the surface of the solid."""
        ...


@dataclass(frozen=True, eq=False)
class Box:
    """The box between two corners."""

    low: Array
    high: Array

    def measure(self, points: Array) -> Array:
        beyond = np.maximum(self.low - points, points - self.high)
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0))


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball."""

    middle: Array
    radius: float

    def measure(self, points: Array) -> Array:
        return np.asarray(np.linalg.norm(points - self.middle, axis=1) - self.radius)


@dataclass(frozen=True, eq=False)
class Ring:
    """A torus around the z axis, with the middle in the plane z = 0."""

    radius: float
    tube: float

    def measure(self, points: Array) -> Array:
        from_circle = np.hypot(points[:, 0], points[:, 1]) - self.radius
        return np.asarray(np.hypot(from_circle, points[:, 2]) - self.tube)


@dataclass(frozen=True, eq=False)
class Turned:
    """The solid of a polygon (n, 2) of radii and heights, turned around the z axis.

    Sides on the axis are inside of the solid.
    """

    profile: Array

    def measure(self, points: Array) -> Array:
        radii = np.hypot(points[:, 0], points[:, 1])
        places = np.column_stack([radii, points[:, 2]])
        ends = np.roll(self.profile, -1, axis=0)
        is_border = (self.profile[:, 0] > 0) | (ends[:, 0] > 0)
        a, b = self.profile[is_border], ends[is_border]
        distances = measure_to_segments(places, a, b).min(axis=1)
        # Crossings of the line towards greater radii.
        y = places[:, 1, np.newaxis]
        crosses = (a[:, 1] <= y) != (b[:, 1] <= y)
        with np.errstate(all="ignore"):
            x = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
        is_inside = (crosses & (x > radii[:, np.newaxis])).sum(axis=1) % 2 == 1
        return np.asarray(np.where(is_inside, -distances, distances))


@dataclass(frozen=True, eq=False)
class Plate:
    """The box from 0 to `size` (3,), with round holes along z: rows x, y, radius (n, 3)."""

    size: Array
    holes: Array

    def measure(self, points: Array) -> Array:
        width, depth, height = self.size
        corners = np.array([[0, 0], [width, 0], [width, depth], [0, depth]])
        to_rim = measure_to_segments(points[:, :2], corners, np.roll(corners, -1, axis=0))
        from_axes = np.linalg.norm(points[:, np.newaxis, :2] - self.holes[:, :2], axis=2)
        to_holes = from_axes - self.holes[:, 2]
        flat = np.minimum(to_rim.min(axis=1), np.abs(to_holes).min(axis=1))
        is_inside = ((points[:, :2] >= 0) & (points[:, :2] <= [width, depth])).all(axis=1)
        is_inside &= (to_holes >= 0).all(axis=1)
        beside = np.where(is_inside, -flat, flat)
        above = np.abs(points[:, 2] - height / 2) - height / 2
        outside = np.hypot(np.maximum(beside, 0.0), np.maximum(above, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(beside, above), 0.0))


@dataclass(frozen=True, eq=False)
class Hollow:
    """A solid with voids, which are solids strictly inside of it and apart from each other."""

    solid: Form
    voids: Sequence[Form]

    def measure(self, points: Array) -> Array:
        every = [self.solid.measure(points), *(-void.measure(points) for void in self.voids)]
        nearest = np.abs(every).min(axis=0)
        is_inside = (np.array(every) < 0).all(axis=0)
        return np.asarray(np.where(is_inside, -nearest, nearest))


@dataclass(frozen=True, eq=False)
class Several:
    """Solids that are apart from each other."""

    solids: Sequence[Form]

    def measure(self, points: Array) -> Array:
        every = np.array([solid.measure(points) for solid in self.solids])
        nearest = np.abs(every).min(axis=0)
        return np.asarray(np.where((every < 0).any(axis=0), -nearest, nearest))


@dataclass(frozen=True, eq=False)
class Moved:
    """A solid after a map (4, 4) that keeps all angles: it may turn, mirror, scale and move."""

    solid: Form
    matrix: Array

    def measure(self, points: Array) -> Array:
        scale = abs(float(np.linalg.det(self.matrix[:3, :3]))) ** (1 / 3)
        turn = self.matrix[:3, :3] / scale
        return np.asarray(scale * self.solid.measure((points - self.matrix[:3, 3]) @ turn / scale))


def measure_to_segments(points: Array, starts: Array, ends: Array) -> Array:
    """Distances (m, n) of points (m, 2) from segments (n, 2)."""
    along = ends - starts
    offset = points[:, np.newaxis] - starts
    share = (offset * along).sum(axis=2) / (along * along).sum(axis=1)
    rest = offset - np.clip(share, 0, 1)[..., np.newaxis] * along
    return np.asarray(np.sqrt((rest * rest).sum(axis=2)))


def trace_rays(
    form: Form, rays: tuple[Array, Array], lengths: Array, step: float
) -> tuple[Index, Array]:
    """The crossings of rays with the surface of a solid, by steps no longer than the distance.

    Rays are origins and directions (m, 3), followed over `lengths` (m,) in space. Returns the ray
    (n,) and the parameter (n,) of each crossing. Two crossings that are nearer to each other than
    `step` may be missed, and those of rays that run beside a surface for more than `STEPS` steps.
    """
    origins, directions = rays
    speed = np.linalg.norm(directions, axis=1)
    t, before = np.zeros(len(origins)), form.measure(origins)
    found: list[tuple[Index, Array]] = [(np.zeros(0, np.intp), np.zeros(0))]
    active = np.arange(len(origins))
    for _ in range(STEPS):
        if not len(active):
            break
        # No crossing is nearer than the distance: the next step ends on the same side, or nearby.
        move = np.maximum(np.abs(before[active]), step)
        after = t[active] + move / speed[active]
        value = form.measure(origins[active] + after[:, np.newaxis] * directions[active])
        has_crossed = (value < 0) != (before[active] < 0)
        some = active[has_crossed]
        if len(some):
            ends = t[some], after[has_crossed]
            found.append((some, _bisect(form, (origins[some], directions[some]), ends)))
        t[active], before[active] = after, value
        active = active[after * speed[active] < lengths[active]]
    ray, crossings = (np.concatenate(each) for each in zip(*found, strict=True))
    return ray, crossings


def _bisect(form: Form, rays: tuple[Array, Array], ends: tuple[Array, Array]) -> Array:
    """The parameters (m,) at which rays cross a surface, between two on different sides."""
    origins, directions = rays
    low, high = ends
    is_inside = form.measure(origins + low[:, np.newaxis] * directions) < 0
    for _ in range(60):
        middle = (low + high) / 2
        is_before = (form.measure(origins + middle[:, np.newaxis] * directions) < 0) == is_inside
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    return np.asarray((low + high) / 2)
