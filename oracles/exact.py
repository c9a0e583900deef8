"""Bézier surfaces in exact rational arithmetic, by de Casteljau's algorithm alone.

A float is a rational number. So the points and partials of a net of floats at a rational parameter
are rational numbers too, and this module computes them without rounding. The length of a normal is
not rational; it is computed with 50 digits.

Farin, Curves and Surfaces for CAGD, 5th ed., chapters 4 (de Casteljau), 13 (rational curves) and
14 (tensor products).
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias

import mpmath
import numpy as np

Vector: TypeAlias = tuple[Fraction, ...]
Row: TypeAlias = list[Vector]
Net: TypeAlias = list[Row]

DIGITS = 50


class Jet(NamedTuple):
    """A point of a surface and its two first partials, each of three coordinates."""

    point: Vector
    du: Vector
    dv: Vector


def to_exact_net(points: Any, weights: Any = None) -> Net:
    """The net as fractions; with weights as homogeneous points, (wx, wy, wz, w)."""
    net = _to_fractions(*_to_cache_key(points))
    if weights is None:
        return [[*row] for row in net]
    point_weights = _to_fractions(
        *_to_cache_key(np.asarray(weights, dtype=np.float64)[..., np.newaxis])
    )
    return [
        [_to_homogeneous(point, w) for point, (w,) in zip(row, ws, strict=True)]
        for row, ws in zip(net, point_weights, strict=True)
    ]


def _to_cache_key(values: Any) -> tuple[bytes, tuple[int, ...]]:
    array = np.ascontiguousarray(values, dtype=np.float64)
    return array.tobytes(), array.shape


@lru_cache(maxsize=256)
def _to_fractions(content: bytes, shape: tuple[int, ...]) -> Net:
    """An array (n, m, k), given by its bytes and shape, as fractions.

    Cached, because tests evaluate the same net at many parameters.
    """
    rows = np.frombuffer(content).reshape(shape).tolist()
    return [[tuple(map(Fraction, point)) for point in row] for row in rows]


def _to_homogeneous(point: Vector, weight: Fraction) -> Vector:
    return (*(weight * x for x in point), weight)


def list_parameters(resolution: int) -> list[Fraction]:
    """The parameters i/resolution, i = 0 … resolution."""
    return [Fraction(i, resolution) for i in range(resolution + 1)]


def curve_point(points: Sequence[Vector], t: Fraction) -> Vector:
    """De Casteljau: b_i ← (1 − t) b_i + t b_{i+1} until one point is left.

    The computation uses integers over one common denominator, which is faster than fractions and
    gives the same result.
    """
    scale = math.lcm(*(x.denominator for point in points for x in point))
    rows = [[x.numerator * (scale // x.denominator) for x in point] for point in points]
    first_factor, second_factor = t.denominator - t.numerator, t.numerator
    while len(rows) > 1:
        rows = [
            [first_factor * x + second_factor * y for x, y in zip(a, b, strict=True)]
            for a, b in pairwise(rows)
        ]
    scale *= t.denominator ** (len(points) - 1)
    return tuple(Fraction(x, scale) for x in rows[0])


def surface_point(net: Net, u: Fraction, v: Fraction) -> Vector:
    """S(u, v): each row evaluated at v, then the curve through the results evaluated at u."""
    return curve_point([curve_point(row, v) for row in net], u)


def bilinear_point(net: Net, u: Fraction, v: Fraction) -> Vector:
    """S(u, v) by another order of de Casteljau: a step in u and a step in v alternate.

    When one of the degrees is used up, the remaining steps are those of a curve.
    """
    while len(net) > 1 and len(net[0]) > 1:
        net = [
            [
                _interpolate(_interpolate(a[j], a[j + 1], v), _interpolate(b[j], b[j + 1], v), u)
                for j in range(len(a) - 1)
            ]
            for a, b in pairwise(net)
        ]
    if len(net) > 1:
        return curve_point([row[0] for row in net], u)
    return curve_point(net[0], v)


def _interpolate(a: Vector, b: Vector, t: Fraction) -> Vector:
    return tuple((1 - t) * x + t * y for x, y in zip(a, b, strict=True))


def transpose(net: Net) -> Net:
    """The net with u and v exchanged."""
    return [list(column) for column in zip(*net, strict=True)]


def hodograph(net: Net) -> Net:
    """Net of the partial along u: p (P_{i+1,j} − P_ij), p the degree."""
    degree = len(net) - 1
    return [
        [
            tuple(degree * (y - x) for x, y in zip(p, q, strict=True))
            for p, q in zip(a, b, strict=True)
        ]
        for a, b in pairwise(net)
    ]


def jets(net: Net, us: Sequence[Fraction], vs: Sequence[Fraction]) -> list[list[Jet]]:
    """Points and first partials on the grid us × vs; a homogeneous net is projected."""
    grids = [
        _grid(net, us, vs),
        _grid(hodograph(net), us, vs),
        transpose(_grid(hodograph(transpose(net)), vs, us)),
    ]
    return [
        [project(*values) for values in zip(*rows, strict=True)]
        for rows in zip(*grids, strict=True)
    ]


def _grid(net: Net, us: Sequence[Fraction], vs: Sequence[Fraction]) -> Net:
    """Values of a tensor-product polynomial on the grid us × vs, not projected."""
    grid = []
    for u in us:
        curve = [curve_point(column, u) for column in transpose(net)]
        grid.append([curve_point(curve, v) for v in vs])
    return grid


def project(value: Vector, du: Vector, dv: Vector) -> Jet:
    """The point and partials of S = X/w from the point and partials of the homogeneous (X, w).

    Quotient rule: S_u = (X_u − w_u S)/w. Values of three coordinates are returned unchanged.
    """
    if len(value) == 3:
        return Jet(value, du, dv)
    *spatial, w = value
    point = tuple(x / w for x in spatial)
    first, second = (
        tuple((x - d[3] * s) / w for x, s in zip(d[:3], point, strict=True)) for d in (du, dv)
    )
    return Jet(point, first, second)


def second_jet(net: Net, u: Fraction, v: Fraction) -> list[Vector]:
    """S, S_u, S_v, S_uu, S_uv, S_vv at (u, v); a homogeneous net is projected."""
    return project_partials(
        [
            _evaluate_partial(net, i, j, u, v)
            for i, j in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        ]
    )


def project_partials(x: list[Vector]) -> list[Vector]:
    """S, S_u, S_v, S_uu, S_uv, S_vv from the same partials of the homogeneous form X = w S.

    They follow from the product rule, for example X_uv = w S_uv + w_u S_v + w_v S_u + w_uv S.
    Values of three coordinates are returned unchanged.
    """
    if len(x[0]) == 3:
        return x
    w = [value[3] for value in x]
    s = [tuple(c / w[0] for c in x[0][:3])]
    s += [_divide_by_weight(x[k], w[0], [(w[k], s[0])]) for k in (1, 2)]
    s.append(_divide_by_weight(x[3], w[0], [(2 * w[1], s[1]), (w[3], s[0])]))
    s.append(_divide_by_weight(x[4], w[0], [(w[1], s[2]), (w[2], s[1]), (w[4], s[0])]))
    s.append(_divide_by_weight(x[5], w[0], [(2 * w[2], s[2]), (w[5], s[0])]))
    return s


def _divide_by_weight(x: Vector, w: Fraction, terms: list[tuple[Fraction, Vector]]) -> Vector:
    """(x − Σ factor · vector) / w, in three coordinates; `terms` are pairs (factor, vector)."""
    return tuple((x[k] - sum(f * vector[k] for f, vector in terms)) / w for k in range(3))


def _evaluate_partial(net: Net, i: int, j: int, u: Fraction, v: Fraction) -> Vector:
    """∂^{i+j}/∂u^i ∂v^j of the polynomial at (u, v), not projected."""
    if i >= len(net) or j >= len(net[0]):
        return (Fraction(0),) * len(net[0][0])
    for _ in range(i):
        net = hodograph(net)
    net = transpose(net)
    for _ in range(j):
        net = hodograph(net)
    return surface_point(transpose(net), u, v)


def curvatures(net: Net, u: Fraction, v: Fraction) -> tuple[mpmath.mpf, ...]:
    """Curvatures at a regular point: Gaussian, mean, larger and smaller principal; 50 digits."""
    return compute_curvatures(second_jet(net, u, v))


def compute_curvatures(jet: Sequence[Vector]) -> tuple[mpmath.mpf, ...]:
    """Gaussian, mean, larger and smaller principal curvature, by the two fundamental forms.

    `jet` is S, S_u, S_v, S_uu, S_uv, S_vv.
    """
    _, du, dv, duu, duv, dvv = jet
    n = cross(du, dv)
    squared_length = dot(n, n)
    e, f, g = (dot(second, n) for second in (duu, duv, dvv))
    gauss = (e * g - f * f) / squared_length**2
    trace = (e * dot(dv, dv) - 2 * f * dot(du, dv) + g * dot(du, du)) / squared_length
    with mpmath.workdps(DIGITS):
        k, h = _to_mpf(gauss), _to_mpf(trace) / (2 * mpmath.sqrt(_to_mpf(squared_length)))
        spread = mpmath.sqrt(max(h * h - k, mpmath.mpf(0)))
        return k, h, h + spread, h - spread


def _to_mpf(x: Fraction) -> mpmath.mpf:
    return mpmath.mpf(x.numerator) / x.denominator


def dot(a: Vector, b: Vector) -> Fraction:
    """A · b."""
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def cross(a: Vector, b: Vector) -> Vector:
    """A × b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def is_flat(triangle: Any) -> bool:
    """Whether the area of a triangle, three corners of floats, is exactly zero."""
    a, b, c = ([Fraction(x) for x in corner] for corner in np.asarray(triangle).tolist())
    edges = [tuple(y - x for x, y in zip(a, p, strict=True)) for p in (b, c)]
    return not any(cross(edges[0], edges[1]))


