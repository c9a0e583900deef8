"""Hits of rays on the unit sphere and on the torus of radii 1 and 0.4, as roots of polynomials.

All rays are computed in float64; rays whose roots are too close together are computed again with 50
digits. Rounding moves a root of a pair by the square root of 10⁻¹⁴, and a root of a group of three
or four by its fourth root.
"""

import numpy as np

from oracles.rays import sphere_roots, torus_roots
from oracles.sheets import Array
from service.bases.arrays import Ints

RADIUS, TUBE = 1.0, 0.4
PAIR, GROUP = 4e-5, 0.02
"""Distances of two roots of the torus, and of three or more, below which 50 digits are used."""

MIN_DISCRIMINANT = 1e-11
"""Discriminant up to which 50 digits are used for the sphere; the roots are then 6.4e-6 apart."""

Roots = tuple[Ints, Array, Array]
"""Rays (n,), t (n,), and the errors of t (n,)."""


def find_sphere_roots(origins: Array, directions: Array) -> Roots:
    """All t ≥ 0 at which rays (m, 3), with directions of length 1, meet the unit sphere."""
    middle = -(origins * directions).sum(axis=1)
    nearest_points = origins + middle[:, np.newaxis] * directions
    discriminant = 1 - (nearest_points * nearest_points).sum(axis=1)
    half_chord = np.sqrt(np.maximum(discriminant, 0.0))
    error = 1e-13 / np.maximum(half_chord, 1e-9)
    t = np.stack([middle - half_chord, middle + half_chord], axis=1)
    is_root = np.repeat((discriminant > MIN_DISCRIMINANT)[:, np.newaxis], 2, axis=1)
    ray, column = np.nonzero(is_root & (t >= 0))
    unsure_rays = np.flatnonzero(np.abs(discriminant) <= MIN_DISCRIMINANT)
    exact_roots = [sphere_roots(origins[k], directions[k]) for k in unsure_rays]
    return _join_roots((ray, t[ray, column], error[ray]), unsure_rays, exact_roots)


def find_torus_roots(origins: Array, directions: Array) -> Roots:
    """All t ≥ 0 at which rays (m, 3), with directions of length 1, meet the torus about the z axis.

    They are roots of (|P|² + R² − r²)² = 4 R² (x² + y²), R = `RADIUS` and r = `TUBE`. If t is
    measured from the point o of the ray that is nearest to 0, |P|² is |o|² + t², so the polynomial
    has no cubic term.
    """
    middle = -(origins * directions).sum(axis=1)
    o, d = origins + middle[:, np.newaxis] * directions, directions
    k = (o * o).sum(axis=1) + RADIUS**2 - TUBE**2
    # Inner products of the x and y coordinates alone.
    od, oo, dd = ((a[:, :2] * b[:, :2]).sum(axis=1) for a, b in ((o, d), (o, o), (d, d)))
    four = 4 * RADIUS**2
    c0, c1, c2 = k * k - four * oo, -2 * four * od, 2 * k - four * dd  # t⁴ + c2 t² + c1 t + c0
    companion = np.zeros((len(o), 4, 4))
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    companion[:, :3, 3] = -np.stack([c0, c1, c2], axis=1)
    roots = np.linalg.eigvals(companion)
    # The distances of the six pairs of roots, (m, 6), in ascending order. If three roots are close
    # together, three distances are small.
    distances = np.abs(roots[:, :, np.newaxis] - roots[:, np.newaxis])[:, *np.triu_indices(4, 1)]
    distances.sort(axis=1)
    is_unsure = (distances[:, 0] < PAIR) | (distances[:, 2] < GROUP)
    # The conjugate of a root that is not real would be nearer than PAIR.
    is_real = (np.abs(roots.imag) < PAIR / 4) & ~is_unsure[:, np.newaxis]
    ray, column = np.nonzero(is_real)
    t: Array = roots.real[ray, column].astype(np.float64)
    slope: Array = np.abs(4 * t**3 + 2 * c2[ray] * t + c1[ray])
    t += middle[ray]
    is_ahead = t >= 0
    unsure_rays = np.flatnonzero(is_unsure)
    exact_roots = [torus_roots(origins[k], directions[k], RADIUS, TUBE) for k in unsure_rays]
    roots_ahead = ray[is_ahead], t[is_ahead], (1e-12 / slope)[is_ahead]
    return _join_roots(roots_ahead, unsure_rays, exact_roots)


def _join_roots(roots: Roots, unsure_rays: Ints, exact_roots: list[list[float]]) -> Roots:
    """The roots, and after them those that were computed with 50 digits, whose error is 0."""
    ray, t, error = roots
    exact_rays = np.repeat(unsure_rays, [len(each) for each in exact_roots])
    values = np.array([t for each in exact_roots for t in each])
    return (
        np.concatenate([ray, exact_rays]),
        np.concatenate([t, values]),
        np.concatenate([error, np.zeros(len(values))]),
    )
