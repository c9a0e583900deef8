"""Foot points: the parameters at which surfaces are nearest to given points.

Newton's method without second partials (Gauss–Newton), for all points at once: its error after a
step is about the square of the step where the points are on the surfaces, and a share of it, the
distance over the least radius of curvature, where they are not. Steps are clamped to the domain.
Where one parameter would leave it, the other moves alone. Steps that lead further away, as near
knots at which the speed of the surface changes, are shortened.

References
----------
Piegl and Tiller, The NURBS Book, 2nd ed., section 6.1.
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.trims.closure import ClosedSurfaces
from service.engine.vectors import dot, length

STEPS = 18
"""The most steps for a point."""

LAST_STEP = 2.0**-20
"""A step of at most this share of the domain is the last one: the next one would be about as long
as the unit of rounding."""

FAST_STEP, FASTER = 2.0**-16, 2.0**-7
"""So is a step of at most `FAST_STEP` that is at most `FASTER` times as long as the one before."""

BATCH = 1 << 15
"""The most points whose feet are looked for at once."""

NOISE = 2.0**-44
"""Distances that differ by less than this share of the coordinates are equal."""


def find_feet(
    surfaces: ClosedSurfaces, face: Ints, points: FloatArray, guess: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The foot points of points, found from first guesses; local minima of the distance.

    Parameters
    ----------
    face : ndarray of int, shape (m,)
    points : ndarray of float64, shape (m, 3)
    guess : ndarray of float64, shape (m, 2)
        Parameters; along closed axes they may be beyond the domain, and so may the result.

    Returns
    -------
    parameters : ndarray of float64, shape (m, 2)
        The nearest of the points that were tried.
    distance : ndarray of float64, shape (m,)
    """
    noise = NOISE * float(np.abs(points).max(initial=0.0))
    if len(face) <= BATCH:
        return _find_batch(surfaces, face, points, guess, noise)
    rows = [slice(first, first + BATCH) for first in range(0, len(face), BATCH)]
    found = [_find_batch(surfaces, face[k], points[k], guess[k], noise) for k in rows]
    return np.concatenate([feet for feet, _ in found]), np.concatenate([far for _, far in found])


def _find_batch(
    surfaces: ClosedSurfaces, face: Ints, points: FloatArray, guess: FloatArray, noise: float
) -> tuple[FloatArray, FloatArray]:
    """Feet and distances of all points at once; distances within `noise` of another are equal."""
    low, high = _find_limits(surfaces, face)
    current = np.minimum(np.maximum(guess, low), high)
    best, least = current.copy(), np.full(len(face), np.inf)
    active = np.arange(len(face))
    inverse = 1.0 / surfaces.period.take(face, axis=0)  # (m, 2)
    before = np.zeros(len(face))
    for step in range(STEPS + 1):
        checkpoint()
        partials = surfaces.evaluate_partials(face[active], current)
        rest = points.take(active, axis=0) - partials[0]
        distance, known = length(rest, -1), least[active]
        rows, worse = (distance < known).nonzero()[0], (distance > known + noise).nonzero()[0]
        # A point that moved to a greater distance tries a quarter of this step.
        retried = active[worse]
        retry = (current.take(worse, axis=0) - best.take(retried, axis=0)) / 4
        if len(rows) < len(active):
            active, distance = active[rows], distance[rows]
            current, rest = current.take(rows, axis=0), rest.take(rows, axis=0)
            partials = partials.take(rows, axis=1)
        best[active], least[active] = current, distance
        if step == STEPS:
            break
        vectors = rest, partials[1], partials[2]
        following = _step(current, vectors, low.take(active, axis=0), high.take(active, axis=0))
        moved = following - current
        shares = np.abs(moved) * inverse.take(active, axis=0)
        share = np.maximum(shares[:, 0], shares[:, 1])
        is_last = share <= np.where(share <= FASTER * before[active], FAST_STEP, LAST_STEP)
        before[active] = share
        rows = is_last.nonzero()[0]
        if len(rows):
            # The last step is so short that the surface is its tangent plane.
            last, along = active[rows], moved.take(rows, axis=0)
            su, sv = partials[1:].take(rows, axis=1)
            rest = rest.take(rows, axis=0) - along[:, :1] * su - along[:, 1:] * sv
            best[last], least[last] = following.take(rows, axis=0), length(rest, -1)
            rows = (~is_last).nonzero()[0]
            active, following = active[rows], following.take(rows, axis=0)
        if len(retried):
            is_long = (np.abs(retry) * inverse.take(retried, axis=0) > LAST_STEP).any(axis=1)
            retried, retry = retried[is_long], retry[is_long]
            retry += best.take(retried, axis=0)
            active = np.concatenate([active, retried])
            following = np.concatenate([following, retry])
        if not len(active):
            break
        current = following
    return best, least


