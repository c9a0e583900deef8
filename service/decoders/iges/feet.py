"""Parameters of points near a surface, good enough to tell how loops run.

The nearest of a grid of samples is improved by the Gauss–Newton method, whose partials are
differences of points.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., section 6.1.
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Surface
from service.decoders.cad.splines import evaluate_surface, project_points

MAX_SAMPLES = 48
"""The most samples of the grid along one parameter."""

STEPS = 8

DIFFERENCE = 1e-6
"""Step of the differences, as a share of the domain."""

CLOSED = 1e-6
"""Borders that are nearer than this share of the surface's size are equal."""

WIDE = 100.0
"""A closed surface is this many times wider than the gap between its borders; a sliver is not."""


def find_feet(surface: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Parameters (k, 2) of the points of a surface near points (k, 3), and the distances."""
    if surface.degrees == (1, 1) and surface.points.shape[:2] == (2, 2):
        flat = _find_on_plane(surface, points)
        if flat is not None:
            return flat
    u, v = (_choose_samples(surface, axis) for axis in range(2))
    grid_u, grid_v = (axis.ravel() for axis in np.meshgrid(u, v, indexing="ij"))
    grid = evaluate_surface(surface, grid_u, grid_v)
    nearest = np.array([np.square(grid - point).sum(axis=1).argmin() for point in points])
    low = np.array([knots[0] for knots in surface.knots])
    high = np.array([knots[-1] for knots in surface.knots])
    step = DIFFERENCE * (high - low)
    current = np.stack([grid_u[nearest], grid_v[nearest]], axis=1)
    best, least = current, np.full(len(points), np.inf)
    for _ in range(STEPS):
        # Forwards from the current point, or backwards at the end of the domain.
        sign = np.where(current + step > high, -1.0, 1.0) * step
        s, along_u, along_v = (
            evaluate_surface(
                surface, current[:, 0] + a * sign[:, 0], current[:, 1] + b * sign[:, 1]
            )
            for a, b in ((0, 0), (1, 0), (0, 1))
        )
        rest = points - s
        distance = np.sqrt(np.square(rest).sum(axis=1))
        is_better = distance < least
        best = np.where(is_better[:, np.newaxis], current, best)
        least = np.minimum(distance, least)
        du, dv = (along_u - s) / sign[:, :1], (along_v - s) / sign[:, 1:]
        current = np.clip(best + _solve(du, dv, rest), low, high)
    return best, least


def find_periods(surface: Surface) -> tuple[float, float]:
    """For each parameter the length of its domain if the surface is closed there, else 0."""
    net = project_points(surface.points)
    size = float(np.ptp(net.reshape(-1, 3), axis=0).max())
    periods = []
    for axis in range(2):
        first, last = (net.take(end, axis=axis) for end in (0, -1))
        gap = float(np.abs(first - last).max())
        is_closed = gap <= CLOSED * size and bool(
            np.abs(net - np.expand_dims(first, axis)).max() > max(WIDE * gap, CLOSED * size)
        )
        periods.append(float(np.ptp(surface.knots[axis])) if is_closed else 0.0)
    return periods[0], periods[1]


def is_closed_surface(surface: Surface) -> bool:
    """Whether a surface has no border: it is closed, or ends in poles, along both parameters."""
    net = project_points(surface.points)
    size = float(np.ptp(net.reshape(-1, 3), axis=0).max())
    for axis, period in enumerate(find_periods(surface)):
        ends = (net.take(end, axis=axis) for end in (0, -1))
        if not period and any(np.ptp(end, axis=0).max() > CLOSED * size for end in ends):
            return False
    return True


def _choose_samples(surface: Surface, axis: int) -> FloatArray:
    """Parameters of the grid along an axis: several in each span, at most 48."""
    breaks = np.unique(surface.knots[axis])
    each = surface.degrees[axis] * 2 + 1
    count = min(MAX_SAMPLES, (len(breaks) - 1) * each + 1)
    positions = np.linspace(0, len(breaks) - 1, count)
    return np.interp(positions, np.arange(len(breaks)), breaks)


def _find_on_plane(surface: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """The feet on a parallelogram, or None if the surface is no parallelogram."""
    net = project_points(surface.points)
    a, b = net[1, 0] - net[0, 0], net[0, 1] - net[0, 0]
    twist = net[1, 1] - net[1, 0] - b
    if np.abs(twist).max() > CLOSED * np.abs(np.stack([a, b])).max():
        return None
    if np.ptp(surface.points[..., 3]) > 0:
        return None
    rest = points - net[0, 0]
    count = len(points)
    shares = _solve(np.tile(a, (count, 1)), np.tile(b, (count, 1)), rest)
    distance = np.sqrt(np.square(rest - shares[:, :1] * a - shares[:, 1:] * b).sum(axis=1))
    low = np.array([knots[0] for knots in surface.knots])
    width = np.array([np.ptp(knots) for knots in surface.knots])
    return low + shares * width, distance


def _solve(du: FloatArray, dv: FloatArray, rest: FloatArray) -> FloatArray:
    """The steps (k, 2) along partials (k, 3) that make up for distances best, by least squares."""
    uu, uv, vv = ((x * y).sum(axis=1) for x, y in ((du, du), (du, dv), (dv, dv)))
    ur, vr = (du * rest).sum(axis=1), (dv * rest).sum(axis=1)
    determinant = uu * vv - uv * uv
    is_regular = determinant > 1e-12 * uu * vv
    safe = np.where(is_regular, determinant, 1.0)
    both = np.stack([ur * vv - vr * uv, vr * uu - ur * uv], axis=1) / safe[:, np.newaxis]
    # At a pole only one of the parameters moves the point.
    longer = uu >= vv
    size = np.maximum(np.where(longer, uu, vv), 1e-300)
    one = np.where(longer, ur, vr) / size
    single = np.stack([np.where(longer, one, 0.0), np.where(longer, 0.0, one)], axis=1)
    return np.where(is_regular[:, np.newaxis], both, single)
