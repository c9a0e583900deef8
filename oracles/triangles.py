"""Triangular Bézier surfaces in exact rational arithmetic, by de Casteljau's algorithm.

A net is a dictionary {(i, j, k): point}. Farin, Curves and Surfaces for CAGD, 5th ed., chapters 17
and 18. Only `keys` depends on the order in which the service stores a net.
"""

import math
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from oracles.exact import Jet, Vector, cross, normalize, project, project_partials

Key: TypeAlias = tuple[int, int, int]
Triangle: TypeAlias = dict[Key, Vector]


def keys(degree: int) -> list[Key]:
    """(i, j, k) in the order of the service: k outermost, then j, both rising."""
    return [(degree - j - k, j, k) for k in range(degree + 1) for j in range(degree + 1 - k)]


def find_degree(count: int) -> int:
    """The degree of a net of `count` points."""
    return next(n for n in range(count) if (n + 1) * (n + 2) == 2 * count)


def to_exact_triangle(points: Any, weights: Any = None) -> Triangle:
    """The net as fractions; with weights as homogeneous points, (wx, wy, wz, w)."""
    rows = [tuple(Fraction(float(x)) for x in point) for point in points]
    if weights is not None:
        ws = [Fraction(float(w)) for w in weights]
        rows = [(*(w * x for x in row), w) for row, w in zip(rows, ws, strict=True)]
    return dict(zip(keys(find_degree(len(rows))), rows, strict=True))


def value(net: Triangle, place: Vector) -> Vector:
    """The value of the polynomial at barycentric coordinates `place`, by de Casteljau.

    The computation uses integers over common denominators, which is faster than fractions and gives
    the same result.
    """
    degree = sum(next(iter(net)))
    scale = math.lcm(*(x.denominator for point in net.values() for x in point))
    place_scale = math.lcm(*(x.denominator for x in place))
    r, s, t = (x.numerator * (place_scale // x.denominator) for x in place)
    rows = {
        key: [x.numerator * (scale // x.denominator) for x in point] for key, point in net.items()
    }
    for n in range(degree - 1, -1, -1):
        rows = {
            (i, j, k): [
                r * a + s * b + t * c
                for a, b, c in zip(
                    rows[i + 1, j, k], rows[i, j + 1, k], rows[i, j, k + 1], strict=True
                )
            ]
            for i, j, k in keys(n)
        }
    return tuple(Fraction(x, scale * place_scale**degree) for x in rows[0, 0, 0])


def partial(net: Triangle, axis: int) -> Triangle:
    """Net of the partial along s (`axis` = 1) or t (`axis` = 2), where r = 1 − s − t.

    For s it is n (b_{i,j+1,k} − b_{i+1,j,k}), where n is the degree.
    """
    n = sum(next(iter(net)))
    step = (0, 1, 0) if axis == 1 else (0, 0, 1)
    return {
        (i, j, k): tuple(
            n * (y - x)
            for x, y in zip(
                net[i + 1, j, k], net[i + step[0], j + step[1], k + step[2]], strict=True
            )
        )
        for i, j, k in keys(n - 1)
    }


def jet(net: Triangle, place: Vector) -> Jet:
    """Point and partials along s and t; a homogeneous net is projected."""
    return project(value(net, place), *(value(partial(net, axis), place) for axis in (1, 2)))


def second_jet(net: Triangle, place: Vector) -> list[Vector]:
    """S, S_s, S_t, S_ss, S_st, S_tt at one place; a homogeneous net is projected."""
    zero = (Fraction(0),) * len(value(net, place))
    first = [partial(net, axis) for axis in (1, 2)]
    second = [zero] * 3
    if sum(next(iter(net))) > 1:
        # S_ss, S_st and S_tt: the index of a net in `first`, and the axis of its partial.
        pairs = ((0, 1), (0, 2), (1, 2))
        second = [value(partial(first[i], axis), place) for i, axis in pairs]
    return project_partials([value(net, place), *(value(d, place) for d in first), *second])


def places(divisions: int) -> list[Vector]:
    """Barycentric coordinates of all samples of a triangle, in the order of the service."""
    return [tuple(Fraction(x, divisions) for x in key) for key in keys(divisions)]


def jets(points: Any, weights: Any, divisions: int) -> list[Jet]:
    """Points and first partials at all samples."""
    net = to_exact_triangle(points, weights)
    return [jet(net, place) for place in places(divisions)]


def positions(all_jets: list[Jet]) -> np.ndarray:
    """The points (S, 3) of the jets, each coordinate rounded once."""
    return np.array([[float(x) for x in each.point] for each in all_jets])


def normals(all_jets: list[Jet]) -> np.ndarray:
    """The unit normals (S, 3) of the jets, NaN where ∂s × ∂t is exactly zero."""
    vectors = [cross(each.du, each.dv) for each in all_jets]
    return np.array([normalize(n) if any(n) else (math.nan,) * 3 for n in vectors])


def apply_symmetry(net: np.ndarray, symmetry: int) -> np.ndarray:
    """The net after one of the six symmetries of a triangle; axis 0 of the net is the points.

    Numbers 0 to 5: the net is rotated `symmetry % 3` times, and then reflected if `symmetry` ≥ 3. A
    rotation moves corner r to s, s to t and t to r; the reflection exchanges corners r and s.
    """
    order = keys(find_degree(len(net)))
    row = {key: number for number, key in enumerate(order)}

    def find_source(key: Key) -> Key:
        i, j, k = key
        if symmetry >= 3:
            i, j = j, i
        for _ in range(symmetry % 3):
            i, j, k = j, k, i
        return i, j, k

    return net[[row[find_source(key)] for key in order]]
