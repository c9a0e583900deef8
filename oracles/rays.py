"""Hits of rays by exhaustive search, without the engine's code.

Every sheet (one surface, `oracles.sheets`) is divided into many cells of parameters. Newton's
method, with differences for partials, starts in each cell whose projection along the ray may
contain the ray. If Newton's method ends at a point on the ray, this point is a hit. The search may
miss one of two hits that are very near each other, and points where the ray touches the surface;
but every hit is true.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from mpmath import mp, mpf
from numpy.typing import NDArray

from oracles.sheets import Array, Sheet, TensorSheet

Ints: TypeAlias = NDArray[np.intp]

STEP = 1e-6
"""The step of differences, as a share of the domain."""

RAYS_AT_A_TIME = 200
"""Rays that are compared with all cells at a time, to bound the memory."""


def find_crossings(
    sheets: Sequence[Sheet], origins: Array, directions: Array, samples: int = 4000
) -> tuple[Ints, Array, Array]:
    """All hits that the search finds: numbers of rays (n,), parameters t (n,), errors of t (n,)."""
    result: list[tuple[Ints, Array, Array]] = [(np.zeros(0, np.intp), np.zeros(0), np.zeros(0))]
    cells_each = max(100, samples // len(sheets))
    for sheet in sheets:
        cells, low, high = _divide_domain(sheet, cells_each)
        corners = sheet.at(cells.reshape(-1, 2)).reshape(-1, 4, 3)
        for begin in range(0, len(origins), RAYS_AT_A_TIME):
            rows = slice(begin, begin + RAYS_AT_A_TIME)
            ray, cell = _find_near_pairs(corners, origins[rows] - sheet.origin, directions[rows])
            if not len(ray):
                continue
            o, d = origins[rows][ray] - sheet.origin, directions[rows][ray]
            hit, t, error = _iterate_newton(sheet, cells[cell].mean(axis=1), o, d, (low, high))
            result.append((ray[hit] + begin, t, error))
    ray, t, error = (np.concatenate(each) for each in zip(*result, strict=True))
    return ray, t, error


def _divide_domain(sheet: Sheet, count: int) -> tuple[Array, Array, Array]:
    """Corners (K, 4, 2) of about `count` cells of parameters, and the ends (2,) of the domain."""
    breaks = sheet.breaks if isinstance(sheet, TensorSheet) else (np.array([0.0, 1]),) * 2
    per_span = max(3, round((count / (len(breaks[0]) - 1) / (len(breaks[1]) - 1)) ** 0.5))
    lines = [
        np.interp(np.linspace(0, len(b) - 1, per_span * (len(b) - 1) + 1), range(len(b)), b)
        for b in breaks
    ]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    if not isinstance(sheet, TensorSheet):
        grid[..., 0] *= 1 - grid[..., 1]  # maps the square to the triangle
    corners_of_cells = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    cells = np.stack([corner.reshape(-1, 2) for corner in corners_of_cells], axis=1)
    return cells, np.array([b[0] for b in breaks]), np.array([b[-1] for b in breaks])


def _build_frame(d: Array) -> tuple[Array, Array]:
    """Two unit vectors (m, 3) for each direction (m, 3), orthogonal to it and to each other."""
    axis = np.eye(3)[np.abs(d).argmin(axis=1)]
    first = np.cross(d, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(d, first)
    return first, second / np.linalg.norm(second, axis=1, keepdims=True)


def _find_near_pairs(corners: Array, o: Array, d: Array) -> tuple[Ints, Ints]:
    """The rays and cells of all pairs where the ray may meet the cell: numbers (n,) and (n,).

    Each cell is projected along the ray. The pair counts if the bounding box of the projection, at
    twice its size, contains the ray.
    """
    is_near = np.ones((len(o), len(corners)), bool)
    for axis in _build_frame(d):
        offsets = corners.reshape(-1, 3) @ axis.T - (o * axis).sum(axis=1)
        offsets = offsets.reshape(len(corners), 4, len(o))
        low, high = offsets.min(axis=1), offsets.max(axis=1)
        margin = 0.5 * (high - low)
        is_near &= ((low - margin <= 0) & (high + margin >= 0)).T
    ray, cell = np.nonzero(is_near)
    return ray, cell


def _iterate_newton(
    sheet: Sheet, places: Array, o: Array, d: Array, domain: tuple[Array, Array]
) -> tuple[Ints, Array, Array]:
    """The starts from which Newton's method reaches a hit, t of each hit, and the error of t.

    `places` (m, 2) are the starts, `o` and `d` (m, 3) are the origins and directions of their rays.
    The results have the shape (n,); a start is the number of its row in `places`. Touching points,
    where the sine of the angle between ray and surface is at most 1e-6, are not hits. Rounding the
    parameters moves a point by up to 2⁻⁵³ times the partials, which grow with the weights. The
    error of t is more than this distance plus the allowed distance from the ray, divided by the
    sine and by |d|.
    """
    low, high = domain
    first, second = _build_frame(d)
    step = STEP * (high - low)
    for _ in range(12):
        offset = sheet.at(places) - o
        du, dv = (
            (sheet.at(places + offset_uv) - sheet.at(places - offset_uv)) / (2 * length)
            for offset_uv, length in zip(np.diag(step), step, strict=True)
        )
        # f and g are the distances from the ray along the two vectors of the frame.
        f, g = (offset * first).sum(axis=1), (offset * second).sum(axis=1)
        fu, fv, gu, gv = ((p * w).sum(axis=1) for w in (first, second) for p in (du, dv))
        with np.errstate(all="ignore"):
            determinant = fu * gv - fv * gu
            newton_step = np.stack(
                [(fv * g - gv * f) / determinant, (gu * f - fu * g) / determinant], axis=1
            )
        newton_step = np.where(np.isfinite(newton_step), newton_step, 0.0)
        # A step may leave the domain by 5%, and a later step may lead back.
        places = np.clip(
            places + newton_step, low - 0.05 * (high - low), high + 0.05 * (high - low)
        )
    points = sheet.at(places)
    scale = np.abs(points).max(axis=1) + np.abs(o).max(axis=1)
    speed = np.linalg.norm(d, axis=1)
    ray_distance = np.linalg.norm(np.cross(points - o, d), axis=1) / speed
    t = ((points - o) * d).sum(axis=1) / (d * d).sum(axis=1)
    is_inside = (sheet.clip_to_domain(places) == places).all(axis=1)
    # The factors 2⁻⁵² for 2⁻⁵³, and 4, are a margin.
    point_error = 1e-13 * scale + 2.0**-52 * sum(np.linalg.norm(x, axis=1) for x in (du, dv))
    with np.errstate(all="ignore"):
        normal = np.cross(du, dv)
        sine = np.abs((normal * d).sum(axis=1)) / (np.linalg.norm(normal, axis=1) * speed)
        error = 4 * point_error / (sine * speed)
    hit = np.flatnonzero((ray_distance <= 1e-13 * scale) & is_inside & (t >= 0) & (sine > 1e-6))
    return hit, t[hit], error[hit]


def sphere_roots(origin: Sequence[float], direction: Sequence[float]) -> list[float]:
    """All t ≥ 0 at which a ray meets the unit sphere about 0, computed with 50 digits."""
    with mp.workdps(50):
        o, d = [mpf(x) for x in origin], [mpf(x) for x in direction]
        dd, od, oo = (
            sum(a * b for a, b in zip(x, y, strict=True)) for x, y in ((d, d), (o, d), (o, o))
        )
        # The roots of dd t² + 2 od t + oo − 1 = 0.
        discriminant = od**2 - dd * (oo - 1)
        if discriminant < 0:
            return []
        root = mp.sqrt(discriminant)
        return [float(t) for t in ((-od - root) / dd, (-od + root) / dd) if t >= 0]


def torus_roots(
    origin: Sequence[float], direction: Sequence[float], radius: float, tube: float
) -> list[float]:
    """All t ≥ 0 at which a ray meets the torus about the z axis, computed with 50 digits.

    They are the real roots of (|P|² + R² − r²)² = 4 R² (x² + y²), where P = (x, y, z) is
    origin + t direction, R = `radius` and r = `tube`.
    """
    with mp.workdps(50):
        o, d = [mpf(x) for x in origin], [mpf(x) for x in direction]
        big, small = mpf(radius), mpf(tube)
        dd, od, oo = (
            sum(a * b for a, b in zip(x, y, strict=True)) for x, y in ((d, d), (o, d), (o, o))
        )
        k = oo + big**2 - small**2
        # The same inner products of the x and y coordinates alone.
        dd_xy, od_xy, oo_xy = (
            sum(x * y for x, y in zip(a[:2], b[:2], strict=True))
            for a, b in ((d, d), (o, d), (o, o))
        )
        four_big_squared = 4 * big**2
        quartic = [
            k**2 - four_big_squared * oo_xy, 4 * od * k - 2 * four_big_squared * od_xy,
            4 * od**2 + 2 * dd * k - four_big_squared * dd_xy, 4 * dd * od, dd**2,
        ]  # fmt: skip
        roots = mp.polyroots(quartic, maxsteps=500, extraprec=400, asc=True)
        real = [root.real for root in roots if abs(root.imag) < mpf(10) ** -25]
        return sorted(float(t) for t in real if t >= 0)
