"""Grouping of things that are candidates for being one: same place, and nearly the same value."""

import numpy as np

from service.bases.arrays import Ints, RealArray

MAX_ROUNDS = 64
"""Groups told apart at one place before what is left there stays single. Only the apex of a finely
divided cone has this many; too many groups are no error."""


def find_leaders(place: Ints, values: RealArray, reach: float) -> Ints:
    """For each row the first one that it is near: at the same place, at most `reach` away.

    The first row at a place leads the first group; the first that is not near it leads the next.

    Parameters
    ----------
    place : ndarray of int, shape (N,)
        For each row, one row that stands for its place (that one for itself).
    values : ndarray, shape (N, d)
    reach : float
        Euclidean distance. Equal values are at distance 0 exactly, whatever their rounding.

    Returns
    -------
    ndarray of int, shape (N,)
        `leader[leader]` equals `leader`.
    """
    leader = np.arange(len(place))
    open_ = np.flatnonzero(place != leader)
    chosen = place[open_]
    for _ in range(MAX_ROUNDS if len(open_) else 0):
        step = values[open_] - values[chosen]
        near = np.einsum("nd,nd->n", step, step) <= reach**2
        leader[open_[near]] = chosen[near]
        open_ = open_[~near]
        if not len(open_):
            break
        _, first, back = np.unique(place[open_], return_index=True, return_inverse=True)
        chosen = open_[first][back]
    return leader
