"""Blossoms of B-splines: Bézier points of spans, knot insertion and degree elevation.

On one span a B-spline C of degree p is a polynomial. Its blossom f is the one symmetric function of
p arguments that is affine in each argument, with f(t, …, t) = C(t). Control point i of the B-spline
is f(U_{i+1}, …, U_{i+p}).

On the span [a, b] the B-spline is a Bézier curve, whose point j is f(a, …, a, b, …, b) with b
repeated j times. The knots among the arguments are replaced by a or b one after the other; each
replacement is a convex combination of control points (`build_operators`).

For any new knots V the new control points are values of f, too. In a higher degree n the blossom F
is the mean of f over all choices of p of the n parameters,

    F(t_1, …, t_n) = Σ f(t_{k_1}, …, t_{k_p}) / C(n, p).

If V contains every knot of U with a multiplicity n − p higher, each new control point is a weighted
mean of old ones. No share is negative, so no digits cancel (`find_refinement`).

Borden, Scott, Evans and Hughes, Isogeometric finite element data structures based on Bézier
extraction of NURBS, IJNME 87 (2011); Ramshaw, Blossoms are polar forms, CAGD 6 (1989); Cohen, Lyche
and Riesenfeld, Discrete B-splines and subdivision techniques, CGIP 14 (1980); Prautzsch, Degree
elevation of B-spline curves, CAGD 1 (1984).
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.knots import spans
from service.bases.row_batches import row_slices


def build_operators(knots: FloatArray, degree: int) -> FloatArray:
    """The p + 1 Bézier points of every span as combinations of p + 1 control points.

    Parameters
    ----------
    knots : ndarray of float64
        Any knot vector: clamped or not, multiplicities up to p + 1.

    Returns
    -------
    ndarray of float64, shape (spans, p+1, p+1)
        Row j times the control points s − p … s is Bézier point j of span s. No entry is negative,
        and each row has the sum 1. Reversed knots give the reversed operators, bit for bit.
    """
    positions = spans(knots, degree)[:, np.newaxis] + np.arange(1 - degree, degree + 1)
    knots_around = knots[positions]
    identity = np.broadcast_to(np.eye(degree + 1), (len(positions), degree + 1, degree + 1))
    forwards = find_bezier_points(identity, knots_around)

    # The same knots in reverse order, with the opposite sign, so that they ascend.
    knots_around = -knots_around[:, ::-1]
    backwards = find_bezier_points(identity, knots_around)
    # The mean of both directions, in the array of the first.
    mean = forwards
    mean += backwards[:, ::-1, ::-1]
    mean /= 2.0
    return mean


def find_bezier_points(points: FloatArray, knots_around: FloatArray) -> FloatArray:
    """The p + 1 Bézier points of spans [a, b], which may belong to many splines of degree p.

    First the knots on the left of a span are replaced by a as arguments of the blossom, then the
    knots on its right by b: de Boor's algorithm, twice. All steps are convex combinations.

    Parameters
    ----------
    points : ndarray of float64, shape (m, p+1, D)
        The control points s − p … s of each span.
    knots_around : ndarray of float64, shape (m, 2p)
        The knots U_{s−p+1}, …, U_s = a and b = U_{s+1}, …, U_{s+p} of each span.

    Returns
    -------
    ndarray of float64, shape (m, p+1, D)
    """
    count, degree = len(knots_around), knots_around.shape[1] // 2
    left_knots, right_knots = knots_around[:, :degree], knots_around[:, degree:]
    a, b = left_knots[:, -1:], right_knots[:, :1]
    # left_k and right_k are the knots U_{s−p+k} and U_{s+k}. After r steps, row i of `rows` is
    # f(left_{r+i+1}, …, left_p, a (r times), right_1, …, right_i): at r = 0, a control point.
    rows = points
    # Row i of `start` is f(a (p − i times), right_1, …, right_i).
    start = np.empty((count, degree + 1, points.shape[2]))
    start[:, degree] = rows[:, degree]
    for r in range(1, degree + 1):
        high, low = right_knots[:, : degree - r + 1], left_knots[:, r - 1 :]
        rows = _combine_neighbours(rows, high - a, a - low, high - low)
        start[:, degree - r] = rows[:, -1]
    # After r steps, row i is f(a (p − r − i times), b (r times), right_1, …, right_i).
    bezier = np.empty_like(start)
    bezier[:, 0] = start[:, 0]
    rows = start
    for r in range(1, degree + 1):
        high = right_knots[:, : degree - r + 1]
        rows = _combine_neighbours(rows, high - b, b - a, high - a)
        bezier[:, r] = rows[:, 0]
    return bezier


def _combine_neighbours(
    rows: FloatArray, first: FloatArray, second: FloatArray, total: FloatArray
) -> FloatArray:
    """Combine each row with the next row: (first row_i + second row_{i+1}) / total."""
    mixed: FloatArray = rows[:, :-1] * (first / total)[..., np.newaxis]
    mixed += rows[:, 1:] * (second / total)[..., np.newaxis]
    return mixed


CHUNK = 1024
"""Number of new control points that are computed at once: their shares then stay in the
processor's cache."""


