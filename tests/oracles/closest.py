"""Closest points by exhaustive search, without the engine's code.

Upper bounds: samples of every sheet, and from the nearest ones a search that moves only to nearer
points, with decreasing steps. Interval bounds: rectangles of parameters over which the control
points of a net, restricted by exact fractions, enclose the patch in a box.
"""

from collections.abc import Sequence
from fractions import Fraction
from heapq import heappop, heappush
from itertools import pairwise
from math import sqrt

import numpy as np
from scipy.spatial import cKDTree

from tests.oracles.exact import Net
from tests.oracles.sheets import Array, Sheet

NEIGHBOURS = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)], dtype=np.float64)


def find_nearest(
    sheets: Sequence[Sheet], points: Array, samples: int = 20_000, starts: int = 3, steps: int = 60
) -> Array:
    """Distances (m,) of `points` (m, 3) to the sheets; upper bounds, near the least distances.

    The search begins at the nearest samples of every sheet, unless another sheet is nearer by four
    times the greatest gap between its samples.
    """
    each = max(200, samples // len(sheets))
    result, gaps = [], []
    for sheet in sheets:
        places = sheet.samples(each)
        at = sheet.at(places)
        tree = cKDTree(at)
        gaps.append(float(tree.query(np.unique(at, axis=0), 2)[0][:, 1].max()))
        result.append((places, *tree.query(points - sheet.origin, starts)))
    best = np.min([distance[:, 0] for _, distance, _ in result], axis=0)
    likely = best.copy()
    for sheet, gap, (places, distance, rows) in zip(sheets, gaps, result, strict=True):
        which = np.flatnonzero(distance[:, 0] <= likely + 4 * gap)
        if len(which):
            x, begin = points[which] - sheet.origin, places[rows[which]]
            least = _zoom_in(sheet, x, begin, sheet.step(each), steps)
            best[which] = np.minimum(best[which], least)
    least_of_all: Array = best
    return least_of_all


def _zoom_in(sheet: Sheet, x: Array, places: Array, step: Array, steps: int) -> Array:
    """The least distance that a search from the places (m, k, 2) finds.

    After a quarter of the steps, only the best of the k places continues.
    """
    m, k, _ = places.shape
    distance = np.linalg.norm(sheet.at(places.reshape(-1, 2)).reshape(m, k, 3) - x[:, None], axis=2)
    steps_left = np.full((m, k), 2.0)
    for number in range(steps):
        if number == steps // 4:
            chosen = distance.argmin(axis=1)[:, None]
            places = np.take_along_axis(places, chosen[..., None], axis=1)
            distance, steps_left = (
                np.take_along_axis(each, chosen, axis=1) for each in (distance, steps_left)
            )
        around = places[:, :, None] + steps_left[..., None, None] * step * NEIGHBOURS
        around = sheet.inside(around.reshape(-1, 2))
        there = sheet.at(around).reshape(*distance.shape, 9, 3) - x[:, None, None]
        far = np.sqrt((there * there).sum(axis=3))
        nearest_one = far.argmin(axis=2)[..., None]
        least = np.take_along_axis(far, nearest_one, axis=2)[..., 0]
        better = least < distance
        steps_left = np.where(better, 1.2 * steps_left, 0.45 * steps_left)
        around = around.reshape(*distance.shape, 9, 2)
        moved = np.take_along_axis(around, nearest_one[..., None], axis=2)[:, :, 0]
        places = np.where(better[..., None], moved, places)
        distance = np.minimum(distance, least)
    result: Array = distance.min(axis=1)
    return result


def least_distance(
    nets: Sequence[Net], point: Sequence[float], width: float
) -> tuple[float, float]:
    """An interval, `width` wide, that holds the least distance of a point to polynomial nets.

    The nearest boxes are halved first. In exact fractions; only roots are rounded, by 1e-15.
    """
    x = [Fraction(value) for value in point]
    heap: list[tuple[float, int, Net]] = []
    high, number = float("inf"), 0

    def enter(net: Net) -> None:
        nonlocal number, high
        number += 1
        flat = [p for row in net for p in row]
        for corner in (net[0][0], net[0][-1], net[-1][0], net[-1][-1]):
            there = sqrt(sum((a - b) ** 2 for a, b in zip(corner, x, strict=True)))
            high = min(high, there * (1 + 1e-15))
        square = Fraction(0)
        for axis in range(3):
            values = [p[axis] for p in flat]
            square += max(min(values) - x[axis], x[axis] - max(values), Fraction(0)) ** 2
        heappush(heap, (sqrt(square) * (1 - 1e-15), number, net))

    for net in nets:
        enter(net)
    while True:
        low, _, net = heappop(heap)
        if high - low <= width:
            return min(low, high), high
        for half in _split_quarters(net):
            enter(half)


def _split_quarters(net: Net) -> list[Net]:
    """A net over the four quarters of its domain."""
    return [_transpose(part) for half in _halve(net) for part in _halve(_transpose(half))]


def _transpose(net: Net) -> Net:
    return [list(row) for row in zip(*net, strict=True)]


def _halve(net: Net) -> list[Net]:
    low, high, rows = [net[0]], [net[-1]], net
    while len(rows) > 1:
        rows = [
            [
                tuple((a + b) / 2 for a, b in zip(p, q, strict=True))
                for p, q in zip(*two, strict=True)
            ]
            for two in pairwise(rows)
        ]
        low.append(rows[0])
        high.append(rows[-1])
    return [low, high[::-1]]
