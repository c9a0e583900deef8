"""How far a surface is from a mesh, and a mesh from a surface, found by looking at many points.

What is found is never larger than the truth, but for rounding: a bound that is smaller than this
is wrong. Samples are dense on all of the surface, denser on its borders, and denser again, in steps
of a quarter, about those that are worst.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tests.oracles.distance import Soup
from tests.oracles.sheets import Sheet

Array: TypeAlias = NDArray[np.float64]

WORST = 12
"""Samples about which more are taken."""

ROUNDS = 4

AGAIN = 128
"""Points whose distance to the surface is looked for again at a time."""

ROUNDING = 64 * 2.0**-53
"""Rounding of an evaluated point, in units of the size of what is evaluated, and generously."""


@dataclass(frozen=True)
class Found:
    """The largest deviation that was met, where, and what rounding may have added to it."""

    distance: float
    sheet: int
    place: tuple[float, float]
    noise: float


def surface_to_mesh(sheets: Sequence[Sheet], corners: Array, count: int = 4000) -> Found:
    """Largest distance found from a point of the surface to the triangles (T, 3, 3).

    `count` is that of the samples of each sheet, before those on borders and about the worst.
    """
    return max(sheet_by_sheet(sheets, corners, count), key=lambda found: found.distance)


def sheet_by_sheet(sheets: Sequence[Sheet], corners: Array, count: int = 4000) -> list[Found]:
    """The same for each sheet, against all triangles."""
    return [_from_sheet(number, sheet, corners, count) for number, sheet in enumerate(sheets)]


def _from_sheet(number: int, sheet: Sheet, corners: Array, count: int) -> Found:
    # The difference of two doubles that are near each other is exact.
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
        found = soup.distances(sheet.at(around)).reshape(len(tops), -1)
        best = found.argmax(axis=1)
        tops = around.reshape(len(tops), -1, 2)[np.arange(len(tops)), best]
        heights = found[np.arange(len(tops)), best]
        reach = reach / 4
    top = int(heights.argmax())
    return Found(
        max(largest, float(heights[top])), number, (float(tops[top, 0]), float(tops[top, 1])), noise
    )


def seen_deviation(
    sheets: Sequence[Sheet], corners: Array, eye: Array, near: float, count: int = 4000
) -> float:
    """Largest distance from a sample to the triangles in units of its distance from an eye.

    What is nearer to the eye than `near` counts as being so far away.
    """
    largest = 0.0
    for sheet in sheets:
        points = sheet.at(sheet.samples(count))
        away = np.linalg.norm(points - (eye - sheet.origin), axis=1)
        found = Soup(corners - sheet.origin).distances(points)
        largest = max(largest, float((found / np.maximum(away, near)).max()))
    return largest


def mesh_to_surface(
    sheets: Sequence[Sheet], corners: Array, count: int = 4000, inner: int = 4
) -> float:
    """Largest distance found from a point of the triangles (T, 3, 3) to the surface.

    Points of the triangles stand at their barycentric multiples of 1/`inner`. From the nearest
    sample of every sheet one descends to the nearest point. What is found may be too large, so
    where it is largest one looks again, among many more samples and in steps of all sizes, until
    the largest of all is one that was looked at twice.
    """
    steps = [(i, j) for i in range(inner + 1) for j in range(inner + 1 - i)]
    weights = np.array([(inner - i - j, i, j) for i, j in steps]) / inner
    points = np.einsum("wk,tki->twi", weights, corners).reshape(-1, 3)
    best = np.full(len(points), np.inf)
    for sheet in sheets:
        found = _descended(sheet, sheet.samples(count), points - sheet.origin)
        np.minimum(best, found, out=best)
    order = np.argsort(-best, kind="stable")
    fine = [(sheet, sheet.samples(16 * count)) for sheet in sheets]
    trees = [cKDTree(sheet.at(places)) for sheet, places in fine]
    largest = 0.0
    for start in range(0, len(order), AGAIN):
        rows = order[start : start + AGAIN]
        if best[rows[0]] <= largest:
            break
        for (sheet, places), tree in zip(fine, trees, strict=True):
            found = _searched(sheet, places, tree, points[rows] - sheet.origin)
            best[rows] = np.minimum(best[rows], found)
        largest = max(largest, float(best[rows].max()))
    return largest


def _searched(sheet: Sheet, places: Array, tree: cKDTree, points: Array) -> Array:
    """Distances (m,) to a sheet, about the nearest samples in steps that become ever smaller."""
    offsets = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 2), axis=-1).reshape(-1, 2)
    _, nearest = tree.query(points, k=2)
    best = np.full(len(points), np.inf)
    for start in nearest.T:
        at, reach = places[start], sheet.step(len(places))
        for _ in range(10):
            around = sheet.inside((at[:, np.newaxis] + offsets * reach).reshape(-1, 2))
            apart = sheet.at(around).reshape(len(points), -1, 3) - points[:, np.newaxis]
            square = (apart * apart).sum(axis=2)
            row = square.argmin(axis=1)
            at = around.reshape(len(points), -1, 2)[np.arange(len(points)), row]
            np.minimum(best, np.sqrt(square.min(axis=1)), out=best)
            reach = reach / 2
    return best


def _descended(sheet: Sheet, places: Array, points: Array, steps: int = 6) -> Array:
    """Distances (m,) to a sheet, by steps of Gauss and Newton from the nearest sample.

    Slopes are differences; a step that leads further away is halved and tried again.
    """
    _, rows = cKDTree(sheet.at(places)).query(points)
    at, size = places[rows], sheet.step(len(places))
    apart = sheet.at(at) - points
    best = (apart * apart).sum(axis=1)
    scale = np.ones((len(points), 1))
    for _ in range(steps):
        slopes = []
        for axis in range(2):
            small = np.zeros(2)
            small[axis] = 1e-6 * size[axis]
            there = sheet.inside(at + small)
            there = np.where(there == at, sheet.inside(at - small), there)
            length = (there - at).sum(axis=1, keepdims=True)
            slopes.append((sheet.at(there) - points - apart) / np.where(length == 0, 1, length))
        step = _solved(slopes, apart)
        new = sheet.inside(at - scale * step)
        moved = sheet.at(new) - points
        square = (moved * moved).sum(axis=1)
        nearer = square < best
        best = np.where(nearer, square, best)
        at = np.where(nearer[:, np.newaxis], new, at)
        apart = np.where(nearer[:, np.newaxis], moved, apart)
        scale = np.where(nearer[:, np.newaxis], 1.0, scale / 4)
    distances: Array = np.sqrt(best)
    return distances


def _solved(slopes: Sequence[Array], apart: Array) -> Array:
    """The step (m, 2) that makes Σ step · slope as near as can be to what is apart."""
    (a, b), c = slopes, apart
    e, f, g = ((x * y).sum(axis=1) for x, y in ((a, a), (a, b), (b, b)))
    p, q = ((x * c).sum(axis=1) for x in (a, b))
    # A little more on the diagonal, for partials that vanish or run along each other.
    e, g = e * (1 + 1e-9) + 1e-300, g * (1 + 1e-9) + 1e-300
    area = e * g - f * f
    step: Array = np.stack([g * p - f * q, e * q - f * p], axis=1) / area[:, np.newaxis]
    return step
