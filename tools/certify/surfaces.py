"""Families of random surfaces, each a function of a seed, the same in every run."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import cos, pi, sin, sqrt
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from oracles import triangles
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.knots import Knots

Array: TypeAlias = NDArray[np.float64]
Random: TypeAlias = np.random.Generator
Surface: TypeAlias = BezierSurface | BsplineSurface | TriangleSurface

MODERATE, WILD = 0.1, 0.35
"""The largest distances in x and in y of control points from a regular grid over the unit
square."""


@dataclass(frozen=True)
class Family:
    """A family of random surfaces, of which `make certify` judges `count`.

    If `has_no_area`, triangles without area are allowed. If `is_flat`, two triangles are enough for
    a mesh by tolerance.
    """

    build: Callable[[Random], Surface]
    count: int
    has_no_area: bool = False
    is_flat: bool = False

    def surface(self, seed: int) -> Surface:
        """The surface that the family builds from this seed."""
        return self.build(np.random.default_rng(seed))


def scatter_points(
    rng: Random, rows: int, columns: int, spread: float, height: float = 0.5
) -> Array:
    """Random points (rows, columns, 3) near a regular grid over the unit square.

    They differ from the grid by at most `spread` in x and y, and by at most `height` in z.
    """
    x, y = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    flat = np.stack([x, y, np.zeros_like(x)], axis=-1)
    reach = np.array([spread, spread, height])
    net: Array = flat + reach * rng.uniform(-1, 1, flat.shape)
    return net


def bicubic(seed: int, spread: float) -> Array:
    """A random bicubic net (4, 4, 3)."""
    return scatter_points(np.random.default_rng(seed), 4, 4, spread)


def _draw_degrees(rng: Random, maximum: int) -> tuple[int, int]:
    """Two random degrees from 1 to `maximum`."""
    p, q = rng.integers(1, maximum, size=2, endpoint=True).tolist()
    return p, q


def _draw_weights(rng: Random, shape: tuple[int, ...], maximum: float) -> Array:
    """Weights from 1/maximum to maximum, whose logarithms are uniformly distributed."""
    return maximum ** rng.uniform(-1, 1, shape)


def _build_bicubic(rng: Random, spread: float, size: float = 1.0) -> Surface:
    return BezierSurface(size * scatter_points(rng, 4, 4, spread))


def _build_any_degree(rng: Random) -> Surface:
    """A Bézier patch of degrees 1 to 8 with control points near a regular grid."""
    p, q = _draw_degrees(rng, 8)
    return BezierSurface(scatter_points(rng, p + 1, q + 1, 0.4 / max(p, q)))


def _build_anywhere(rng: Random) -> Surface:
    """A Bézier patch of degrees 1 to 8 with control points anywhere in a cube."""
    p, q = _draw_degrees(rng, 8)
    return BezierSurface(rng.uniform(-1, 1, (p + 1, q + 1, 3)))


def _build_rational(rng: Random) -> Surface:
    """A rational patch with weights from 1/5 to 5."""
    p, q = _draw_degrees(rng, 5)
    return BezierSurface(
        scatter_points(rng, p + 1, q + 1, rng.choice([MODERATE, WILD])),
        _draw_weights(rng, (p + 1, q + 1), 5.0),
    )


def _build_heavy_weights(rng: Random) -> Surface:
    """A rational patch with weights from 1/1000 to 1000."""
    p, q = _draw_degrees(rng, 4)
    return BezierSurface(
        scatter_points(rng, p + 1, q + 1, MODERATE), _draw_weights(rng, (p + 1, q + 1), 1e3)
    )


def _build_high_degree(rng: Random) -> Surface:
    """A Bézier patch of degree 9, 12 or 15 along u, and 1, 3 or 15 along v."""
    p, q = int(rng.choice([9, 12, 15])), int(rng.choice([1, 3, 15]))
    return BezierSurface(scatter_points(rng, p + 1, q + 1, 0.02, 0.3))


def _build_spline(rng: Random, max_weight: float = 1.0) -> Surface:
    """A B-spline with weights from 1/`max_weight` to `max_weight`; without weights if it is 1."""
    p, q = _draw_degrees(rng, 4)
    rows, columns = p + int(rng.integers(1, 6)), q + int(rng.integers(1, 6))
    names: list[Knots] = ["clamped", "uniform"]
    u, v = rng.integers(0, 2, 2).tolist()
    net = scatter_points(rng, rows, columns, 0.3 / max(rows, columns), 0.3)
    net_weights = None if max_weight == 1.0 else _draw_weights(rng, (rows, columns), max_weight)
    return BsplineSurface(net, (p, q), (names[u], names[v]), net_weights)


def _build_creases(rng: Random) -> Surface:
    """A B-spline with knots at random distances, some of them repeated as often as the degree."""
    p, q = _draw_degrees(rng, 3)
    knots: list[Knots] = []
    counts: list[int] = []
    for degree in (p, q):
        inner_knots = np.cumsum(rng.choice([0.01, 0.5, 1.0, 3.0], size=rng.integers(1, 4)))
        times = rng.integers(1, degree, size=len(inner_knots), endpoint=True)
        axis_knots = np.concatenate(
            [
                np.zeros(degree + 1),
                np.repeat(inner_knots, times),
                np.full(degree + 1, inner_knots[-1] + rng.uniform(0.1, 2)),
            ]
        )
        knots.append(axis_knots)
        counts.append(len(axis_knots) - degree - 1)
    net = scatter_points(rng, counts[0], counts[1], 0.3 / max(counts), 0.3)
    net_weights = _draw_weights(rng, (counts[0], counts[1]), 3.0) if rng.integers(2) else None
    return BsplineSurface(net, (p, q), (knots[0], knots[1]), net_weights)


def _build_ring(rng: Random) -> Surface:
    """A B-spline that is closed along u, with a random profile; sometimes closed along v too."""
    p, q = _draw_degrees(rng, 3)
    rows, columns = int(rng.integers(max(4, p + 1), 8)), int(rng.integers(max(4, q + 1), 8))
    is_torus = bool(rng.integers(2))
    around = 2 * pi * np.arange(rows) / rows
    across = 2 * pi * np.arange(columns) / columns
    turn = np.stack([np.cos(around), np.sin(around), np.zeros(rows)], axis=-1)[:, np.newaxis]
    radius = (2 + np.cos(across) if is_torus else np.full(columns, 1.0))[:, np.newaxis]
    rise = (np.sin(across) if is_torus else np.linspace(0, 3, columns))[:, np.newaxis]
    net = turn * radius + rise * np.array([0.0, 0, 1])
    net = net + rng.uniform(-0.2, 0.2, net.shape)
    net_weights = _draw_weights(rng, (rows, columns), 2.0) if rng.integers(2) else None
    return BsplineSurface(
        net, (p, q), ("periodic", "periodic" if is_torus else "clamped"), net_weights
    )


def _build_spike(rng: Random) -> Surface:
    """A B-spline of 20 × 20 control points, all but one of them in a plane."""
    x, y = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 20), indexing="ij")
    net = np.stack([x, y, np.zeros_like(x)], axis=-1)
    i, j = rng.integers(2, 18, size=2)
    net[i, j, 2] = 10 ** rng.uniform(-1.5, 0.3)
    degree = int(rng.choice([2, 3]))
    return BsplineSurface(net, (degree, degree))


def _build_ridges(rng: Random) -> Surface:
    """Waves in a random direction; the surface is straight in the other direction."""
    rows, columns = int(rng.integers(12, 24)), int(rng.integers(4, 10))
    x, y = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    slope = rng.uniform(-0.5, 0.5)
    z = 0.1 * np.sin(2 * pi * (rng.uniform(1, 3) * x + slope * y) + rng.uniform(0, 6))
    return BsplineSurface(np.stack([x, y, z], axis=-1))


def _corner_grid(degree: int) -> Array:
    """The control points of a flat triangle in the order of its net, with x = s and y = t."""
    return np.array([(j, k, 0.0) for _, j, k in triangles.keys(degree)]) / degree


def _build_triangle(rng: Random) -> Surface:
    """A triangular patch of degree 1 to 6."""
    n = int(rng.integers(1, 6, endpoint=True))
    net = _corner_grid(n)
    reach = np.array([1.0, 1.0, 0]) * rng.choice([0.3, 1.0]) / n + np.array([0, 0, 0.5])
    return TriangleSurface(net + reach * rng.uniform(-1, 1, net.shape))


def _build_rational_triangle(rng: Random) -> Surface:
    """A rational triangular patch of degree 1 to 4, with weights up to 5 or up to 100."""
    n = int(rng.integers(1, 4, endpoint=True))
    net = _corner_grid(n)
    points = net + np.array([0.3, 0.3, 0.5]) / n * rng.uniform(-1, 1, net.shape)
    return TriangleSurface(points, _draw_weights(rng, (len(net),), float(rng.choice([5.0, 100.0]))))


def _build_poles(rng: Random) -> Surface:
    """A patch with one or two sides that are collapsed to a point."""
    p, q = _draw_degrees(rng, 5)
    net = scatter_points(rng, p + 1, q + 1, MODERATE)
    for side in rng.choice(["u0", "u1", "v0", "v1"], size=rng.integers(1, 3), replace=False):
        _collapse(net, side, net[0, 0] if side.endswith("0") else net[-1, -1])
    weights = _draw_weights(rng, (p + 1, q + 1), 3.0) if rng.integers(2) else None
    return BezierSurface(net, weights)


def _collapse(net: Array, side: str, point: Array) -> None:
    """Sets all control points of a side of the net to one point."""
    line = 0 if side.endswith("0") else -1
    if side.startswith("u"):
        net[line] = point
    else:
        net[:, line] = point


def _build_almost_degenerate(rng: Random) -> Surface:
    """A patch with a side that is almost a point, or a patch that is almost a line."""
    p, q = _draw_degrees(rng, 4)
    net = scatter_points(rng, p + 1, q + 1, MODERATE)
    small = 10 ** rng.uniform(-9, -2)
    if rng.integers(2):
        net[0] = net[0, 0] + small * (net[0] - net[0, 0])
    else:
        net[..., 1] *= small
        net[..., 2] *= 10 ** rng.uniform(-9, 0)
    return BezierSurface(net)


def _build_folded(rng: Random) -> Surface:
    """A patch with two equal sides, which are opposite or meet at a corner."""
    p, q = _draw_degrees(rng, 5)
    if rng.integers(2):
        # With degree 1 the patch would return along the same points, without an area.
        net = scatter_points(rng, max(p, 2) + 1, q + 1, WILD)
        net[-1] = net[0]
    else:
        net = scatter_points(rng, p + 1, p + 1, WILD)
        net[0, :] = net[:, 0]
    return BezierSurface(net)


def _build_cusped(rng: Random) -> Surface:
    """A patch with points where partials vanish, reverse their direction, or are parallel."""
    # Each pair of degrees is used by half; one pair would be enough, but gives other surfaces.
    p, q = max(_draw_degrees(rng, 5)[0], 2), max(_draw_degrees(rng, 5)[1], 2)
    net = scatter_points(rng, p + 1, q + 1, MODERATE)
    kind = rng.integers(4)
    if kind == 0:
        # The partial along u vanishes on the side u = 0.
        net[1] = net[0]
    elif kind == 1:
        # Both partials vanish at a corner.
        net[0, 1] = net[1, 0] = net[0, 0]
    elif kind == 2:
        # The second row and the last but one change their order along u; for p = 2 they are one.
        net[[1, -2]] = net[[-2, 1]] + (net[[-2, 1]] - net[[1, -2]])
    else:
        # On the side v = 0, the partial along v has the direction of the partial along u at u = 0.
        net[:, 1] = net[:, 0] + 0.3 * (net[1:2, :1] - net[:1, :1])
    return BezierSurface(net)


def _build_line(rng: Random) -> Surface:
    """A degenerate patch whose points are all on a line, or on a curve."""
    p, q = _draw_degrees(rng, 4)
    net = scatter_points(rng, p + 1, q + 1, WILD)
    if rng.integers(2):
        net[..., 1:] = net[..., :1] * rng.uniform(-1, 1, 2)
    else:
        net[:] = net[:, :1]
    return BezierSurface(net)


QUARTER = np.array([[1.0, 0], [1, 1], [0, 1]])
QUARTER_WEIGHTS = np.array([1.0, sqrt(0.5), 1.0])
"""Control points and weights of a quarter of the unit circle."""


def _build_quadric(rng: Random) -> Surface:
    """An exact quarter of a cone, cylinder, torus or sphere, stretched along the axes.

    A profile of points (r, z) turns about the z axis.
    """
    small, great = rng.uniform(0.2, 1), rng.uniform(1.2, 3)
    kind = rng.integers(4)
    # Without a change, the profile is that of a sphere.
    profile = QUARTER * small
    weights = QUARTER_WEIGHTS
    if kind == 0:  # cylinder
        profile, weights = np.array([[small, 0], [small, great]]), np.ones(2)
    elif kind == 1:  # cone
        profile, weights = np.array([[0.0, 0], [small, great]]), np.ones(2)
    elif kind == 2:  # torus
        profile = profile + np.array([great, 0])
    turn = np.column_stack([QUARTER, np.ones(3)])
    net = np.stack([turn * np.array([r, r, z]) for r, z in profile.tolist()], axis=1)
    stretch = rng.uniform(0.5, 2, 3)
    return BezierSurface(net * stretch, QUARTER_WEIGHTS[:, np.newaxis] * weights)


def _build_flat_patch(rng: Random) -> Surface:
    """A patch in a plane with four straight sides and random inner control points."""
    p, q = _draw_degrees(rng, 6)
    corners = np.array([[0, 0], [0.2, 1], [1, -0.1], [0.9, 0.8]]) + rng.uniform(-0.1, 0.1, (4, 2))
    uv = rng.uniform(0, 1, (p + 1, q + 1, 2))
    uv[[0, -1], :, 0] = np.array([[0.0], [1]])
    uv[:, [0, -1], 1] = np.array([0.0, 1])
    u, v = uv[..., :1], uv[..., 1:]
    flat = (1 - u) * ((1 - v) * corners[0] + v * corners[1])
    flat = flat + u * ((1 - v) * corners[2] + v * corners[3])
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    return BezierSurface(flat @ axes)


def _build_flat_spline(rng: Random) -> Surface:
    """A flat B-spline of many spans."""
    p = int(rng.integers(1, 4))
    # From 4 to 15 rows and columns; `arange` rounds a float up.
    x, y = np.meshgrid(*(np.arange(n) for n in rng.uniform(4, 15, 2)), indexing="ij")
    return BsplineSurface(np.stack([x, y, 0 * x], axis=-1), (p, p))


def _build_far_away(rng: Random) -> Surface:
    """A patch or a triangle of size 1, about 10^6 away from the origin."""
    shift = 1e6 * rng.uniform(-1, 1, 3)
    is_triangle = rng.choice([0, 1])
    if is_triangle:
        return TriangleSurface(_corner_grid(3) + rng.uniform(-0.2, 0.2, (10, 3)) + shift)
    return BezierSurface(
        scatter_points(rng, 4, 4, MODERATE) + shift, _draw_weights(rng, (4, 4), 2.0)
    )


def _build_strip(rng: Random) -> Surface:
    """A narrow strip along a helix."""
    rows = int(rng.integers(10, 18))
    around = np.linspace(0, rng.uniform(3, 9), rows)
    line = np.stack([np.cos(around), np.sin(around), 0.1 * around], axis=-1)
    width = np.array([0.0, 0, 10 ** rng.uniform(-3, -0.5)])
    lean = np.array([[cos(a), sin(a), 0] for a in rng.uniform(0, 6, rows)]) * width[2]
    return BsplineSurface(np.stack([line, line + width, line + lean], axis=1), (3, 2))


FAMILIES: Mapping[str, Family] = MappingProxyType(
    {
        "bicubic, moderate": Family(lambda rng: _build_bicubic(rng, MODERATE), 60),
        "bicubic, wild": Family(lambda rng: _build_bicubic(rng, WILD), 60),
        "degrees 1 to 8": Family(_build_any_degree, 80),
        "degrees 1 to 8, anywhere": Family(_build_anywhere, 60),
        "rational": Family(_build_rational, 80),
        "rational, weights to 1000": Family(_build_heavy_weights, 40),
        "degree 15": Family(_build_high_degree, 20),
        "B-splines": Family(_build_spline, 80),
        "NURBS": Family(lambda rng: _build_spline(rng, 5.0), 60),
        "creases": Family(_build_creases, 60),
        "rings and tori": Family(_build_ring, 40),
        "spikes": Family(_build_spike, 60),
        "sine ridges": Family(_build_ridges, 40),
        "winding strips": Family(_build_strip, 20),
        "triangles": Family(_build_triangle, 60),
        "rational triangles": Family(_build_rational_triangle, 40),
        "poles": Family(_build_poles, 40),
        "almost degenerate": Family(_build_almost_degenerate, 40),
        "folded": Family(_build_folded, 30),
        "cusped": Family(_build_cusped, 40),
        "lines and curves": Family(_build_line, 10, has_no_area=True),
        "quadrics": Family(_build_quadric, 30),
        "flat": Family(_build_flat_patch, 20, is_flat=True),
        "flat B-splines": Family(_build_flat_spline, 10, is_flat=True),
        "bilinear": Family(lambda rng: BezierSurface(rng.uniform(-1, 1, (2, 2, 3))), 10),
        "far away": Family(_build_far_away, 30),
        "tiny": Family(lambda rng: _build_bicubic(rng, MODERATE, 1e-6), 10),
        "vast": Family(lambda rng: _build_bicubic(rng, WILD, 1e6), 10),
    }
)
"""The families by name; together they have somewhat more than 1000 surfaces."""