def find_refinement(
    knots: FloatArray, degree: int, target: FloatArray, new_degree: int
) -> tuple[Ints, FloatArray]:
    """The new control points of a spline over other knots, as weighted means of the old ones.

    Parameters
    ----------
    knots : ndarray of float64, shape (m,)
        U: p + 1 knots are at or below the first parameter of the domain, and p + 1 are at or above
        its last parameter.
    target : ndarray of float64, shape (N+n+1,)
        V: the interior knots of U, each with a multiplicity n − p higher, and possibly more knots
        within the domain; each end has multiplicity n + 1.
    new_degree : int
        The new degree n ≥ p.

    Returns
    -------
    index : ndarray of int, shape (p+1, N)
        The rows of the control net that new control point j combines, in column j.
    shares : ndarray of float64, shape (p+1, N)
        The shares of these rows. If a new control point equals an old one, one share is exactly 1
        and the others are 0.
    """
    # Window j has the knots V_{j+1} … V_{j+n}: new control point j is F at these arguments.
    windows = np.lib.stride_tricks.sliding_window_view(target[1:-1], new_degree)
    count, first = len(windows), windows[:, 0]
    # F belongs to the span that begins at the first argument or contains it. But n equal arguments
    # after a smaller knot are the end of a span, and the next span may have other values there.
    is_span_end = (target[:count] < first) & (windows[:, -1] == first)
    span = np.searchsorted(knots, first, side="right")
    span = np.where(is_span_end, np.searchsorted(knots, first, side="left"), span) - 1
    offsets = np.arange(1 - degree, degree + 1)[:, np.newaxis]
    shares = np.empty((degree + 1, count))
    for chunk in row_slices(count, 1, CHUNK):
        shares[:, chunk] = _blossom_shares(knots[span[chunk] + offsets], windows[chunk].T)
    return span - degree + np.arange(degree + 1)[:, np.newaxis], shares


def _blossom_shares(knots_around: FloatArray, arguments: FloatArray) -> FloatArray:
    """Values of blossoms F, each as shares of the p + 1 control points of a span.

    Parameters
    ----------
    knots_around : ndarray of float64, shape (2p, N)
        The knots U_{s−p+1} … U_{s+p} around the span s of each value.
    arguments : ndarray of float64, shape (n, N)
        The n arguments of F for each value.

    Returns
    -------
    ndarray of float64, shape (p+1, N)
    """
    degree, new_degree = len(knots_around) // 2, len(arguments)
    # means[r] belongs to the r + 1 points that remain after p − r steps of de Boor's algorithm. It
    # has their shares (r+1, N), averaged over all choices of r from the arguments seen so far.
    means = [np.ones((1, knots_around.shape[1]))]
    for k, t in enumerate(arguments, 1):
        # For means[p] after all n arguments, only r ≥ k − (n − p) are still needed.
        for r in range(min(k, degree), max(0, k - 1 - new_degree + degree), -1):
            step = _step_back(means[r - 1], knots_around[degree - r : degree + r], t)
            if r == k:
                means.append(step)
            else:
                means[r] = ((k - r) * means[r] + r * step) / k
    return means[degree]


def _step_back(shares: FloatArray, knots_around: FloatArray, t: FloatArray) -> FloatArray:
    """Shares (r+1, N) of r + 1 points from the shares (r, N) of the r points of one de Boor step.

    `knots_around`, shape (2r, N), has the r knots U_i and then the r knots U_{i+r} of the step

        d_i ← (U_{i+r} − t)/(U_{i+r} − U_i) d_{i−1} + (t − U_i)/(U_{i+r} − U_i) d_i
    """
    r = len(shares)
    low, high = knots_around[:r], knots_around[r:]
    width = high - low
    result = np.zeros((r + 1, shares.shape[1]))
    # Divide, do not multiply by an inverse: only then is the factor exactly 1 if t is low or high.
    result[:-1] = shares * ((high - t) / width)
    result[1:] += shares * ((t - low) / width)
    return result


def raise_knots(
    knots: FloatArray, degree: int, new_degree: int, first: float, last: float
) -> FloatArray:
    """The knots of a spline after it is restricted to [first, last] and elevated to `new_degree`.

    The multiplicity of interior knots increases by the same number as the degree, so the
    continuity at these knots stays the same. The ends have multiplicity `new_degree` + 1.
    """
    breaks, counts = np.unique(knots[(knots > first) & (knots < last)], return_counts=True)
    return np.concatenate(
        [
            np.full(new_degree + 1, first),
            np.repeat(breaks, counts + new_degree - degree),
            np.full(new_degree + 1, last),
        ]
    )
