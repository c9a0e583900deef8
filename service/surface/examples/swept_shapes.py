"""Example surfaces that are swept along curves: a trefoil knot, a ribbon and a hair."""

import numpy as np

from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.sweeps import RibbonSurface, TubeSurface


def trefoil(points: int = 24) -> BsplineCurve:
    """A trefoil knot: a closed cubic B-spline whose control points lie on this smooth curve.

    (sin t + 2 sin 2t, cos t − 2 cos 2t, −sin 3t), t from 0 to 2π
    """
    t = 2 * np.pi * np.arange(points) / points
    x, y = np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t)
    # Three decimals: the last digits of sines depend on the machine.
    polygon = np.stack([x, y, -np.sin(3 * t)], axis=1).round(3)
    return BsplineCurve(polygon, 3, "periodic")


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
