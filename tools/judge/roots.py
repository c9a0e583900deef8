"""Hits of rays on the unit sphere and on the torus of radii 1 and 0.4, as roots of polynomials.

All rays are computed in float64; rays whose roots are too close together are computed again with 50
digits. Rounding moves a root of a pair by the square root of 10⁻¹⁴, and a root of a group of three
or four by its fourth root.
"""

import numpy as np

from service.bases.arrays import Ints
from tests.oracles.rays import sphere_roots, torus_roots
from tests.oracles.sheets import Array

RADIUS, TUBE = 1.0, 0.4
PAIR, GROUP = 4e-5, 0.02
"""Distances of two roots, and of three or more, below which 50 digits are used."""

Roots = tuple[Ints, Array, Array]
"""Rays (n,), t (n,), and the errors of t (n,)."""


def find_sphere_roots(origins: Array, directions: Array) -> Roots:
    """All t ≥ 0 of rays (m, 3), directions of length 1, for the unit sphere."""
    middle = -(origins * directions).sum(axis=1)
    away = origins + middle[:, np.newaxis] * directions
    square = 1 - (away * away).sum(axis=1)
    half = np.sqrt(np.maximum(square, 0.0))
    error = 1e-13 / np.maximum(half, 1e-9)
    t = np.stack([middle - half, middle + half], axis=1)
    is_root = np.repeat((square > 1e-11)[:, np.newaxis], 2, axis=1)
    ray, which = np.nonzero(is_root & (t >= 0))
    unsure = np.flatnonzero(np.abs(square) <= 1e-11)
    exact = [sphere_roots(origins[k], directions[k]) for k in unsure]
    return _join_roots((ray, t[ray, which], error[ray]), unsure, exact)


def find_torus_roots(origins: Array, directions: Array) -> Roots:
    """All t ≥ 0 of rays (m, 3), directions of length 1, for the torus about the z axis."""
    middle = -(origins * directions).sum(axis=1)
    o, d = origins + middle[:, np.newaxis] * directions, directions
    k = (o * o).sum(axis=1) + RADIUS**2 - TUBE**2
    od, oo, dd = ((a[:, :2] * b[:, :2]).sum(axis=1) for a, b in ((o, d), (o, o), (d, d)))
    four = 4 * RADIUS**2
    c0, c1, c2 = k * k - four * oo, -2 * four * od, 2 * k - four * dd  # t⁴ + c2 t² + c1 t + c0
    companion = np.zeros((len(o), 4, 4))
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    companion[:, :3, 3] = -np.stack([c0, c1, c2], axis=1)
    roots = np.linalg.eigvals(companion)
    apart = np.abs(roots[:, :, np.newaxis] - roots[:, np.newaxis])[:, *np.triu_indices(4, 1)]
    apart.sort(axis=1)
    is_unsure = (apart[:, 0] < PAIR) | (apart[:, 2] < GROUP)
    is_real = (np.abs(roots.imag) < PAIR / 4) & ~is_unsure[:, np.newaxis]
    ray, which = np.nonzero(is_real)
    t: Array = roots.real[ray, which].astype(np.float64)
    slope: Array = np.abs(4 * t**3 + 2 * c2[ray] * t + c1[ray])
    t += middle[ray]
    ahead = t >= 0
    unsure = np.flatnonzero(is_unsure)
    exact = [torus_roots(origins[k], directions[k], RADIUS, TUBE) for k in unsure]
    return _join_roots((ray[ahead], t[ahead], (1e-12 / slope)[ahead]), unsure, exact)


def _join_roots(roots: Roots, rays: Ints, exact: list[list[float]]) -> Roots:
    ray, t, error = roots
    more = np.repeat(rays, [len(each) for each in exact])
    values = np.array([t for each in exact for t in each])
    return (
        np.concatenate([ray, more]),
        np.concatenate([t, values]),
        np.concatenate([error, np.zeros(len(values))]),
    )