def normalize(vector: Vector) -> tuple[float, float, float]:
    """The unit vector of this direction, computed with 50 digits and rounded once."""
    with mpmath.workdps(DIGITS):
        x, y, z = map(_to_mpf, vector)
        length = mpmath.sqrt(x * x + y * y + z * z)
        return float(x / length), float(y / length), float(z / length)


def positions(points: Any, weights: Any, resolution: tuple[int, int]) -> np.ndarray:
    """Points S(i/Ru, j/Rv), each coordinate rounded once; shape (Ru+1, Rv+1, 3)."""
    net = to_exact_net(points, weights)
    grid = jets(net, list_parameters(resolution[0]), list_parameters(resolution[1]))
    return np.array([[[float(x) for x in jet.point] for jet in row] for row in grid])


def normals(points: Any, weights: Any, resolution: tuple[int, int]) -> np.ndarray:
    """Unit normals at the samples, NaN where du × dv is exactly zero; shape (Ru+1, Rv+1, 3)."""
    net = to_exact_net(points, weights)
    grid = jets(net, list_parameters(resolution[0]), list_parameters(resolution[1]))
    undefined = (math.nan,) * 3
    directions = [[cross(jet.du, jet.dv) for jet in row] for row in grid]
    return np.array([[normalize(n) if any(n) else undefined for n in row] for row in directions])


def split(points: Any, t: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """The nets of the two parts of a patch, below and above u = t, by de Casteljau.

    The parts share their common row bit for bit, because it is computed only once. The computation
    is in floating point; with t = 1/2 and coordinates of few bits it is exact.
    """
    below, above = [], []
    rows = np.asarray(points, dtype=float)
    while len(rows):
        below.append(rows[0])
        above.append(rows[-1])
        rows = (1 - t) * rows[:-1] + t * rows[1:]
    return np.array(below), np.array(above[::-1])
