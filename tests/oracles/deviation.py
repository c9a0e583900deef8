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

    Points of the triangles stand at their barycentric multiples of 1/`inner`. The nearest point of
    the surface is looked for about the nearest samples of every sheet, in ever smaller steps: what
    is found may be too large by the square of the last step.
    """
    steps = [(i, j) for i in range(inner + 1) for j in range(inner + 1 - i)]
    weights = np.array([(inner - i - j, i, j) for i, j in steps]) / inner
    best = np.full(len(corners) * len(weights), np.inf)
    for sheet in sheets:
        points = np.einsum("wk,tki->twi", weights, corners - sheet.origin).reshape(-1, 3)
        np.minimum(best, _to_sheet(sheet, points, count), out=best)
    return float(best.max())


def _to_sheet(sheet: Sheet, points: Array, count: int, starts: int = 3) -> Array:
    """Distances (m,) from points to a sheet, never too small but for rounding."""
    places = sheet.samples(count)
    _, rows = cKDTree(sheet.at(places)).query(points, k=starts)
    best = np.full(len(points), np.inf)
    offsets = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 2), axis=-1).reshape(-1, 2)
    for start in range(starts):
        at = places[rows[:, start]]
        reach = sheet.step(count)
        for _ in range(8):
            around = sheet.inside((at[:, np.newaxis] + offsets * reach).reshape(-1, 2))
            apart = sheet.at(around).reshape(len(points), -1, 3) - points[:, np.newaxis]
            square = np.einsum("mki,mki->mk", apart, apart)
            nearest = square.argmin(axis=1)
            at = around.reshape(len(points), -1, 2)[np.arange(len(points)), nearest]
            np.minimum(best, np.sqrt(square[np.arange(len(points)), nearest]), out=best)
            reach = reach * 0.4
    return best
