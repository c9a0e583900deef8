"""Exact cylinder, cone, sphere and torus as rational Bézier patches.

A polynomial curve cannot be an arc of a circle, but a rational quadratic curve can: a quarter of
the unit circle has the control points (1, 0), (1, 1), (0, 1) and the weights 1, √½, 1 (Piegl and
Tiller, The NURBS Book, 2nd ed., section 7.3; surfaces of revolution: section 8.5). All surfaces
here are closed surfaces of revolution about the z axis, and their normals du × dv point outwards.
"""

from math import sqrt
from typing import TypeAlias

import numpy as np

from service.surface.patches import PatchSurface

Point: TypeAlias = tuple[float, float, float, float]
"""x, y, z, weight."""

Patch: TypeAlias = list[list[Point]]
"""Rows of control points: axis 0 along u, axis 1 along v."""

ARC = ((1.0, 0.0, 1.0), (1.0, 1.0, sqrt(0.5)), (0.0, 1.0, 1.0))
"""Quarter of the unit circle, counter-clockwise from (1, 0): x, y, weight."""


def sphere(radius: float = 1.0) -> PatchSurface:
    """Sphere about the origin: 4 × 2 octants of degree (2, 2), u eastwards, v northwards."""
    south = [(x * radius, -y * radius, w) for x, y, w in reversed(ARC)]
    north = [(x * radius, y * radius, w) for x, y, w in ARC]
    return assemble("sphere", [("sphere", revolve(south) + revolve(north))])


def torus(radius: float = 1.0, tube: float = 0.4) -> PatchSurface:
    """Torus of 4 × 4 patches of degree (2, 2).

    `radius` is the radius of the circle in the middle of the tube, `tube` the radius of the tube.
    """
    patches: list[Patch] = []
    for quarter in range(4):
        arc = [turn(x, y, w, quarter) for x, y, w in ARC]
        patches += revolve([(radius + tube * x, tube * z, w) for x, z, w in arc])
    return assemble("torus", [("torus", patches)])


def cylinder(radius: float = 1.0, height: float = 2.0) -> PatchSurface:
    """Cylinder from z = -height/2 to height/2: a side and two caps of degree (2, 1)."""
    half = height / 2
    side = revolve([(radius, -half, 1.0), (radius, half, 1.0)])
    bottom = revolve([(0.0, -half, 1.0), (radius, -half, 1.0)])
    top = revolve([(radius, half, 1.0), (0.0, half, 1.0)])
    return assemble("cylinder", [("side", side), ("top", top), ("bottom", bottom)])


def cone(radius: float = 1.0, height: float = 2.0) -> PatchSurface:
    """Cone from its base at z = -height/2 to the apex at height/2; degree (2, 1)."""
    half = height / 2
    side = revolve([(radius, -half, 1.0), (0.0, half, 1.0)])
    base = revolve([(0.0, -half, 1.0), (radius, -half, 1.0)])
    return assemble("cone", [("side", side), ("base", base)])


def turn(x: float, y: float, w: float, quarter: int) -> tuple[float, float, float]:
    """(x, y) rotated by `quarter` quarter turns, without rounding; and w, unchanged."""
    for _ in range(quarter):
        x, y = -y, x
    return x, y, w


def revolve(profile: list[tuple[float, float, float]]) -> list[Patch]:
    """Four patches of revolution: each has the profile along v, and a quarter turn along u.

    `profile` has a distance from the axis, z and a weight for each control point.
    """
    patches = []
    for quarter in range(4):
        arc = [turn(x, y, w, quarter) for x, y, w in ARC]
        patches.append([[(x * r, y * r, z, a * w) for r, z, w in profile] for x, y, a in arc])
    return patches


def assemble(name: str, parts: list[tuple[str, list[Patch]]]) -> PatchSurface:
    """One surface of named parts, in which equal points are one vertex."""
    numbers: dict[Point, int] = {}
    grids: list[list[list[int]]] = []
    members: list[tuple[str, tuple[int, ...]]] = []
    for title, patches in parts:
        first = len(grids)
        # A dictionary treats −0 and 0 as equal keys, so that they are one vertex.
        grids += [
            [[numbers.setdefault(point, len(numbers)) for point in row] for row in patch]
            for patch in patches
        ]
        members.append((title, tuple(range(first, len(grids)))))
    table = np.array(list(numbers))
    return PatchSurface(table[:, :3], np.array(grids), table[:, 3], tuple(members), "z", name)
