"""Knot vectors.

A knot vector U_0 ≤ … ≤ U_{n+p+1} and a degree p define n + 1 basis functions, whose sum is 1 over
the domain [U_p, U_{n+1}]. A *break* is a distinct knot of the domain. *Span* s is the interval
[U_s, U_{s+1}] between two consecutive breaks; on a span, B-splines are polynomials. Splines are
right-continuous: a knot belongs to the span that begins at this knot; only the last knot of the
domain belongs to the span that ends there.

Piegl and Tiller, The NURBS Book, 2nd ed., chapter 2.
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints


def uniform_knots(count: int, degree: int) -> FloatArray:
    """Integer knots −p, −p + 1, … for `count` control points, shape (count + p + 1,).

    The domain is [0, count − p]. The curve does not pass through its first and last control point.
    """
    return np.arange(-degree, count + 1, dtype=np.float64)


def clamped_knots(count: int, degree: int) -> FloatArray:
    """Integer knots from 0 to count − p, both of multiplicity p + 1: shape (count + p + 1,).

    The curve begins at its first control point and ends at its last.
    """
    return np.clip(uniform_knots(count, degree), 0.0, count - degree)


def periodic_knots(count: int, degree: int) -> FloatArray:
    """Uniform knots of a closed curve with `count` distinct control points.

    The knots fit the count + p control points that `wrap_points` returns: shape (count + 2p + 1,).
    The domain is [0, count]. At its closure the curve has p − 1 continuous derivatives.
    """
    return uniform_knots(count + degree, degree)


def wrap_points(points: FloatArray, degree: int, axis: int = 0) -> FloatArray:
    """The control points, with the first p of them repeated at the end, for `periodic_knots`."""
    return np.take(points, np.arange(points.shape[axis] + degree), axis=axis, mode="wrap")


def merge_knots(knots: FloatArray, degree: int, min_distance: float) -> FloatArray:
    """Make knots equal that differ by less than `min_distance` from their neighbours.

    Such knots are a cluster; all become the first of the cluster, or the end of the domain if it is
    among them. A cluster stays as it is if its one knot would have a multiplicity above p inside
    the domain, or above p + 1 at an end, or if the whole cluster is not shorter than
    `min_distance`.

    Returns
    -------
    ndarray of float64
        The argument itself if no knot changes.
    """
    is_close = np.diff(knots) < min_distance
    if not (is_close & (knots[1:] > knots[:-1])).any():
        return knots
    # The number of the cluster of each knot.
    number = np.concatenate([[0], np.cumsum(~is_close)])
    first, count = np.unique(number, return_index=True, return_counts=True)[1:]
    last = first + count - 1
    new_knot, max_count = knots[first].copy(), np.full(len(first), degree)
    for end in (degree, len(knots) - 1 - degree):
        new_knot[number[end]], max_count[number[end]] = knots[end], degree + 1
    new_knot, max_count = new_knot[number], max_count[number]
    is_narrow = (knots[last] - knots[first] < min_distance)[number]
    return np.where(is_narrow & (count[number] <= max_count), new_knot, knots)


def domain(knots: FloatArray, degree: int) -> tuple[float, float]:
    """The domain [U_p, U_{n+1}]: its first and its last parameter."""
    return float(knots[degree]), float(knots[len(knots) - 1 - degree])


def spans(knots: FloatArray, degree: int) -> Ints:
    """The numbers s of the spans, ascending: U_s < U_{s+1} within the domain."""
    domain_knots = knots[degree : len(knots) - degree]
    return np.flatnonzero(domain_knots[1:] > domain_knots[:-1]) + degree


def breaks(knots: FloatArray, degree: int) -> FloatArray:
    """The distinct knots of the domain, ascending: shape (spans + 1,)."""
    span_numbers = spans(knots, degree)
    return np.append(knots[span_numbers], knots[span_numbers[-1] + 1])