def measure_errors(
    surfaces: ClosedSurfaces, face: Ints, points: FloatArray, parameters: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """How far points of surfaces are from foot points, along the surface; and from the points.

    The first is the length of the next step of Newton's method, (m,), for parameters (m, 2).
    """
    low, high = _find_limits(surfaces, face)
    x = np.minimum(np.maximum(parameters, low), high)
    s, su, sv = surfaces.evaluate_partials(face, x)
    rest = points - s
    step = _step(x, (rest, su, sv), low, high) - x
    return length(step[:, :1] * su + step[:, 1:] * sv, -1), length(rest, -1)


def _find_limits(surfaces: ClosedSurfaces, face: Ints) -> tuple[FloatArray, FloatArray]:
    """Least and greatest parameters (m, 2): those of the domain, but without end if closed."""
    is_closed = surfaces.is_closed
    low = np.where(is_closed, -np.inf, surfaces.low)
    high = np.where(is_closed, np.inf, surfaces.surfaces.high)
    return low.take(face, axis=0), high.take(face, axis=0)


def _step(
    x: FloatArray,
    vectors: tuple[FloatArray, FloatArray, FloatArray],
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """The next parameters (m, 2), from the present ones and r = P − S, S_u and S_v, (m, 3) each.

    The step (a, b) solves the normal equations of min |a S_u + b S_v − r|.
    """
    rest, su, sv = vectors
    uu, uv, vv = dot(su, su, -1), dot(su, sv, -1), dot(sv, sv, -1)
    ru, rv = dot(su, rest, -1), dot(sv, rest, -1)
    determinant = uu * vv - uv * uv
    is_regular = determinant > 1e-14 * uu * vv
    safe_u, safe_v = np.where(uu > 0, uu, 1.0), np.where(vv > 0, vv, 1.0)
    safe = np.where(is_regular, determinant, 1.0)
    # Where S_u and S_v are parallel, or one is 0, the longer one moves alone.
    a = np.where(is_regular, (vv * ru - uv * rv) / safe, np.where(uu > vv, ru / safe_u, 0.0))
    b = np.where(is_regular, (uu * rv - uv * ru) / safe, np.where(vv >= uu, rv / safe_v, 0.0))
    free = x + np.array([a, b]).T
    clamped = np.minimum(np.maximum(free, low), high)
    is_hit = clamped != free
    # With a fixed, b is (r − a S_u) · S_v / S_v², and the reverse.
    fixed = clamped - x
    b = (rv - uv * fixed[:, 0]) / safe_v
    a = (ru - uv * fixed[:, 1]) / safe_u
    only_u, only_v = is_hit[:, 0] & ~is_hit[:, 1], is_hit[:, 1] & ~is_hit[:, 0]
    clamped[:, 1] = np.where(only_u, x[:, 1] + b, clamped[:, 1])
    clamped[:, 0] = np.where(only_v, x[:, 0] + a, clamped[:, 0])
    result: FloatArray = np.minimum(np.maximum(clamped, low), high)
    return result
