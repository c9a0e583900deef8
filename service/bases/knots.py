"""Knot vectors, and the B-spline basis over them.

A knot vector U_0 ≤ … ≤ U_{n+p+1} and a degree p make n + 1 basis functions; their sum is one over
the domain [U_p, U_{n+1}]. A *break* is a distinct knot of the domain, a *span* s the interval [U_s,
U_{s+1}] between two consecutive breaks: B-splines are polynomials there. Splines are
right-continuous: a knot belongs to the span that begins at it, and the last knot to the last span.

Piegl and Tiller, The NURBS Book, 2nd ed., chapter 2.
"""

import numpy as np
from numpy.typing import ArrayLike

from service.bases.arrays import FloatArray, Ints


def uniform_knots(count: int, degree: int) -> FloatArray:
    """Integer knots −p, −p + 1, … for `count` control points: the domain is [0, count − p].

    The curve touches neither its first nor its last control point.
    """
    return np.arange(-degree, count + 1, dtype=np.float64)


def clamped_knots(count: int, degree: int) -> FloatArray:
    """Integer knots, 0 and count − p repeated p + 1 times: the curve ends in its control points."""
    return np.clip(uniform_knots(count, degree), 0.0, count - degree)


def periodic_knots(count: int, degree: int) -> FloatArray:
    """Uniform knots for `count` distinct control points; `wrap_points` repeats the first p.

    The domain is [0, count]; the curve closes with all its p − 1 derivatives.
    """
    return uniform_knots(count + degree, degree)


def wrap_points(points: FloatArray, degree: int, axis: int = 0) -> FloatArray:
    """Control points with the first p of them repeated at the end, for `periodic_knots`."""
    count = points.shape[axis]
    return np.take(points, np.arange(count + degree), axis=axis, mode="wrap")


def merge_knots(knots: FloatArray, degree: int, least: float) -> FloatArray:
    """The knots; neighbours that differ by less than `least` become equal.

    Multiplicities reach at most p inside the domain and p + 1 at its ends, which do not move;
    knots that would exceed these stay as they are.
    """
    joined = np.diff(knots) < least
    if not (joined & (knots[1:] > knots[:-1])).any():
        return knots
    number = np.concatenate([[0], np.cumsum(~joined)])
    first, count = np.unique(number, return_index=True, return_counts=True)[1:]
    last = first + count - 1
    value, most = knots[first].copy(), np.full(len(first), degree)
    for end in (degree, len(knots) - 1 - degree):
        value[number[end]], most[number[end]] = knots[end], degree + 1
    value, most = value[number], most[number]
    narrow = (knots[last] - knots[first] < least)[number]
    moved: FloatArray = np.where(narrow & (count[number] <= most), value, knots)
    return moved


def multiplicities(knots: FloatArray) -> tuple[FloatArray, Ints]:
    """The distinct knots and their multiplicities."""
    distinct, counts = np.unique(knots, return_counts=True)
    return distinct, counts


def domain(knots: FloatArray, degree: int) -> tuple[float, float]:
    """First and last parameter, U_p and U_{n+1}."""
    return float(knots[degree]), float(knots[len(knots) - 1 - degree])


def spans(knots: FloatArray, degree: int) -> Ints:
    """Numbers s of the spans: U_s < U_{s+1} within the domain."""
    inside = knots[degree : len(knots) - degree]
    return np.flatnonzero(inside[1:] > inside[:-1]) + degree


def breaks(knots: FloatArray, degree: int) -> FloatArray:
    """Distinct knots of the domain: one more than there are spans."""
    within = spans(knots, degree)
    return np.append(knots[within], knots[within[-1] + 1])


def find_span(knots: FloatArray, degree: int, t: ArrayLike) -> Ints:
    """Number s of the span of each parameter: U_s ≤ t < U_{s+1}; the last span at the end.

    Parameters
    ----------
    t : array_like of float64, shape (m,)
        Parameters within the domain.

    Returns
    -------
    ndarray of int, shape (m,)
    """
    within = spans(knots, degree)
    position = np.searchsorted(knots[within], np.asarray(t, dtype=np.float64), side="right") - 1
    chosen: Ints = within[np.clip(position, 0, len(within) - 1)]
    return chosen


def evaluate_basis(knots: FloatArray, degree: int, t: ArrayLike) -> tuple[Ints, FloatArray]:
    """The p + 1 B-splines that do not vanish at each parameter: N_{s−p}^p(t) … N_s^p(t).

        N_i^p(t) = (t − U_i)/(U_{i+p} − U_i) N_i^{p−1}(t)
                   + (U_{i+p+1} − t)/(U_{i+p+1} − U_{i+1}) N_{i+1}^{p−1}(t)

    Only products of non-negative numbers are added.

    Parameters
    ----------
    t : array_like of float64, shape (m,)
        Parameters within the domain.

    Returns
    -------
    span : ndarray of int, shape (m,)
        s for each parameter.
    values : ndarray of float64, shape (m, p+1)

    References
    ----------
    The NURBS Book, Algorithm A2.2, for all parameters at once.
    """
    t = np.asarray(t, dtype=np.float64)
    span = find_span(knots, degree, t)
    values = np.zeros((len(t), degree + 1))
    values[:, 0] = 1.0
    for n in range(1, degree + 1):
        steps = np.arange(n)
        right = knots[span[:, np.newaxis] + 1 + steps]
        left = knots[span[:, np.newaxis] + 1 - n + steps]
        share = values[:, :n] / (right - left)
        values[:, :n] = (right - t[:, np.newaxis]) * share
        values[:, 1 : n + 1] += (t[:, np.newaxis] - left) * share
    return span, values
