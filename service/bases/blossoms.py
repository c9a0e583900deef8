"""Extraction operators: the Bézier points of each span as combinations of control points.

On one span a B-spline C of degree p is a polynomial. Its blossom f is the one symmetric function of
p arguments that is affine in each argument, with f(t, …, t) = C(t). Control point i of the B-spline
is f(U_{i+1}, …, U_{i+p}). On the span [a, b] the B-spline is a Bézier curve, whose point j is f(a,
…, a, b, …, b) with b repeated j times. The knots among the arguments are replaced by a or b one
after the other; each replacement is a convex combination of control points.

Borden, Scott, Evans and Hughes, Isogeometric finite element data structures based on Bézier
extraction of NURBS, IJNME 87 (2011); Ramshaw, Blossoms are polar forms, CAGD 6 (1989).
"""

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.knots import spans


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
    forwards = _compute_blossoms(knots_around[:, :degree], knots_around[:, degree:])
    # The same knots in reverse order, with the opposite sign, so that they ascend.
    knots_around = -knots_around[:, ::-1]
    backwards = _compute_blossoms(knots_around[:, :degree], knots_around[:, degree:])
    # The mean of both directions, in the array of the first.
    mean = forwards
    mean += backwards[:, ::-1, ::-1]
    mean /= 2.0
    return mean


def _compute_blossoms(left_knots: FloatArray, right_knots: FloatArray) -> FloatArray:
    """The extraction operators of spans [a, b], computed in one direction along the knots.

    First the knots on the left of a span are replaced by a as arguments of the blossom, then the
    knots on its right by b.

    Parameters
    ----------
    left_knots, right_knots : ndarray of float64, shape (spans, p)
        The knots U_{s−p+1}, …, U_s = a and b = U_{s+1}, …, U_{s+p} of each span.

    Returns
    -------
    ndarray of float64, shape (spans, p+1, p+1)
    """
    count, degree = left_knots.shape
    a, b = left_knots[:, -1:], right_knots[:, :1]
    # left_k and right_k are the knots U_{s−p+k} and U_{s+k}. After r steps, row i of `rows` is
    # f(left_{r+i+1}, …, left_p, a (r times), right_1, …, right_i): at r = 0, a control point.
    rows = np.broadcast_to(np.eye(degree + 1), (count, degree + 1, degree + 1))
    # Row i of `start` is f(a (p − i times), right_1, …, right_i).
    start = np.empty((count, degree + 1, degree + 1))
    start[:, degree] = rows[:, degree]
    for r in range(1, degree + 1):
        high, low = right_knots[:, : degree - r + 1], left_knots[:, r - 1 :]
        rows = _combine_neighbours(rows, high - a, a - low, high - low)
        start[:, degree - r] = rows[:, -1]
    # After r steps, row i is f(a (p − r − i times), b (r times), right_1, …, right_i).
    operators = np.empty_like(start)
    operators[:, 0] = start[:, 0]
    rows = start
    for r in range(1, degree + 1):
        high = right_knots[:, : degree - r + 1]
        rows = _combine_neighbours(rows, high - b, b - a, high - a)
        operators[:, r] = rows[:, 0]
    return operators


def _combine_neighbours(
    rows: FloatArray, first: FloatArray, second: FloatArray, total: FloatArray
) -> FloatArray:
    """Combine each row with the next row: (first row_i + second row_{i+1}) / total."""
    mixed: FloatArray = rows[:, :-1] * (first / total)[..., np.newaxis]
    mixed += rows[:, 1:] * (second / total)[..., np.newaxis]
    return mixed
