"""Groups of rows that have the same place and nearly the same value."""

import numpy as np

from service.bases.arrays import Ints, RealArray

MAX_ROUNDS = 64
"""The most groups at one place; the rows that remain there are not grouped. Only the apex of a
finely divided cone has this many groups, and more groups are no error."""


def find_leaders(place: Ints, values: RealArray, reach: float) -> Ints:
    """For each row the first row that it is near: at the same place, at most `reach` away.

    The first row at a place leads the first group; the first row that is not near it leads the next
    group.

    Parameters
    ----------
    place : ndarray of int, shape (N,)
        For each row, the number of one row at its place, the same number for all rows there.
    values : ndarray, shape (N, d)
    reach : float
        Euclidean distance. Equal values are at distance 0 exactly, whatever their rounding.

    Returns
    -------
    ndarray of int, shape (N,)
        `leader[leader]` equals `leader`.
    """
    leader = np.arange(len(place))
    remaining = np.flatnonzero(place != leader)
    candidates = place[remaining]
    for _ in range(MAX_ROUNDS if len(remaining) else 0):
        step = values[remaining] - values[candidates]
        is_near = np.einsum("nd,nd->n", step, step) <= reach**2
        leader[remaining[is_near]] = candidates[is_near]
        remaining = remaining[~is_near]
        if not len(remaining):
            break
        _, first, back = np.unique(place[remaining], return_index=True, return_inverse=True)
        candidates = remaining[first][back]
    return leader
