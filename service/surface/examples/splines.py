"""Examples of B-splines: hills, a goblet, a ring; and of sweeps: a knot, a ribbon, a hair."""

from math import cos, pi, sin, sqrt

import numpy as np

from service.bases.arrays import FloatArray
from service.surface.bspline import BsplineSurface
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.sweeps import RibbonSurface, TubeSurface

HEIGHTS = (
    (0, 0, 1, 0, 0, -1, 0, 0),
    (0, 1, 2, 1, -1, -2, -1, 0),
    (1, 2, 6, 4, 0, -2, -1, 0),
    (0, 1, 4, 3, 1, 0, 0, 0),
    (0, -1, 0, 1, 3, 4, 1, 0),
    (-1, -3, -2, 0, 4, 7, 3, 1),
    (0, -1, -1, 0, 1, 3, 1, 0),
)
"""Control points of the hills: z in quarters of a unit, at integer x (rows) and y (columns)."""

PROFILE = (
    # The underside, from the middle to the edge of the foot.
    (0.0, 0.0, 1.0),
    (0.3, 0.0, 1.0),
    (0.6, 0.0, 1.0),
    (0.8, 0.0, 1.0),
    # The outside: foot, stem, bowl, up to the rim.
    (0.8, 0.12, 1.0),
    (0.3, 0.14, 1.0),
    (0.12, 0.3, 1.0),
    (0.1, 0.9, 2.0),
    (0.14, 1.2, 1.0),
    (0.6, 1.25, 1.0),
    (0.8, 1.65, 2.0),
    (0.72, 2.1, 1.0),
    (0.62, 2.5, 1.0),
    # The inside, down to the middle.
    (0.66, 2.1, 1.0),
    (0.72, 1.65, 2.0),
    (0.52, 1.36, 1.0),
    (0.25, 1.32, 1.0),
    (0.0, 1.32, 1.0),
)
"""Control points of the goblet's profile: distance from the axis, height, weight."""

PROFILE_KNOTS = (0, 0, 0, 0, 1, 1, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8, 9, 10, 11, 11, 11, 11)
"""Knots of the profile. Triple knots make sharp edges, for example at the foot and the rim."""

CIRCLE = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0))
"""Control points of the unit circle; the four at the corners of the square have the weight √½."""

CIRCLE_KNOTS = (0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4)


def hills() -> BsplineSurface:
    """A uniform bicubic B-spline of 7 × 8 control points, with continuous curvature."""
    rows, columns = np.shape(HEIGHTS)
    x, y = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    net = np.stack([x, y, np.array(HEIGHTS) / 4], axis=-1)
    return BsplineSurface(net, (3, 3), ("uniform", "uniform"), up="z", name="bspline-hills")


def goblet() -> BsplineSurface:
    """Surface of revolution of degree (2, 3): exact circles about the z axis, u eastwards.

    The NURBS Book, 2nd ed., section 8.5, and example 7.1 for the circle of nine control points.
    """
    circle = np.array([(x, y, 1.0 if x * y == 0 else sqrt(0.5)) for x, y in CIRCLE])
    net = np.array([[(x * r, y * r, z) for r, z, _ in PROFILE] for x, y, _ in circle])
    weights = np.multiply.outer(circle[:, 2], np.array(PROFILE)[:, 2])
    return BsplineSurface(
        net, (2, 3), (_knots(CIRCLE_KNOTS), _knots(PROFILE_KNOTS)), weights, "z", "nurbs-goblet"
    )


def ring() -> BsplineSurface:
    """A ring of 10 × 6 control points, periodic in both directions, with five bulges."""
    net = [
        [_on_ring(2 * pi * i / 10, 2 * pi * j / 6, 0.3 + 0.2 * (i % 2)) for j in range(6)]
        for i in range(10)
    ]
    # Rounded: the last digits of sines depend on the machine.
    points = np.round(np.array(net), 3)
    return BsplineSurface(points, (3, 3), ("periodic", "periodic"), up="z", name="bspline-ring")


def _on_ring(angle: float, tube_angle: float, radius: float) -> tuple[float, float, float]:
    """The point on a torus about z with radii 1 and `radius`, at two angles in radians."""
    distance = 1.0 + radius * cos(tube_angle)
    return distance * cos(angle), distance * sin(angle), radius * sin(tube_angle)


def _knots(values: tuple[int, ...]) -> FloatArray:
    return np.array(values, dtype=np.float64)


def trefoil() -> BsplineCurve:
    """A trefoil knot: a closed cubic B-spline whose control points lie on this smooth curve.

    (sin t + 2 sin 2t, cos t − 2 cos 2t, −sin 3t), t from 0 to 2π
    """
    t = 2 * np.pi * np.arange(24) / 24
    x, y = np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t)
    # Three decimals: the last digits of sines depend on the machine.
    return BsplineCurve(np.stack([x, y, -np.sin(3 * t)], axis=1).round(3), 3, "periodic")


def trefoil_tube() -> TubeSurface:
    """A closed tube about the trefoil, watertight and smooth."""
    return TubeSurface(trefoil(), np.array([0.35]), sides=24, up="z", name="trefoil-tube")


def streamer() -> RibbonSurface:
    """A ribbon in waves that faces the direction +z, pointed at both ends."""
    polygon = [(0, 0, 0), (1, 2, 1), (3, -2, 1), (5, 2, -1), (7, -2, -1), (9, 1, 1), (10, 0, 0)]
    curve = BsplineCurve(np.array(polygon, dtype=np.float64), 3, "clamped")
    # Bernstein coefficients along the curve.
    width = np.array([0.0, 0.9, 0.9, 0.9, 0.0])
    return RibbonSurface(curve, width, facing=np.array([0.0, 0.0, 1.0]), name="ribbon")


def curl() -> TubeSurface:
    """A hair, thick at its root and pointed at its tip: one Bézier curve of degree 7."""
    polygon = [
        (0.0, 0.0, 0.0), (0.0, 0.9, 0.0), (1.1, 1.6, 0.0), (1.6, 2.2, 1.5),
        (-1.4, 2.6, 2.0), (-1.6, 3.4, -1.6), (1.8, 3.0, -1.2), (1.2, 2.4, 0.6),
    ]  # fmt: skip
    # Bernstein coefficients along the curve.
    radius = np.array([0.06, 0.06, 0.04, 0.0])
    return TubeSurface(BezierCurve(np.array(polygon)), radius, sides=8, name="hair")
