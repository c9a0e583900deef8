"""Curves in space from curves in the parameters of a surface: S(c(t)).

Along a parameter the curve in space is exact.
"""

from collections.abc import Sequence
from math import isclose

import numpy as np

from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.fitting import fit_pcurves
from service.decoders.cad.splines import (
    find_domain,
    project_points,
    reverse,
    segment,
    segment_surface,
)
from service.decoders.iges.sides import Side

GOAL = 1e-7
"""Curves are fitted up to this share of the surface's size."""

POLE = 1e-9
"""A side that is no longer than this share of the surface's size is a pole."""

LEVEL = 1e-12
"""A line whose ends differ in one parameter by at most this share of the domain is level."""


def fit_sides(surface: Surface, pcurves: Sequence[Curve]) -> list[Side]:
    """The sides of a face along curves of parameters."""
    goal = GOAL * find_size(surface)
    level = [find_level_image(surface, pcurve) for pcurve in pcurves]
    fits = iter(
        fit_pcurves(
            surface,
            [own for own, image in zip(pcurves, level, strict=True) if image is None],
            goal,
        )
    )
    sides = []
    for pcurve, image in zip(pcurves, level, strict=True):
        if image is None:
            fit = next(fits)
            sides.append(Side(fit.curve, pcurve, fit.error))
        else:
            points = project_points(image.points)
            is_pole = float(np.ptp(points, axis=0).max()) <= POLE * find_size(surface)
            sides.append(Side(None if is_pole else image, pcurve))
    return sides


def list_borders(surface: Surface) -> list[Side]:
    """The four sides of a whole surface, counter-clockwise."""
    (u0, u1), (v0, v1) = ((float(knots[0]), float(knots[-1])) for knots in surface.knots)
    corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
    knots = np.array([0.0, 0.0, 1.0, 1.0])
    nets = zip(corners, [*corners[1:], corners[0]], strict=True)
    lines = [Curve(1, knots, np.array([(*first, 1.0), (*last, 1.0)])) for first, last in nets]
    return fit_sides(surface, lines)


def find_size(surface: Surface) -> float:
    """The longest side of the box around the control points of a surface."""
    points = project_points(surface.points).reshape(-1, 3)
    return float(np.ptp(points, axis=0).max())


def find_level_image(surface: Surface, pcurve: Curve) -> Curve | None:
    """The curve of space along a line of parameters of which one is constant; None for others.

    It has the direction of the line and the same domain up to an affine map.
    """
    if pcurve.degree > 1 or len(pcurve.points) > 2:
        return None
    (u0, v0), (u1, v1) = project_points(pcurve.points).tolist()
    for axis, (first, last), (start, end) in ((0, (u0, u1), (v0, v1)), (1, (v0, v1), (u0, u1))):
        size = float(np.ptp(surface.knots[axis]))
        if isclose(first, last, rel_tol=0.0, abs_tol=LEVEL * size) and start != end:
            level = find_level_curve(surface, axis, first)
            low, high = find_domain(level)
            slack = 1e-6 * (high - low)
            if min(start, end) < low - slack or max(start, end) > high + slack:
                return None
            piece = segment(level, max(low, min(start, end)), min(high, max(start, end)))
            return piece if start < end else reverse(piece)
    return None


def find_level_curve(surface: Surface, axis: int, value: float) -> Curve:
    """The curve of a surface along which the parameter of an axis has a value."""
    low, high = float(surface.knots[axis][0]), float(surface.knots[axis][-1])
    value = min(max(value, low), high)
    end = 0 if value - low <= high - value else -1
    if low < value < high:
        ends = (value, high) if end == 0 else (low, value)
        surface = segment_surface(surface, axis, *ends)
    other = 1 - axis
    return Curve(
        surface.degrees[other],
        surface.knots[other],
        np.ascontiguousarray(surface.points.take(end, axis=axis)),
    )
