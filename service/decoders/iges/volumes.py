"""The sign of the volume of a closed shell: whether its normals point outwards.

A face adds the flux ∫∫ S · (S_u × S_v) du dv / 3 over the polygons of its loops, by Gauss's rule
along lines of a constant parameter. Partials are differences of points.
"""

from collections.abc import Sequence

import numpy as np

from service.bases.arrays import AnyArray, FloatArray, Ints
from service.decoders.cad.content import Surface
from service.decoders.cad.splines import evaluate_surface

LINES = 24
"""Lines across a face; four times as many for shells with a small volume."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)

DIFFERENCE = 1e-5
"""Step of the differences, as a share of the domain."""

THIN = 0.02
"""A volume below this share of what its faces add is computed again, on more lines."""


def is_inside_out(
    faces: Sequence[tuple[Surface, Sequence[FloatArray], bool]], center: FloatArray
) -> bool:
    """Whether the normals of the faces of a closed shell point inwards.

    Parameters
    ----------
    faces : sequence
        For each face its surface, the polygons of its borders, and whether its normal is opposite
        to du × dv.
    center : ndarray of float64, shape (3,)
        A point near the shell.
    """
    for lines in (LINES, 4 * LINES):
        parts = [
            -_find_flux(surface, polygons, center, lines)
            if is_reversed
            else _find_flux(surface, polygons, center, lines)
            for surface, polygons, is_reversed in faces
        ]
        volume = sum(parts)
        if abs(volume) > THIN * sum(map(abs, parts)):
            break
    return volume < 0


def _find_flux(
    surface: Surface, polygons: Sequence[FloatArray], center: FloatArray, lines: int
) -> float:
    low = np.array([knots[0] for knots in surface.knots])
    high = np.array([knots[-1] for knots in surface.knots])
    v0 = min(float(polygon[:, 1].min()) for polygon in polygons)
    v1 = max(float(polygon[:, 1].max()) for polygon in polygons)
    height = (v1 - v0) / lines
    heights = v0 + height * (np.arange(lines) + 0.5)
    starts, ends, rows = _find_intervals(polygons, heights)
    half = (ends - starts) / 2
    u = ((starts + ends) / 2)[:, np.newaxis] + half[:, np.newaxis] * NODES
    v = np.repeat(heights[rows], len(NODES))
    weights = (half[:, np.newaxis] * WEIGHTS).ravel()
    flux = _find_density(surface, u.ravel(), v, center, DIFFERENCE * (high - low))
    return float((weights * flux).sum()) * height / 3


def _find_intervals(
    polygons: Sequence[FloatArray], heights: AnyArray
) -> tuple[FloatArray, FloatArray, Ints]:
    """Where lines of constant v are inside: starts and ends along u, and the numbers of lines."""
    starts, ends, rows = [], [], []
    first = np.concatenate(polygons)
    last = np.concatenate([np.roll(polygon, -1, axis=0) for polygon in polygons])
    for row, v in enumerate(heights.tolist()):
        crosses = (first[:, 1] <= v) != (last[:, 1] <= v)
        a, b = first[crosses], last[crosses]
        u = np.sort(a[:, 0] + (v - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0]))
        starts.append(u[:-1:2])
        ends.append(u[1::2])
        rows.append(np.full(len(u) // 2, row))
    return np.concatenate(starts), np.concatenate(ends), np.concatenate(rows)


def _find_density(
    surface: Surface, u: FloatArray, v: FloatArray, center: FloatArray, step: FloatArray
) -> FloatArray:
    """The density (S − center) · (S_u × S_v) at parameters (k,), which wrap around seams."""
    u, v = (_wrap(values, knots) for values, knots in zip((u, v), surface.knots, strict=True))
    sign_u = np.where(u + step[0] > surface.knots[0][-1], -step[0], step[0])
    sign_v = np.where(v + step[1] > surface.knots[1][-1], -step[1], step[1])
    s = evaluate_surface(surface, u, v)
    du = (evaluate_surface(surface, u + sign_u, v) - s) / sign_u[:, np.newaxis]
    dv = (evaluate_surface(surface, u, v + sign_v) - s) / sign_v[:, np.newaxis]
    density: FloatArray = ((s - center) * np.cross(du, dv)).sum(axis=1)
    return density


def _wrap(values: FloatArray, knots: FloatArray) -> FloatArray:
    """Parameters in the domain; those beyond it, on closed surfaces, moved by whole periods."""
    low, high = knots[0], knots[-1]
    inside = (values >= low) & (values <= high)
    return np.where(inside, values, low + (values - low) % (high - low))
