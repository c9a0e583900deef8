"""Points of round tubes and of ribbons, by definitions that share no code with the engine.

The curve is evaluated by SciPy's B-splines. A tube is the union of all circles about points of the
curve, perpendicular to it. So no frame needs to be minimised: any two unit vectors perpendicular to
the tangent span the same circle. Corners, caps and straight pieces are added as
`docs/surfaces.md` defines them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, radians
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Array: TypeAlias = NDArray[np.float64]

SMOOTH, MITRED, STRAIGHT = 1e-6, radians(90), 1e-9
"""Turns up to the first, in radians, are no corners, and up to the second mitred ones. A piece is
straight if its directions differ by at most the third."""


@dataclass(frozen=True)
class Path:
    """A curve as a function: points and unit tangents at parameters of its pieces."""

    spline: BSpline
    breaks: Array
    is_rational: bool
    is_closed: bool

    @staticmethod
    def of(curve: Any) -> "Path":
        """The path of a Bézier or B-spline curve of the service."""
        points = np.asarray(curve.control_points, dtype=np.float64)
        points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
        degree = curve.degree
        weights = np.ones(len(points)) if curve.weights is None else np.asarray(curve.weights)
        if hasattr(curve, "knot_vector"):
            knots = np.asarray(curve.knot_vector, dtype=np.float64)
            if curve.periodic:
                points = np.concatenate([points, points[:degree]])
                weights = np.concatenate([weights, weights[:degree]])
        else:
            knots = np.repeat([0.0, 1.0], degree + 1)
        net = np.column_stack([points * weights[:, None], weights])
        low, high = knots[degree], knots[-degree - 1]
        breaks = np.unique(knots[(knots >= low) & (knots <= high)])
        spline = BSpline(knots, net, degree, extrapolate=False)
        ends = [spline(t)[:3] / spline(t)[3] for t in (low, high)]
        size = float(np.ptp(points, axis=0).max())
        is_closed = float(np.abs(ends[0] - ends[1]).max()) <= 1e-13 * size
        return Path(spline, breaks, curve.weights is not None, is_closed)

    def sample(self, piece: int, count: int) -> tuple[Array, Array, Array]:
        """Parameters (m,), points (m, 3) and unit tangents (m, 3) of one piece, ends included.

        Parameters cluster at both ends.
        """
        low, high = self.breaks[piece : piece + 2]
        share = (1 - np.cos(pi * np.linspace(0, 1, count))) / 2
        t = low + (high - low) * share
        # Tangents at ends are limits from inside.
        inside = np.clip(t, low + 1e-9 * (high - low), high - 1e-9 * (high - low))
        value, slope = self.spline(t), self.spline.derivative()(inside)
        points = value[:, :3] / value[:, 3:]
        velocity = slope[:, :3] - points * slope[:, 3:]
        return t, points, velocity / np.linalg.norm(velocity, axis=1, keepdims=True)


def sample_tube(surface: Any, along: int = 120, around: int = 96) -> Array:
    """Points of a round tube with its corners and caps, (N, 3).

    `along` is the number of samples of each Bézier piece, and of each corner.
    """
    path, parts = Path.of(surface.curve), []
    phi = 2 * pi * (np.arange(around) + 0.37) / around
    pieces = [path.sample(k, along) for k in range(len(path.breaks) - 1)]
    radii = [_evaluate(surface.radius, path, t) for t, _, _ in pieces]
    is_ruled = [_is_straight(d) and _is_linear(surface, path) for _, _, d in pieces]
    closed = path.is_closed and surface.radius[0] == surface.radius[-1]
    corners = list(_find_corners(pieces, closed=closed))
    planes = {}
    for before, after in corners:
        a, b = pieces[before][2][-1], pieces[after][2][0]
        turn = 2 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b))
        point, radius = pieces[after][1][0], radii[after][0]
        if turn > MITRED:
            axis = np.cross(a, b)
            if np.linalg.norm(axis) < 1e-6:
                axis = _find_perpendicular(a)
            axis /= np.linalg.norm(axis)
            turned = np.cross(axis, a)
            angles = np.linspace(0, turn, along)[:, None]
            directions = np.cos(angles) * a + np.sin(angles) * turned
            parts.append(point + radius * _circle(directions, phi))
        elif turn > SMOOTH:
            planes[before, 1] = planes[after, 0] = (a + b) / np.linalg.norm(a + b)
    for k, (_, points, directions) in enumerate(pieces):
        rings = _circle(directions, phi)
        leans = [
            radii[k][end] * _lean(rings[end], directions[end], planes.get((k, -end)))
            for end in (0, -1)
        ]
        offsets = radii[k][:, None, None] * rings
        if is_ruled[k]:
            chord = points[-1] - points[0]
            share = ((points - points[0]) @ chord / (chord @ chord))[:, None]
            lean = (1 - share) * leans[0] + share * leans[1]
            parts.append(points[:, None] + offsets + lean[..., None] * directions[:, None])
            continue
        parts.append(points[:, None] + offsets)
        for end in (0, -1):
            share = np.linspace(0, 1, 9)[:, None]
            more = (share * leans[end])[..., None] * directions[end]
            parts.append(points[end] + offsets[end] + more)
    if surface.caps and not closed:
        for piece, end in ((0, 0), (-1, -1)):
            _, points, directions = pieces[piece]
            share = np.linspace(0, 1, 30)[:, None, None]
            ring = radii[piece][end] * _circle(directions[[end]], phi)
            parts.append(points[end] + share * ring)
    return np.concatenate([part.reshape(-1, 3) for part in parts])


def sample_ribbon(surface: Any, along: int = 400, across: int = 33) -> Array:
    """Points (N, 3) of a ribbon along a smooth curve."""
    path, parts = Path.of(surface.curve), []
    share = np.linspace(-0.5, 0.5, across)
    for k in range(len(path.breaks) - 1):
        t, points, directions = path.sample(k, along)
        width = _evaluate(surface.width, path, t)
        facing = surface.facing if surface.camera is None else surface.camera - points
        bars = np.cross(facing, directions)
        bars /= np.linalg.norm(bars, axis=1, keepdims=True)
        offsets = (width[:, None] * share)[..., None] * bars[:, None]
        parts.append((points[:, None] + offsets).reshape(-1, 3))
    return np.concatenate(parts)


def _find_corners(pieces: list[Any], *, closed: bool) -> Iterator[tuple[int, int]]:
    """The pieces before and after each joint."""
    for k in range(1, len(pieces)):
        yield k - 1, k
    if closed:
        yield len(pieces) - 1, 0


def _evaluate(coefficients: Array, path: Path, t: Array) -> Array:
    """Values of a Bézier function over the domain of the path."""
    degree = len(coefficients) - 1
    share = (t - path.breaks[0]) / (path.breaks[-1] - path.breaks[0])
    knots = np.repeat([0.0, 1.0], degree + 1)
    values: Array = BSpline(knots, np.asarray(coefficients, dtype=np.float64), degree)(share)
    return values


def _is_straight(directions: Array) -> bool:
    return float(np.abs(directions - directions[0]).max()) <= STRAIGHT


def _is_linear(surface: Any, path: Path) -> bool:
    """Whether the radius is linear along straight pieces."""
    radius = np.asarray(surface.radius)
    is_line = path.spline.k == 1 and not path.is_rational and len(radius) <= 2
    return is_line or bool((radius == radius[0]).all())


def _circle(directions: Array, phi: Array) -> Array:
    """Unit vectors (m, n, 3) perpendicular to unit vectors (m, 3)."""
    first = np.array([_find_perpendicular(d) for d in directions])
    second = np.cross(directions, first)
    ring: Array = np.cos(phi)[:, None] * first[:, None] + np.sin(phi)[:, None] * second[:, None]
    return ring


def _find_perpendicular(direction: Array) -> Array:
    axis = np.eye(3)[np.abs(direction).argmin()]
    normal = np.cross(direction, axis)
    unit: Array = normal / np.linalg.norm(normal)
    return unit


def _lean(ring: Array, direction: Array, plane: Array | None) -> Array:
    """How far vectors (n, 3) are moved along a direction to the plane with a normal: (n,)."""
    if plane is None:
        return np.zeros(len(ring))
    lean: Array = -(ring @ plane) / (direction @ plane)
    return lean
