"""Meshes for tests of distances, and distances computed in whole numbers."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from service.bases.arrays import AnyArray, FloatArray

Sheet: TypeAlias = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]


def build_sheet(sheet: Sheet, rows: int, columns: int) -> FloatArray:
    """Triangles (t, 3, 3) through points of a surface over the unit square."""
    u, v = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    points = np.stack(sheet(u, v), axis=-1)
    corners = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    a, b, c, d = (corner.reshape(-1, 3) for corner in corners)
    return np.concatenate([np.stack([a, b, d], axis=1), np.stack([b, c, d], axis=1)])


def wave(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A wavy surface."""
    return u, v, 0.3 * np.sin(3 * u) * np.cos(4 * v)


def saddle(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A saddle; meshes of it have valleys."""
    return u, v, u * u - v * v


def globe(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The unit sphere; the triangles at its poles are segments."""
    around, up = 2 * np.pi * u, np.pi * v
    return np.cos(around) * np.sin(up), np.sin(around) * np.sin(up), np.cos(up)


def sample_triangles(corners: FloatArray, count: int, seed: int = 0) -> FloatArray:
    """Random points (count, 3) of triangles."""
    rng = np.random.default_rng(seed)
    chosen = corners[rng.integers(0, len(corners), count)]
    weights = rng.dirichlet([0.7, 0.7, 0.7], count)
    points: FloatArray = (chosen * weights[..., np.newaxis]).sum(axis=1)
    return points


def measure_exactly(points: FloatArray, corners: FloatArray) -> FloatArray:
    """The distances (m, t) of points (m, 3) from triangles (t, 3, 3), in whole numbers.

    Only the last division and the square root are rounded.
    """
    unit = min(_find_unit(points), _find_unit(corners))
    exact, vertices = _to_integers(points, unit), _to_integers(corners, unit)
    columns = []
    for triangle in vertices:
        sides = [(triangle[k], triangle[(k + 1) % 3]) for k in range(3)]
        normal = np.cross(sides[0][1] - sides[0][0], sides[1][1] - sides[1][0])
        squares = [_measure_segment(exact, *side) for side in sides]
        if size := normal @ normal:
            is_inside = np.ones(len(points), np.bool_)
            for begin, end in sides:
                is_inside &= np.cross(end - begin, exact - begin) @ normal >= 0
            height = (exact - triangle[0]) @ normal
            squares.append(np.where(is_inside, height * height / size, np.inf))
        columns.append(np.sqrt(np.min(squares, axis=0).astype(np.float64)))
    distances: FloatArray = np.ldexp(np.stack(columns, axis=1), unit)
    return distances


def _measure_segment(points: AnyArray, begin: AnyArray, end: AnyArray) -> AnyArray:
    """Squares of the distances of points from a segment."""
    way, first, last = end - begin, points - begin, points - end
    size, along = way @ way, first @ way
    squares = np.minimum((first * first).sum(axis=1), (last * last).sum(axis=1)) / 1
    if size:
        across = np.cross(first, way)
        is_beside = (along >= 0) & (along <= size)
        squares = np.where(is_beside, (across * across).sum(axis=1) / size, squares)
    result: AnyArray = squares
    return result


def _find_unit(values: FloatArray) -> int:
    """The exponent of a power of two of which all values are multiples."""
    return int(np.frexp(values[values != 0])[1].min(initial=1100)) - 53


def _to_integers(values: FloatArray, unit: int) -> AnyArray:
    """Values as multiples of 2^unit."""
    parts, exponents = np.frexp(values)
    shifts = np.where(values == 0, 0, exponents - 53 - unit)
    whole = np.ldexp(parts, 53).astype(np.int64).astype(object)
    integers: AnyArray = whole * 2 ** shifts.astype(object)
    return integers
