"""Groups of rows that have the same place and nearly the same value."""

import numpy as np

from service.bases.arrays import Ints, RealArray

MAX_ROUNDS = 64
"""The most groups at one place. Each row that then remains leads a group of its own. This is no
error, but fewer vertices are shared. Only the apex of a finely divided cone has this many
groups."""


def find_leaders(place: Ints, values: RealArray, reach: float) -> Ints:
    """For each row, the leader of its group: the first row of the group.

    The first row at a place leads a group; all rows at the place whose values are at most `reach`
    from the leader's value belong to the group. The first of the remaining rows leads the next
    group at this place.

    Parameters
    ----------
    place : ndarray of int, shape (N,)
        For each row, the number of one row at its place, the same number for all rows there.
    values : ndarray, shape (N, d)
    reach : float
        Euclidean distance. Equal values are at distance 0 exactly, so with reach 0 only equal
        values are grouped.

    Returns
    -------
    ndarray of int, shape (N,)
        Numbers of rows. A leader is its own leader: `leader[leader]` equals `leader`.
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
        _, first, inverse = np.unique(place[remaining], return_index=True, return_inverse=True)
        candidates = remaining[first][inverse]
    return leader
