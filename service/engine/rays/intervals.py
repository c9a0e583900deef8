"""Intervals of t that overlap."""

import numpy as np

from service.bases.arrays import FloatArray, Ints


def number_clusters(group: Ints, low: FloatArray, high: FloatArray) -> Ints:
    """Numbers (n,) of the clusters of intervals [low, high] that overlap within one group.

    Intervals are in the order of groups and of `low`.
    """
    is_start = np.diff(group, prepend=-1) != 0
    # The running maximum of `high` for each group, by ranks: those of different groups do not
    # overlap.
    rank = np.lexsort((high, group))
    rank_of_row = np.empty(len(rank), np.intp)
    rank_of_row[rank] = np.arange(len(rank))
    max_high_before = high[rank[np.maximum.accumulate(rank_of_row)]] if len(rank) else high
    is_start[1:] |= low[1:] > max_high_before[:-1]
    return np.cumsum(is_start) - 1
