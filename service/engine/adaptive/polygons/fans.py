"""Convex polygons cut into triangles, all of one number of corners at once.

A polygon of few corners is cut in the best of all its ways; one of more loses its best ear, again
and again. Best is what keeps the triangles near the surface, then well shaped. The surface over a
leaf is thought of as quadratic (`Verdict.form`), which says how far it is from a triangle without
looking at it again. No triangle has three places in a line.
"""

from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.adaptive.cutting.estimate import NEARLY, highest

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
    count, many = corners.shape
    if count > ALL:
        return _ears(corners, x, y, points, form)
    triangles, found = ways(count)
    first, second, third = triangles.T
    tips = [(x[k], y[k], points[k]) for k in (first, second, third)]
    costs = _costs(tips, form)
    total = costs[found[:, 0]]
    for column in found.T[1:]:
        total += costs[column]
    best = np.argmax(total * NEARLY <= total.min(axis=0), axis=0)
    chosen = triangles[found[best]].reshape(-1, 3)
    polygon = np.repeat(np.arange(many), count - 2)
    return corners[chosen, polygon[:, np.newaxis]], polygon


_Tip: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]
"""Places x and y (K, m), and positions (K, 3, m)."""


def _costs(tips: list[_Tip], form: FloatArray) -> FloatArray:
    """What triangles cost, (K, m): r⁴ + a share of how much worse than the best their shape is.

    r is the deviation over what is allowed; the shape of a triangle is Σ e² / (4 √3 A), with its
    sides e and its area A, and 1 at best. By Heron's formula
    16 A² = 4 e_0² e_1² − (e_0² + e_1² − e_2²)².
    """
    steps = [(q[0] - p[0], q[1] - p[1]) for p, q in pairwise([*tips, tips[0]])]
    heights = [form[3] * dx * dx + 2.0 * form[4] * dx * dy + form[5] * dy * dy for dx, dy in steps]
    one, two, three = (_squared(q[2] - p[2]) for p, q in pairwise([*tips, tips[0]]))
    ratio = highest(*heights) / form[6]
    ratio *= ratio
    total, short = one + two + three, one + two - three
    area = np.sqrt(np.maximum(0.75 * (4.0 * one * two - short * short), 0.0)) * 2.0
    shape = total / np.maximum(area, total / WORST + np.finfo(float).tiny)
    return np.where(_turn(steps), ratio * ratio + SHAPE * shape, WORST * WORST)


def _turn(steps: list[tuple[FloatArray, FloatArray]]) -> Bools:
    """Whether triangles with these steps turn to the left: they are no line."""
    left: Bools = steps[0][0] * steps[1][1] > steps[1][0] * steps[0][1]
    return left


def _squared(steps: FloatArray) -> FloatArray:
    """Squared lengths (K, m) of steps (K, 3, m)."""
    squared: FloatArray = steps[:, 0] ** 2 + steps[:, 1] ** 2 + steps[:, 2] ** 2
    return squared


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
        rows = np.roll(left, 1, axis=0), left, np.roll(left, -1, axis=0)
        tips = [(x[k, here], y[k, here], np.moveaxis(points[k, :, here], -1, 1)) for k in rows]
        costs = _costs(tips, form)
        strict = costs < WORST * WORST
        # A triangle with more corners on its sides keeps the three that make it one.
        lonely = (
            (strict.sum(axis=0) == 3) & np.roll(strict, 1, axis=0) & np.roll(strict, -1, axis=0)
        )
        costs[lonely | ~strict] = np.inf
        best = np.argmax(costs * NEARLY <= costs.min(axis=0), axis=0)
        found.append(np.array([corners[k[best, here], here] for k in rows]))
        keep = np.arange(size)[:, np.newaxis] != best
        left = left.T[keep.T].reshape(many, size - 1).T
    found.append(corners[left, here])
    triangles = np.stack(found)  # (n−2, 3, m)
    return triangles.transpose(2, 0, 1).reshape(-1, 3), np.repeat(here, count - 2)
