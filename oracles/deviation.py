"""Distances of a surface from a mesh, and of a mesh from a surface, measured by sampling.

Except for rounding, a sampled distance is never larger than the true largest distance. So an upper
bound below a sampled distance is wrong.

A surface is given as sheets (`oracles.sheets`), its tensor-product and triangular parts.
Samples are dense on the whole surface, denser on its borders, and densest around the samples with
the largest distances.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from oracles.distance import Soup
from oracles.sheets import Sheet

Array: TypeAlias = NDArray[np.float64]

WORST_COUNT = 12
"""Number of samples with the largest distances, around which more samples are taken."""

ROUNDS = 4
"""How often more samples are taken around the worst samples; each time from a region a quarter as
wide as before."""

DOUBTFUL_SAMPLES = 1_000_000
"""Number of samples of a sheet in doubtful cases: the search for the nearest point begins at the
nearest of these samples."""

REPEATED_POINTS = 128
"""Number of points whose distance to the surface is computed again at a time."""

ROUNDING = 64 * 2.0**-53
"""An upper bound of the rounding error of an evaluated point, relative to the size of the
surface."""


@dataclass(frozen=True)
class Deviation:
    """The largest sampled distance, and where it is.

    `sheet` is the number of the sheet, and `place` the parameters (u, v). `rounding` is the part of
    the distance that may be an error of rounding.
    """

    distance: float
    sheet: int
    place: tuple[float, float]
    rounding: float


def measure_surface_to_mesh(
    sheets: Sequence[Sheet], corners: Array, count: int = 4000
) -> Deviation:
    """Largest sampled distance from a point of the surface to the triangles (T, 3, 3).

    Each sheet has about `count` samples in its domain, and more on its border and around the
    samples with the largest distances.
    """
    return max(measure_each_sheet(sheets, corners, count), key=lambda deviation: deviation.distance)


def measure_each_sheet(
    sheets: Sequence[Sheet], corners: Array, count: int = 4000
) -> list[Deviation]:
    """The largest sampled distance from each sheet to the triangles (T, 3, 3)."""
    return [_measure_sheet(number, sheet, corners, count) for number, sheet in enumerate(sheets)]


def _measure_sheet(number: int, sheet: Sheet, corners: Array, count: int) -> Deviation:
    """The largest sampled distance from one sheet, with this number, to the triangles."""
    # The difference of two nearly equal doubles is exact.
    local = corners - sheet.origin
    soup = Soup(local)
    places = sheet.samples(count)
    points = sheet.at(places)
    distances, largest = soup.farthest(points)
    rounding = ROUNDING * float(np.abs(points).max())
    rows = np.argsort(-distances, kind="stable")[:WORST_COUNT]
    worst_places, worst_distances = places[rows], distances[rows]
    spread = sheet.step(count)
    offsets = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 2), axis=-1).reshape(-1, 2)
    for _ in range(ROUNDS):
        around = sheet.clip_to_domain(
            (worst_places[:, np.newaxis] + offsets * spread).reshape(-1, 2)
        )
        around_distances = soup.distances(sheet.at(around)).reshape(len(worst_places), -1)
        best = around_distances.argmax(axis=1)
        worst_places = around.reshape(len(worst_places), -1, 2)[np.arange(len(worst_places)), best]
        worst_distances = around_distances[np.arange(len(worst_places)), best]
        spread = spread / 4
    worst = int(worst_distances.argmax())
    u, v = worst_places[worst].tolist()
    return Deviation(max(largest, float(worst_distances[worst])), number, (u, v), rounding)


def measure_seen_deviation(
    sheets: Sequence[Sheet], corners: Array, eye: Array, near: float, count: int = 4000
) -> float:
    """Largest quotient of a sample's distance to the triangles and its distance from the eye.

    If a sample is nearer to the eye than `near`, its distance is divided by `near`.
    """
    largest = 0.0
    for sheet in sheets:
        points = sheet.at(sheet.samples(count))
        eye_distances = np.linalg.norm(points - (eye - sheet.origin), axis=1)
        distances = Soup(corners - sheet.origin).distances(points)
        largest = max(largest, float((distances / np.maximum(eye_distances, near)).max()))
    return largest


def measure_mesh_to_surface(
    sheets: Sequence[Sheet], corners: Array, count: int = 4000, inner: int = 4, doubt: float = inf
) -> float:
    """Largest distance from a sampled point of the triangles (T, 3, 3) to the surface.

    The sampled points have barycentric coordinates that are multiples of 1/`inner`. For each point,
    a search descends from the nearest sample of every sheet to the nearest point of the surface.
    A distance may be too large, because the search may end at a local minimum. So the largest
    distances are computed again, from the nearest of many more samples, until the largest of all
    was computed twice. Distances above `doubt` are computed once more, from `DOUBTFUL_SAMPLES`
    samples.
    """
    steps = [(i, j) for i in range(inner + 1) for j in range(inner + 1 - i)]
    weights = np.array([(inner - i - j, i, j) for i, j in steps]) / inner
    points = np.einsum("wk,tki->twi", weights, corners).reshape(-1, 3)
    best = np.full(len(points), np.inf)
    for sheet in sheets:
        distances = _descend(sheet, *_sample_sheet(sheet, count), points - sheet.origin, starts=1)
        np.minimum(best, distances, out=best)
    order = np.argsort(-best, kind="stable")
    dense_samples = [(sheet, *_sample_sheet(sheet, 16 * count)) for sheet in sheets]
    largest = 0.0
    for start in range(0, len(order), REPEATED_POINTS):
        rows = order[start : start + REPEATED_POINTS]
        if best[rows[0]] <= largest:
            break
        for sheet, places, tree in dense_samples:
            distances = _descend(sheet, places, tree, points[rows] - sheet.origin, starts=4)
            best[rows] = np.minimum(best[rows], distances)
        largest = max(largest, float(best[rows].max()))
    rows = np.flatnonzero(best > doubt)
    if len(rows):
        for sheet in sheets:
            distances = _descend(
                sheet,
                *_sample_sheet(sheet, DOUBTFUL_SAMPLES),
                points[rows] - sheet.origin,
                starts=8,
            )
            best[rows] = np.minimum(best[rows], distances)
        largest = float(best.max())
    return largest


def _sample_sheet(sheet: Sheet, count: int) -> tuple[Array, cKDTree]:
    """Parameters (m, 2) of samples of a sheet, and a tree of their points."""
    places = sheet.samples(count)
    return places, cKDTree(sheet.at(places))


def _descend(
    sheet: Sheet, places: Array, tree: cKDTree, points: Array, *, starts: int, steps: int = 8
) -> Array:
    """Distances (m,) of points to a sheet, by the method of Gauss and Newton.

    The method begins at each of the `starts` nearest samples, and the least distance counts.
    Partials are computed from differences of points. The search also tries steps along u, along v
    and along the third side of a triangle, because the nearest point may be on the border. Where
    the last of these steps does not lead to a nearer point, the next steps are half as long.
    """
    _, rows = tree.query(points, k=list(range(1, starts + 1)))
    current = places[rows.T.ravel()]
    points = np.tile(points, (starts, 1))
    difference = 1e-6 * sheet.step(len(places))
    offset = sheet.at(current) - points
    min_square = (offset * offset).sum(axis=1)  # squares of the least distances so far
    scale = np.ones((len(points), 1))
    for _ in range(steps):
        a, b = (
            _estimate_partial(sheet, current, offset + points, difference, axis)
            for axis in range(2)
        )
        for step in _solve_steps(a, b, offset):
            new = sheet.clip_to_domain(current - scale * step)
            new_offset = sheet.at(new) - points
            new_square = (new_offset * new_offset).sum(axis=1)
            is_nearer = new_square < min_square
            min_square = np.where(is_nearer, new_square, min_square)
            current = np.where(is_nearer[:, np.newaxis], new, current)
            offset = np.where(is_nearer[:, np.newaxis], new_offset, offset)
        scale = np.where(is_nearer[:, np.newaxis], 1.0, scale / 2)
    distances: Array = np.sqrt(min_square).reshape(starts, -1).min(axis=0)
    return distances


def _estimate_partial(
    sheet: Sheet, current: Array, point: Array, difference: Array, axis: int
) -> Array:
    """The partial derivatives (m, 3) along one parameter, from differences inside the domain."""
    step = np.where(np.arange(2) == axis, difference, 0.0)
    new = sheet.clip_to_domain(current + step)
    # At the upper end of the domain the parameter cannot increase, so it is decreased.
    is_at_end = np.abs(new - current)[:, axis, np.newaxis] < difference[axis] / 2
    new = sheet.clip_to_domain(np.where(is_at_end, current - step, new))
    length = (new - current)[:, axis, np.newaxis]
    return (sheet.at(new) - point) / np.where(length == 0, 1.0, length)


def _solve_steps(a: Array, b: Array, offset: Array) -> list[Array]:
    """Four arrays (m, 2) of steps that minimise the distance to first order.

    The first steps have any direction; the others run along u, along v, and along the third side
    of a triangle. `a` and `b` (m, 3) are the partials, `offset` (m, 3) are the vectors from points
    to the surface.
    """
    e, f, g = ((x * y).sum(axis=1) for x, y in ((a, a), (a, b), (b, b)))
    p, q = ((x * offset).sum(axis=1) for x in (a, b))
    # A slightly larger diagonal avoids a division by zero if partials vanish or are parallel.
    e, g = e * (1 + 1e-9) + 1e-300, g * (1 + 1e-9) + 1e-300
    zero = np.zeros_like(p)
    determinant, diagonal = e * g - f * f, e + g - 2 * f + 1e-300
    steps = [
        ((g * p - f * q) / determinant, (e * q - f * p) / determinant),
        (p / e, zero),
        (zero, q / g),
        ((p - q) / diagonal, (q - p) / diagonal),
    ]
    return [np.stack(step, axis=1) for step in steps]
