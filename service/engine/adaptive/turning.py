"""How far normals turn within a cell."""

from dataclasses import dataclass
from math import cos

import numpy as np

from service.bases.arrays import Bools, FloatArray
from service.engine.adaptive.vectors import Vectors, cross, dot, length

NONE = 1e-9
"""Partials whose angle has a sine below this have no normal (at a pole, or along a cusp)."""


@dataclass(frozen=True, eq=False, slots=True)
class Turning:
    """Cells in which normals turn too far, and the direction in which they turn more."""

    exceeds: Bools
    along_v: Bools


def turning(at: list[list[Vectors]], angle: float, grain: FloatArray) -> Turning:
    """Normals of the biquadratic surfaces through nine points of cells, compared in pairs.

    A direction in which the cell is no longer than `grain` is not held against it: at a crease no
    cell is small enough.
    """
    slopes_u = [_slopes(at[0][j], at[1][j], at[2][j]) for j in range(3)]
    slopes_v = [_slopes(at[i][0], at[i][1], at[i][2]) for i in range(3)]
    normals = [[_normal(slopes_u[j][i], slopes_v[i][j]) for j in range(3)] for i in range(3)]
    for j in range(3):
        line = [normals[i][j] for i in range(3)]
        normals[0][j], normals[2][j] = _ends(*line)
    for i in range(3):
        normals[i][0], normals[i][2] = _ends(*normals[i])
    turn_u = np.maximum.reduce(
        [_turn(normals[i][j], normals[k][j]) for j in range(3) for i, k in ((0, 1), (1, 2), (0, 2))]
    )
    turn_v = np.maximum.reduce(
        [_turn(normals[i][j], normals[i][k]) for i in range(3) for j, k in ((0, 1), (1, 2), (0, 2))]
    )
    across = np.maximum(_turn(normals[0][0], normals[2][2]), _turn(normals[2][0], normals[0][2]))
    long_u = np.maximum(length(at[2][0] - at[0][0]), length(at[2][2] - at[0][2]))
    long_v = np.maximum(length(at[0][2] - at[0][0]), length(at[2][2] - at[2][0]))
    turn_u, turn_v = np.where(long_u > grain, turn_u, 0.0), np.where(long_v > grain, turn_v, 0.0)
    across = np.where(np.minimum(long_u, long_v) > grain, across, 0.0)
    most = np.maximum(np.maximum(turn_u, turn_v), across)
    return Turning(most > 1.0 - cos(angle), turn_u < turn_v * (1.0 - 1e-9))


def _slopes(a: Vectors, b: Vectors, c: Vectors) -> tuple[Vectors, Vectors, Vectors]:
    """Derivatives at 0, ½ and 1 of a quadratic curve through three points."""
    return 4.0 * b - 3.0 * a - c, c - a, a + 3.0 * c - 4.0 * b


def _normal(u: Vectors, v: Vectors) -> Vectors:
    """Unit normal; zero where there is none."""
    normal = cross(u, v)
    size = length(normal)
    some = size > NONE * length(u) * length(v)
    return normal * (some / np.where(some, size, 1.0))


def _ends(a: Vectors, b: Vectors, c: Vectors) -> tuple[Vectors, Vectors]:
    """Unit normals at both ends of a line; where one is missing (at a pole), b turned once more."""
    share = 2.0 * dot(a, b), 2.0 * dot(c, b)
    return (
        np.where(dot(a, a) == 0.0, share[1] * b - c, a),
        np.where(dot(c, c) == 0.0, share[0] * b - a, c),
    )


def _turn(a: Vectors, b: Vectors) -> FloatArray:
    """1 − cos of the angle between unit normals; 0 where one is missing."""
    missing = (dot(a, a) == 0.0) | (dot(b, b) == 0.0)
    return np.where(missing, 0.0, 1.0 - dot(a, b))
