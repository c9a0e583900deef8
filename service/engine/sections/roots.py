"""Finds the roots of polynomials in Bernstein form over [0, 1] at which their signs change.

The number of sign changes of the coefficients is the number of roots in the open interval, with
multiplicities, plus an even number (Descartes' rule in Bernstein form). So an interval without sign
changes has no root, and an interval with one change has one root. Other intervals are halved. Zero
counts as positive, both for coefficients and for values; so of two intervals that meet at a root,
the one in which the polynomial is negative has the root. An interval with several sign changes is
not halved if all its coefficients are at most `floor` in absolute value, because the signs of so
small values are not reliable. It has one root if the signs at its ends differ, else a double root
at its middle: the polynomials are those of a section on the sides of cells, and there the section
touches the side or crosses itself. The same rule is used for an interval after `MAX_HALVINGS`
halvings.

All operations are elementwise, so the roots of one row do not depend on the other rows.

References
----------
Lane and Riesenfeld, Bounds on a polynomial, BIT 21 (1981).
"""

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.cancellation import checkpoint
from service.engine.nets.subdivision import halve

MAX_HALVINGS = 50
"""The most halvings of an interval; its length is then near the precision of float64."""

MAX_STEPS = 80
"""The most steps of Newton's method and bisection; bisection alone needs some 60."""


def roots(rows: FloatArray, floor: FloatArray) -> tuple[Ints, FloatArray]:
    """Find the parameters at which polynomials change their sign.

    Parameters
    ----------
    rows : ndarray of float64, shape (m, n+1)
        Bernstein coefficients.
    floor : ndarray of float64, shape (m,)
        For each row, the largest absolute value of coefficients whose signs are not reliable.

    Returns
    -------
    row : ndarray of int, shape (k,)
        The row of each root, ascending.
    t : ndarray of float64, shape (k,)
        The roots of each row, ascending; double roots occur twice. A root at an end is exactly 0 or
        1 if the coefficient at this end is 0.
    """
    # Of each interval to examine: its row, begin and coefficients. Its length is 0.5**depth.
    row_of, begin, nets, depth = np.arange(len(rows)), np.zeros(len(rows)), rows, 0
    parts: list[tuple[Ints, FloatArray]] = []
    while len(row_of):
        checkpoint()
        is_negative = nets < 0
        changes = np.count_nonzero(is_negative[:, 1:] != is_negative[:, :-1], axis=1)
        is_small = (np.abs(nets).max(axis=1) <= floor[row_of]) | (depth == MAX_HALVINGS)
        signs_differ = is_negative[:, 0] != is_negative[:, -1]
        has_single = (changes == 1) | (is_small & signs_differ)
        doubles = np.flatnonzero((changes > 1) & is_small & ~signs_differ)
        # A double root is at the middle of its interval, twice.
        parts.append(
            (
                np.repeat(row_of[doubles], 2),
                np.repeat(begin[doubles] + 0.5 ** (depth + 1), 2),
            )
        )
        if has_single.any():
            t = _find_single(nets[has_single], is_negative[has_single])
            parts.append((row_of[has_single], begin[has_single] + t * 0.5**depth))
        to_halve = np.flatnonzero((changes > 1) & ~is_small)
        if not len(to_halve):
            break
        depth += 1
        halves = np.empty((2, len(to_halve), nets.shape[1]))
        halve(nets[to_halve].T, 0, halves.transpose(2, 0, 1))
        nets = np.concatenate(halves)
        row_of = np.concatenate([row_of[to_halve], row_of[to_halve]])
        begin = np.concatenate([begin[to_halve], begin[to_halve] + 0.5**depth])
    if not parts:
        return np.zeros(0, np.intp), np.zeros(0)
    row, t = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.lexsort((t, row))
    return row[order], t[order]


def _find_single(nets: FloatArray, is_negative: Bools) -> FloatArray:
    """The only parameter (m,) in [0, 1] at which each polynomial changes its sign."""
    low, high = np.zeros(len(nets)), np.ones(len(nets))
    # The secant gives a better start than the middle.
    first, last = nets[:, 0], nets[:, -1]
    span = first - last
    t = np.where(span != 0, first / np.where(span != 0, span, 1.0), 0.5)
    t = np.where((t > 0) & (t < 1), t, 0.5)
    # If the coefficients before the change, or after it, are all 0, the root is at this end.
    is_before_change = is_negative == is_negative[:, :1]
    t[~is_negative[:, 0] & ~((nets != 0) & is_before_change).any(axis=1)] = 0.0
    t[is_negative[:, 0] & ~((nets != 0) & ~is_before_change).any(axis=1)] = 1.0
    rows = np.flatnonzero((t > 0) & (t < 1))
    begins_negative = is_negative[:, 0]
    for _ in range(MAX_STEPS):
        if not len(rows):
            break
        t_now = t[rows]
        value, slope = _values(nets[rows], t_now)
        is_before = (value < 0) == begins_negative[rows]
        low[rows] = np.where(is_before, t_now, low[rows])
        high[rows] = np.where(is_before, high[rows], t_now)
        with np.errstate(all="ignore"):
            newton_t = t_now - value / slope
        is_inside = (newton_t >= low[rows]) & (newton_t <= high[rows])
        next_t = np.where(is_inside, newton_t, (low[rows] + high[rows]) / 2)
        t[rows] = next_t
        # 2⁻⁵³ is the rounding error of numbers near 1.
        has_moved = np.abs(next_t - t_now) > 2.0**-53
        rows = rows[has_moved & (value != 0) & (high[rows] - low[rows] > 2.0**-53)]
    return t


def _values(nets: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and derivatives (m,) of polynomials (m, n+1), each at its t, by de Casteljau."""
    rows = nets.T
    slope = np.zeros(len(t))
    while len(rows) > 1:
        if len(rows) == 2:
            slope = (rows[1] - rows[0]) * (nets.shape[1] - 1)
        rows = (1 - t) * rows[:-1] + t * rows[1:]
    return rows[0], slope
