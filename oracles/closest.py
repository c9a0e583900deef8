"""Closest points by exhaustive search, without the engine's code.

`find_nearest` returns upper bounds. It samples every sheet (one surface, `oracles.sheets`);
from the nearest samples, a search moves by steps, only to nearer points. `least_distance` returns
an interval. It divides polynomial nets in exact fractions; the bounding box of the control points
encloses each part.
"""

from collections.abc import Sequence
from fractions import Fraction
from heapq import heappop, heappush
from itertools import pairwise
from math import sqrt

import numpy as np
from scipy.spatial import cKDTree

from oracles.exact import Net
from oracles.sheets import Array, Sheet

DIRECTIONS = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)], dtype=np.float64)
"""Steps (9, 2) in u and v from a place to itself and to its eight neighbours."""


def find_nearest(
    sheets: Sequence[Sheet], points: Array, samples: int = 20_000, starts: int = 3, steps: int = 60
) -> Array:
    """Upper bounds (m,), close to the least distances, of `points` (m, 3) to the sheets.

    For each sheet the search begins at the `starts` samples nearest to a point. A sheet is skipped
    if its nearest sample is further away than the nearest sample of all sheets by more than four
    times the greatest gap between its samples.
    """
    samples_each = max(200, samples // len(sheets))
    result, gaps = [], []
    for sheet in sheets:
        places = sheet.samples(samples_each)
        sample_points = sheet.at(places)
        tree = cKDTree(sample_points)
        gaps.append(float(tree.query(np.unique(sample_points, axis=0), 2)[0][:, 1].max()))
        result.append((places, *tree.query(points - sheet.origin, starts)))
    best = np.min([distance[:, 0] for _, distance, _ in result], axis=0)
    nearest_sample = best.copy()
    for sheet, gap, (places, distance, rows) in zip(sheets, gaps, result, strict=True):
        near_points = np.flatnonzero(distance[:, 0] <= nearest_sample + 4 * gap)
        if len(near_points):
            x, begin = points[near_points] - sheet.origin, places[rows[near_points]]
            sheet_distance = _search_from(sheet, x, begin, sheet.step(samples_each), steps)
            best[near_points] = np.minimum(best[near_points], sheet_distance)
    distances: Array = best
    return distances


def _search_from(sheet: Sheet, x: Array, places: Array, step: Array, steps: int) -> Array:
    """The least distances (m,) to x (m, 3) that a search from the places (m, k, 2) finds.

    Each step tries the eight neighbours of a place. Steps are 2 `step` long at first; they become
    longer if a neighbour is nearer to x, and shorter if not. After a quarter of the steps, only the
    best of the k places continues.
    """
    m, k, _ = places.shape
    distance = np.linalg.norm(sheet.at(places.reshape(-1, 2)).reshape(m, k, 3) - x[:, None], axis=2)
    lengths = np.full((m, k), 2.0)
    for number in range(steps):
        if number == steps // 4:
            best = distance.argmin(axis=1)[:, None]
            places = np.take_along_axis(places, best[..., None], axis=1)
            distance, lengths = (
                np.take_along_axis(each, best, axis=1) for each in (distance, lengths)
            )
        around = places[:, :, None] + lengths[..., None, None] * step * DIRECTIONS
        around = sheet.clip_to_domain(around.reshape(-1, 2))
        offsets = sheet.at(around).reshape(*distance.shape, 9, 3) - x[:, None, None]
        around_distance = np.sqrt((offsets * offsets).sum(axis=3))
        nearest = around_distance.argmin(axis=2)[..., None]
        min_distance = np.take_along_axis(around_distance, nearest, axis=2)[..., 0]
        is_nearer = min_distance < distance
        lengths = np.where(is_nearer, 1.2 * lengths, 0.45 * lengths)
        around = around.reshape(*distance.shape, 9, 2)
        best_around = np.take_along_axis(around, nearest[..., None], axis=2)[:, :, 0]
        places = np.where(is_nearer[..., None], best_around, places)
        distance = np.minimum(distance, min_distance)
    result: Array = distance.min(axis=1)
    return result


def least_distance(
    nets: Sequence[Net], point: Sequence[float], width: float
) -> tuple[float, float]:
    """An interval, at most `width` wide, that contains the least distance of a point to nets.

    `nets` are polynomial patches. The part of a patch whose box is nearest is divided first. All
    numbers are exact fractions except square roots, which are widened by 1e-15.
    """
    x = [Fraction(value) for value in point]
    # Lower bounds of the distances to parts of patches, with numbers that order equal bounds.
    heap: list[tuple[float, int, Net]] = []
    high, number = float("inf"), 0

    def push(net: Net) -> None:
        nonlocal number, high
        number += 1
        flat = [p for row in net for p in row]
        for corner in (net[0][0], net[0][-1], net[-1][0], net[-1][-1]):
            distance = sqrt(sum((a - b) ** 2 for a, b in zip(corner, x, strict=True)))
            high = min(high, distance * (1 + 1e-15))
        box_distance_squared = Fraction(0)
        for axis in range(3):
            values = [p[axis] for p in flat]
            box_distance_squared += (
                max(min(values) - x[axis], x[axis] - max(values), Fraction(0)) ** 2
            )
        heappush(heap, (sqrt(box_distance_squared) * (1 - 1e-15), number, net))

    for net in nets:
        push(net)
    while True:
        low, _, net = heappop(heap)
        if high - low <= width:
            return min(low, high), high
        for quarter in _split_quarters(net):
            push(quarter)


def _split_quarters(net: Net) -> list[Net]:
    """The nets of the four quarters of a patch."""
    return [_transpose(part) for half in _halve(net) for part in _halve(_transpose(half))]


def _transpose(net: Net) -> Net:
    """The net with u and v exchanged."""
    return [list(row) for row in zip(*net, strict=True)]


def _halve(net: Net) -> list[Net]:
    """The nets of the two halves along axis 0, by de Casteljau."""
    low_half, high_half, rows = [net[0]], [net[-1]], net
    while len(rows) > 1:
        rows = [
            [
                tuple((a + b) / 2 for a, b in zip(p, q, strict=True))
                for p, q in zip(*pair, strict=True)
            ]
            for pair in pairwise(rows)
        ]
        low_half.append(rows[0])
        high_half.append(rows[-1])
    return [low_half, high_half[::-1]]
