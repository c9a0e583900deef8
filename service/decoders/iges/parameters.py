"""How the parameters of a surface in a file become those of its spline.

Along a circle the parameter of a file is an angle. An arc of the angle 2 α, as a rational curve of
degree 2 over [0, 1], has at the angle ψ from its middle the parameter

    s = (1 + tan(ψ / 2) / tan(α / 2)) / 2.

So points can be converted, and lines along one of the parameters; other curves can't.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., section 7.3; Farin, Curves and Surfaces for CAGD, 5th
ed., section 12.8.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import tau

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.splines import evaluate, find_domain, project_points

SAMPLES = 17
"""Corners of the polygon of a curve that is not a line."""

LEVEL = 1e-12
"""A line whose ends differ in one parameter by at most this share of the domain is level."""


@dataclass(frozen=True, slots=True)
class ParameterMap:
    """The two parameters of a surface in a file.

    Attributes
    ----------
    scales : tuple of two floats or None
        For each parameter: 0 if it is that of the spline; radians for each unit if it is an angle;
        None if it is near that of the spline, but nothing more is known.
    """

    scales: tuple[float | None, float | None] = (0.0, 0.0)

    def move_into(self, surface: Surface, curves: Sequence[Curve]) -> list[Curve]:
        """The curves of a loop, moved by whole turns along angles to the domain of the surface.

        Some systems count angles from −π, others from 0.
        """
        moved = list(curves)
        for axis, scale in enumerate(self.scales):
            if not scale or not curves:
                continue
            values = np.concatenate([project_points(curve.points)[:, axis] for curve in curves])
            knots = surface.knots[axis]
            turn = tau / scale
            away = (knots[0] + knots[-1] - values.min() - values.max()) / 2
            count = round(float(away) / turn)
            if count:
                moved = [_move(curve, axis, count * turn) for curve in moved]
        return moved

    def map_points(self, surface: Surface, points: FloatArray) -> FloatArray:
        """Parameters (k, 2) of the spline from those of the file."""
        columns = [
            _map_angles(surface.knots[axis], scale, points[:, axis]) if scale else points[:, axis]
            for axis, scale in enumerate(self.scales)
        ]
        return np.stack(columns, axis=1)

    def map_corners(self, surface: Surface, curve: Curve) -> Curve:
        """A polygon of parameters of the spline through points of a curve of parameters."""
        points = evaluate(curve, np.linspace(*find_domain(curve), SAMPLES))
        mapped = np.ones((SAMPLES, 3))
        mapped[:, :2] = self.map_points(surface, points)
        numbers = np.arange(SAMPLES, dtype=np.float64)
        return Curve(1, np.concatenate([numbers[:1], numbers, numbers[-1:]]), mapped)

    def map_curve(self, surface: Surface, curve: Curve) -> Curve | None:
        """A curve of parameters of the spline, or None if it is not known."""
        if self.scales == (0.0, 0.0):
            return curve
        if curve.degree > 1 or len(curve.points) > 2:
            return None
        points = project_points(curve.points)
        sizes = [float(np.ptp(knots)) for knots in surface.knots]
        is_level = np.abs(points[1] - points[0]) <= LEVEL * np.array(sizes)
        if None in self.scales or not is_level.any():
            return None
        mapped = np.ones((2, 3))
        mapped[:, :2] = self.map_points(surface, points)
        return Curve(1, curve.knots, mapped)


def _move(curve: Curve, axis: int, distance: float) -> Curve:
    """A curve of parameters, moved along an axis."""
    points = curve.points.copy()
    points[:, axis] += distance * points[:, 2]
    return Curve(curve.degree, curve.knots, points)


def _map_angles(knots: FloatArray, scale: float, values: FloatArray) -> FloatArray:
    """Parameters of a spline along a circle with these knots, from angles in the file's units."""
    breaks = np.unique(knots)
    span = np.clip(np.searchsorted(breaks, values, side="right") - 1, 0, len(breaks) - 2)
    low, high = breaks[span], breaks[span + 1]
    half = scale * (high - low) / 2
    inside = np.clip(values, breaks[0], breaks[-1])
    angle = scale * (inside - (low + high) / 2)
    share = (1 + np.tan(angle / 2) / np.tan(half / 2)) / 2
    return np.where(values == inside, low + share * (high - low), values)
