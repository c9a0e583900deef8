"""Control points of B-splines over other knots, by blossoms: knot insertion, degree elevation.

On each of its spans a spline of degree p is a polynomial. Its blossom f is the one symmetric
function of p parameters that is affine in each and has f(t, …, t) equal to the curve at t. The
control point P_i is f(U_{i+1}, …, U_{i+p}). So for any new knots V the new control points are
values of f. In a higher degree n the blossom is the mean over all choices,

    F(t_1, …, t_n) = Σ f(t_{k_1}, …, t_{k_p}) / C(n, p).

If V has every knot of U, with a multiplicity n − p higher, every value is a mean of control points
with shares that are not negative: nothing cancels.

Ramshaw, Blossoms are polar forms, CAGD 6 (1989); Cohen, Lyche and Riesenfeld, Discrete B-splines
and subdivision techniques, CGIP 14 (1980); Prautzsch, Degree elevation of B-spline curves, CAGD 1
(1984).
"""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import row_slices

CHUNK = 1024
"""Control points in one chunk: their shares stay in the processor's cache."""


def find_refinement(
    knots: FloatArray, degree: int, target: FloatArray, raised: int
) -> tuple[Ints, FloatArray]:
    """Shares of the old control points in the new ones, over other knots.

    Parameters
    ----------
    knots : ndarray of float64, shape (m,)
        U: p + 1 knots up to the first parameter of the domain, and p + 1 from its last parameter
        on.
    target : ndarray of float64, shape (N+n+1,)
        V: the interior knots of U, each with a multiplicity n − p higher, and any other knots
        within the domain; each end has multiplicity n + 1.
    raised : int
        n ≥ p.

    Returns
    -------
    index : ndarray of int, shape (p+1, N)
        Rows of the control net.
    shares : ndarray of float64, shape (p+1, N)
        If the new control point is an old one, its shares are exactly one and zeros.
    """
    windows = np.lib.stride_tricks.sliding_window_view(target[1:-1], raised)
    count, first = len(windows), windows[:, 0]
    # Where the spline is discontinuous, the last point of a piece belongs to the span before.
    ends = (target[:count] < first) & (windows[:, -1] == first)
    span = np.searchsorted(knots, first, side="right")
    span = np.where(ends, np.searchsorted(knots, first, side="left"), span) - 1
    around = np.arange(1 - degree, degree + 1)[:, np.newaxis]
    shares = np.empty((degree + 1, count))
    for part in row_slices(count, 1, CHUNK):
        shares[:, part] = _blossom_shares(knots[span[part] + around], windows[part].T)
    return span - degree + np.arange(degree + 1)[:, np.newaxis], shares


def _blossom_shares(near: FloatArray, arguments: FloatArray) -> FloatArray:
    """Shares of the p + 1 control points of a span in the blossom, (p+1, N).

    Parameters
    ----------
    near : ndarray of float64, shape (2p, N)
        U_{s−p+1} … U_{s+p}.
    arguments : ndarray of float64, shape (n, N)
    """
    degree, raised = len(near) // 2, len(arguments)
    # means[r] is the mean over all choices of r of the arguments so far, as shares (r+1, N) of the
    # r + 1 points that remain after p − r steps of de Boor's algorithm.
    means = [np.ones((1, near.shape[1]))]
    for k, t in enumerate(arguments, 1):
        for r in range(min(k, degree), max(0, k - 1 - raised + degree), -1):
            step = _step_back(means[r - 1], near[degree - r : degree + r], t)
            if r == k:
                means.append(step)
            else:
                means[r] = ((k - r) * means[r] + r * step) / k
    return means[degree]


def _step_back(shares: FloatArray, near: FloatArray, t: FloatArray) -> FloatArray:
    """Shares of r + 1 points from the shares of the r points that one de Boor step computes.

    d_i ← (U_{i+r} − t)/(U_{i+r} − U_i) d_{i−1} + (t − U_i)/(U_{i+r} − U_i) d_i
    """
    r = len(shares)
    low, high = near[:r], near[r:]
    width = high - low
    result = np.zeros((r + 1, shares.shape[1]))
    # The quotient is exactly 1 if t is an end; a product with an inverse may differ from 1.
    result[:-1] = shares * ((high - t) / width)
    result[1:] += shares * ((t - low) / width)
    return result


def raise_knots(
    knots: FloatArray, degree: int, raised: int, first: float, last: float
) -> FloatArray:
    """Knots of the spline over [first, last] in the degree `raised` ≥ `degree`.

    The multiplicity of interior knots increases by the same number as the degree, which keeps the
    continuity there; the ends have multiplicity `raised` + 1.
    """
    within = knots[(knots > first) & (knots < last)]
    breaks, counts = np.unique(within, return_counts=True)
    return np.concatenate(
        [
            np.full(raised + 1, first),
            np.repeat(breaks, counts + raised - degree),
            np.full(raised + 1, last),
        ]
    )
