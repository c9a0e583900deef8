"""Distances of a surface from a mesh, and of a mesh from a surface, found by sampling.

Except for rounding, a sampled distance is never larger than the true one, so a bound below it is
wrong. Samples are dense on the whole surface, denser on its borders, and denser still around the
samples with the largest distances.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tests.oracles.distance import Soup
from tests.oracles.sheets import Sheet

Array: TypeAlias = NDArray[np.float64]

WORST = 12
"""Number of the worst samples, around which more samples are taken."""

ROUNDS = 4

MULTITUDE = 1_000_000
"""Number of samples among which the nearest is searched in doubtful cases."""

AGAIN = 128
"""Number of points whose distance to the surface is searched again at a time."""

ROUNDING = 64 * 2.0**-53
"""An upper bound of the rounding error of an evaluated point, relative to the size of the
surface."""


@dataclass(frozen=True)
class Found:
    """The largest deviation found, its place, and the part of it that may be rounding."""

    distance: float
    sheet: int
    place: tuple[float, float]
    noise: float


def measure_surface_to_mesh(sheets: Sequence[Sheet], corners: Array, count: int = 4000) -> Found:
    """Largest distance found from a point of the surface to the triangles (T, 3, 3).

    Each sheet has `count` samples, without those on borders and around the worst.
    """
    return max(measure_each_sheet(sheets, corners, count), key=lambda found: found.distance)


def measure_each_sheet(sheets: Sequence[Sheet], corners: Array, count: int = 4000) -> list[Found]:
    """The distance from each sheet to all triangles."""
    return [_measure_sheet(number, sheet, corners, count) for number, sheet in enumerate(sheets)]


def _measure_sheet(number: int, sheet: Sheet, corners: Array, count: int) -> Found:
    # The difference of two nearly equal doubles is exact.
    local = corners - sheet.origin
    soup = Soup(local)
    places = sheet.samples(count)
    points = sheet.at(places)
    distances, largest = soup.farthest(points)
    noise = ROUNDING * float(np.abs(points).max())
    rows = np.argsort(-distances, kind="stable")[:WORST]
    tops, heights = places[rows], distances[rows]
    reach = sheet.step(count)
    offsets = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 2), axis=-1).reshape(-1, 2)
    for _ in range(ROUNDS):
        around = sheet.inside((tops[:, np.newaxis] + offsets * reach).reshape(-1, 2))
        result = soup.distances(sheet.at(around)).reshape(len(tops), -1)
        best = result.argmax(axis=1)
        tops = around.reshape(len(tops), -1, 2)[np.arange(len(tops)), best]
        heights = result[np.arange(len(tops)), best]
        reach = reach / 4
    top = int(heights.argmax())
    return Found(
        max(largest, float(heights[top])), number, (float(tops[top, 0]), float(tops[top, 1])), noise
    )


def measure_seen_deviation(
    sheets: Sequence[Sheet], corners: Array, eye: Array, near: float, count: int = 4000
) -> float:
    """Largest distance from a sample to the triangles in units of its distance from an eye.

    A sample nearer to the eye than `near` counts with the distance `near`.
    """
    largest = 0.0
    for sheet in sheets:
        points = sheet.at(sheet.samples(count))
        away = np.linalg.norm(points - (eye - sheet.origin), axis=1)
        result = Soup(corners - sheet.origin).distances(points)
        largest = max(largest, float((result / np.maximum(away, near)).max()))
    return largest


def measure_mesh_to_surface(
    sheets: Sequence[Sheet], corners: Array, count: int = 4000, inner: int = 4, doubt: float = inf
) -> float:
    """Largest distance found from a point of the triangles (T, 3, 3) to the surface.

    Points of the triangles stand at their barycentric multiples of 1/`inner`. The search descends
    from the nearest sample of every sheet to the nearest point. Its distances may be too large. So
    the search for the largest distance is repeated from the nearest of many more samples, until the
    largest distance of all was computed twice; above `doubt`, it is repeated once more, from
    `MULTITUDE` samples.
    """
    steps = [(i, j) for i in range(inner + 1) for j in range(inner + 1 - i)]
    weights = np.array([(inner - i - j, i, j) for i, j in steps]) / inner
    points = np.einsum("wk,tki->twi", weights, corners).reshape(-1, 3)
    best = np.full(len(points), np.inf)
    for sheet in sheets:
        result = _descend(sheet, *_sample_sheet(sheet, count), points - sheet.origin, starts=1)
        np.minimum(best, result, out=best)
    order = np.argsort(-best, kind="stable")
    many = [(sheet, *_sample_sheet(sheet, 16 * count)) for sheet in sheets]
    largest = 0.0
    for start in range(0, len(order), AGAIN):
        rows = order[start : start + AGAIN]
        if best[rows[0]] <= largest:
            break
        for sheet, places, tree in many:
            result = _descend(sheet, places, tree, points[rows] - sheet.origin, starts=4)
            best[rows] = np.minimum(best[rows], result)
        largest = max(largest, float(best[rows].max()))
    rows = np.flatnonzero(best > doubt)
    if len(rows):
        for sheet in sheets:
            result = _descend(
                sheet, *_sample_sheet(sheet, MULTITUDE), points[rows] - sheet.origin, starts=8
            )
            best[rows] = np.minimum(best[rows], result)
        largest = float(best.max())
    return largest


def _sample_sheet(sheet: Sheet, count: int) -> tuple[Array, cKDTree]:
    """Samples, and their parameters."""
    places = sheet.samples(count)
    return places, cKDTree(sheet.at(places))


def _descend(
    sheet: Sheet, places: Array, tree: cKDTree, points: Array, *, starts: int, steps: int = 8
) -> Array:
    """Distances (m,) to a sheet, by steps of Gauss and Newton from the nearest samples.

    Slopes are differences. Steps along u, along v and along the third side of a triangle are tried,
    too, because the nearest point may be on the border. A step that leads further away is
    shortened.
    """
    _, rows = tree.query(points, k=list(range(1, starts + 1)))
    at = places[rows.T.ravel()]
    points = np.tile(points, (starts, 1))
    size = 1e-6 * sheet.step(len(places))
    apart = sheet.at(at) - points
    best = (apart * apart).sum(axis=1)
    scale = np.ones((len(points), 1))
    for _ in range(steps):
        a, b = (_estimate_partial(sheet, at, apart + points, size, axis) for axis in range(2))
        for step in _solve_steps(a, b, apart):
            new = sheet.inside(at - scale * step)
            moved = sheet.at(new) - points
            square = (moved * moved).sum(axis=1)
            nearer = square < best
            best = np.where(nearer, square, best)
            at = np.where(nearer[:, np.newaxis], new, at)
            apart = np.where(nearer[:, np.newaxis], moved, apart)
        scale = np.where(nearer[:, np.newaxis], 1.0, scale / 2)
    distances: Array = np.sqrt(best).reshape(starts, -1).min(axis=0)
    return distances


def _estimate_partial(sheet: Sheet, at: Array, point: Array, size: Array, axis: int) -> Array:
    """The partial along one parameter, from a difference into the domain."""
    small = np.where(np.arange(2) == axis, size, 0.0)
    there = sheet.inside(at + small)
    stayed = np.abs(there - at)[:, axis, np.newaxis] < size[axis] / 2
    there = sheet.inside(np.where(stayed, at - small, there))
    length = (there - at)[:, axis, np.newaxis]
    return (sheet.at(there) - point) / np.where(length == 0, 1.0, length)


def _solve_steps(a: Array, b: Array, apart: Array) -> list[Array]:
    """Steps (m, 2) that reduce the differences, to first order: freely and along three lines."""
    e, f, g = ((x * y).sum(axis=1) for x, y in ((a, a), (a, b), (b, b)))
    p, q = ((x * apart).sum(axis=1) for x in (a, b))
    # The diagonal is a little larger, for partials that vanish or are parallel.
    e, g = e * (1 + 1e-9) + 1e-300, g * (1 + 1e-9) + 1e-300
    zero = np.zeros_like(p)
    area, across = e * g - f * f, e + g - 2 * f + 1e-300
    result = [
        ((g * p - f * q) / area, (e * q - f * p) / area),
        (p / e, zero),
        (zero, q / g),
        ((p - q) / across, (q - p) / across),
    ]
    return [np.stack(step, axis=1) for step in result]
