"""Convex polygons cut into triangles, all of one number of corners at once.

A polygon of few corners is cut in the best of all its ways; one of more loses its best ear, again
and again. Best is what keeps the triangles near the surface, then well shaped. The surface over a
leaf is thought of as quadratic (`Verdict.form`), which says how far it is from a triangle without
looking at it again. No triangle has three places in a line.
"""

from functools import lru_cache

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.estimate import NEARLY, highest
from service.engine.adaptive.vectors import cross, dot, length

ALL = 7
"""Up to so many corners all ways are tried: 42 with seven."""

SHAPE = 0.02
"""What a bad shape costs, against a deviation of all that is allowed, which costs 1."""

WORST = 1e9
"""What a triangle costs that has no area."""


@lru_cache(maxsize=ALL)
def ways(corners: int) -> tuple[Ints, Ints]:
    """All triangles of a convex polygon, and all ways to cut it into some of them.

    Returns
    -------
    triangles : ndarray of int, shape (K, 3)
        Corners, rising: i < j < k.
    ways : ndarray of int, shape (W, corners − 2)
        Rows of the first; W is a Catalan number.
    """
    triangles = [
        (i, j, k)
        for i in range(corners)
        for j in range(i + 1, corners)
        for k in range(j + 1, corners)
    ]
    number = {triangle: row for row, triangle in enumerate(triangles)}

    def between(i: int, k: int) -> list[list[int]]:
        if k - i < 2:
            return [[]]
        return [
            [*left, number[i, j, k], *right]
            for j in range(i + 1, k)
            for left in between(i, j)
            for right in between(j, k)
        ]

    found = np.array(triangles), np.array(between(0, corners - 1))
    for table in found:
        table.flags.writeable = False
    return found


def cut(
    corners: Ints, x: FloatArray, y: FloatArray, points: FloatArray, form: FloatArray
) -> tuple[Ints, Ints]:
    """Triangles of m convex polygons of n corners each.

    Parameters
    ----------
    corners : ndarray of int, shape (n, m)
        Counter-clockwise. Their numbers are what comes out again.
    x, y : ndarray of float64, shape (n, m)
        Their places, the leaf being [0, 1]²: equal where places are.
    points : ndarray of float64, shape (n, 3, m)
    form : ndarray of float64, shape (7, m)
        See `Verdict`.

    Returns
    -------
    triangles : ndarray of int, shape (m (n−2), 3)
    polygon : ndarray of int, shape (m (n−2),)
        Which polygon they are of, rising.
    """
    count = len(corners)
    if count > ALL:
        return _ears(corners, x, y, points, form)
    triangles, found = ways(count)
    costs = np.stack([_cost(x[list(t)], y[list(t)], points[list(t)], form) for t in triangles])
    totals = []
    for way in found:
        total = costs[way[0]]
        for triangle in way[1:]:
            total = total + costs[triangle]
        totals.append(total)
    total = np.stack(totals)
    best = np.argmax(total * NEARLY <= total.min(axis=0), axis=0)
    chosen = triangles[found[best]]  # (m, n−2, 3)
    polygon = np.repeat(np.arange(corners.shape[1]), count - 2)
    flat = chosen.reshape(-1, 3)
    return corners[flat, polygon[:, np.newaxis]], polygon


def _cost(x: FloatArray, y: FloatArray, points: FloatArray, form: FloatArray) -> FloatArray:
    """What triangles (3, m) cost: r⁴ + a share of what their shape is worse than the best one's.

    r is the deviation over what is allowed; the shape of a triangle is Σ e² / (4 √3 A), with its
    sides e and its area A, and 1 at best.
    """
    heights, squares = [], []
    for i, k in ((0, 1), (1, 2), (2, 0)):
        dx, dy = x[k] - x[i], y[k] - y[i]
        heights.append(form[3] * dx * dx + 2.0 * form[4] * dx * dy + form[5] * dy * dy)
        side = points[k] - points[i]
        squares.append(dot(side, side))
    ratio = highest(*heights) / form[6]
    ratio *= ratio
    area = length(cross(points[1] - points[0], points[2] - points[0])) * 2.0 * np.sqrt(3.0)
    total = squares[0] + squares[1] + squares[2]
    shape = total / np.maximum(area, total / WORST + np.finfo(float).tiny)
    return np.where(turns(x, y), ratio * ratio + SHAPE * shape, WORST * WORST)


def turns(x: FloatArray, y: FloatArray) -> Bools:
    """Whether three places (3, m) each turn to the left: they are no line."""
    left: Bools = (x[1] - x[0]) * (y[2] - y[0]) > (x[2] - x[0]) * (y[1] - y[0])
    return left


def _ears(
    corners: Ints, x: FloatArray, y: FloatArray, points: FloatArray, form: FloatArray
) -> tuple[Ints, Ints]:
    """Triangles of polygons that lose one corner after another."""
    count, many = corners.shape
    here = np.arange(many)
    left = np.tile(np.arange(count)[:, np.newaxis], (1, many))
    found = []
    while len(left) > 3:
        size = len(left)
        before, after = np.roll(left, 1, axis=0), np.roll(left, -1, axis=0)
        costs, strict = np.empty((size, many)), np.empty((size, many), dtype=bool)
        for i in range(size):
            three = np.stack([before[i], left[i], after[i]])
            own_x, own_y = x[three, here], y[three, here]
            strict[i] = turns(own_x, own_y)
            costs[i] = _cost(own_x, own_y, points[three, :, here].transpose(0, 2, 1), form)
        # A triangle with more corners on its sides keeps the three that make it one.
        lonely = (
            (strict.sum(axis=0) == 3) & np.roll(strict, 1, axis=0) & np.roll(strict, -1, axis=0)
        )
        costs[lonely | ~strict] = np.inf
        best = np.argmax(costs * NEARLY <= costs.min(axis=0), axis=0)
        three = np.stack([before[best, here], left[best, here], after[best, here]])
        found.append(corners[three, here])
        keep = np.arange(size)[:, np.newaxis] != best
        left = left.T[keep.T].reshape(many, size - 1).T
    found.append(corners[left, here])
    triangles = np.stack(found)  # (n−2, 3, m)
    return triangles.transpose(2, 0, 1).reshape(-1, 3), np.repeat(here, count - 2)
