"""Placements of many copies at once: points, normals, scalings and bounds of rounding errors.

Every number is computed by the operations of `service.engine.scenes.placing` in their order, so a
copy has the same bits whether it is placed alone or with others.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints, RealArray
from service.bases.row_batches import row_runs
from service.engine.scenes.placing import (
    COPY_ERROR,
    SINGULAR_VALUE_ERROR,
    TRANSLATION_ERROR,
)
from service.engine.vectors import normalize
from service.surface.lowered import PlacedModel

BATCH_POINTS = 1 << 17
"""Points of copies that are placed at once, unless a single copy has more."""


@dataclass(frozen=True, eq=False, slots=True)
class Placements:
    """The placements of N copies.

    Attributes
    ----------
    matrices : ndarray of float64, shape (N, 4, 4)
        The identity for copies without a matrix.
    is_moved, is_mirrored : ndarray of bool, shape (N,)
        Whether a copy has a matrix, and whether this mirrors.
    least, most : ndarray of float64, shape (N,)
        Bounds of the scaling of lengths, as those of `scalings`.
    """

    matrices: FloatArray
    is_moved: Bools
    is_mirrored: Bools
    least: FloatArray
    most: FloatArray


def stack_placements(copies: Sequence[PlacedModel]) -> Placements:
    """The placements of all copies as arrays."""
    count = len(copies)
    matrices = np.broadcast_to(np.eye(4), (count, 4, 4)).copy()
    moved = [number for number, copy in enumerate(copies) if copy.matrix is not None]
    is_moved, is_mirrored = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    least, most = np.ones(count), np.ones(count)
    if moved:
        is_moved[moved] = True
        matrices[moved] = np.array([copies[number].matrix for number in moved])
        linear = np.ascontiguousarray(matrices[moved, :3, :3])
        is_mirrored[moved] = np.linalg.det(linear) < 0
        scalings = np.linalg.svd(linear, compute_uv=False)
        slack = SINGULAR_VALUE_ERROR * scalings[:, 0]
        least[moved] = np.maximum(scalings[:, 2] - slack, 0.0)
        most[moved] = scalings[:, 0] + slack
    return Placements(matrices, is_moved, is_mirrored, least, most)


def bound_placing_errors(
    copies: Sequence[PlacedModel], placements: Placements, distances: Sequence[float]
) -> FloatArray:
    """The bounds of `bound_placing_error` for all copies, (N,).

    `distances[k]` is the largest distance from 0 of a point of model k.
    """
    errors = np.zeros(len(copies))
    for number, (copy, most) in enumerate(zip(copies, placements.most.tolist(), strict=True)):
        distance = distances[copy.model]
        if copy.chain is not None:
            levels, stretch, reach = copy.chain
            errors[number] = COPY_ERROR * levels * (stretch * distance + reach)
        elif copy.matrix is not None:
            shift = hypot(*copy.matrix[:3, 3].tolist())
            errors[number] = COPY_ERROR * most * distance + TRANSLATION_ERROR * shift
    return errors


def find_distance(low: FloatArray, high: FloatArray) -> float:
    """The largest distance from 0 of a point between these bounds."""
    return hypot(*np.maximum(np.abs(low), np.abs(high)).tolist())


def list_copies(copies: Sequence[PlacedModel], count: int) -> list[Ints]:
    """For each of `count` models the numbers of its copies, in order."""
    numbers = np.array([copy.model for copy in copies], np.intp)
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.cumsum(np.bincount(numbers, minlength=count))[:-1])


def batch_copies(count: int, points: int) -> Iterator[slice]:
    """Slices of `count` copies, each of this number of points, that are placed at once."""
    step = max(1, BATCH_POINTS // max(1, points))
    return (slice(begin, end) for begin, end in row_runs(count, step))


def place_copies_of_points(points: RealArray, matrices: FloatArray) -> FloatArray:
    """Points (V, 3) after each of the placements (n, 4, 4): (n, V, 3)."""
    placed = _multiply(points, matrices[:, :3, :3])
    placed += matrices[:, np.newaxis, :3, 3]
    return placed


def place_copies_of_normals(normals: RealArray, matrices: FloatArray) -> FloatArray:
    """Unit normals (V, 3) after each of the placements (n, 4, 4): (n, V, 3)."""
    linear = matrices[:, :3, :3]
    linear = linear / np.abs(linear).max(axis=(1, 2), keepdims=True)
    a, b, c = linear.swapaxes(0, 1)
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    cofactors[(a * cofactors[:, 0]).sum(axis=1) < 0] *= -1
    cofactors /= np.abs(cofactors).max(axis=(1, 2), keepdims=True)
    return normalize(_multiply(normals, cofactors), -1)


def find_extents(points: FloatArray, matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and greatest coordinates, (n, 3) each, of points (V, 3) after n placements."""
    x, y, z = np.ascontiguousarray(points.T)
    lows, highs = np.empty((len(matrices), 3)), np.empty((len(matrices), 3))
    for axis in range(3):
        line = matrices[:, axis, :, np.newaxis]
        row = line[:, 0] * x + line[:, 1] * y + line[:, 2] * z
        row += line[:, 3]
        lows[:, axis], highs[:, axis] = row.min(axis=1), row.max(axis=1)
    return lows, highs


def _multiply(vectors: RealArray, linear: FloatArray) -> FloatArray:
    """L x for every vector x of (V, 3) and every L of (n, 3, 3)."""
    x, y, z = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    product = np.empty((len(linear), len(vectors), 3))
    for axis in range(3):
        line = linear[:, axis, :, np.newaxis]
        product[..., axis] = line[:, 0] * x + line[:, 1] * y + line[:, 2] * z
    return product
