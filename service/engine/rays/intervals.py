"""Intervals of t that overlap, within groups such as rays."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import find_begins


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


def count_before(
    group: Ints, values: FloatArray, own: Ints, limits: FloatArray, *, inclusive: bool
) -> Ints:
    """For each limit (m,) of a group `own` (m,): how many of the values of this group are below it.

    The values (n,), of groups (n,), are in the order of groups and of values. If `inclusive`,
    values that are equal count, too. All values of groups with lesser numbers are added.
    """
    every = np.concatenate([group, own])
    numbers = np.concatenate([values, limits])
    is_limit = np.zeros(len(every), np.intp)
    is_limit[len(group) :] = 1
    order = np.lexsort((is_limit if inclusive else 1 - is_limit, numbers, every))
    before = (1 - is_limit[order]).cumsum()
    counts = np.empty(len(every), np.intp)
    counts[order] = before
    return counts[len(group) :]


@dataclass(frozen=True, eq=False, slots=True)
class ApartIntervals:
    """n intervals of groups, which are apart within each group.

    Attributes
    ----------
    group : ndarray of int, shape (n,)
        Ascending.
    low, high : ndarray of float64, shape (n,)
        Ascending within each group.
    """

    group: Ints
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, group: Ints, low: FloatArray, high: FloatArray) -> "ApartIntervals":
        """Intervals (m,) of groups in any order; those that overlap are joined."""
        order = np.lexsort((low, group))
        group, low, high = group[order], low[order], high[order]
        first = find_begins(number_clusters(group, low, high))
        if not len(first):
            return cls(group, low, high)
        low = np.minimum.reduceat(low, first)
        return cls(group[first], low, np.maximum.reduceat(high, first))

    def find(self, group: Ints, low: FloatArray, high: FloatArray) -> tuple[Ints, Ints]:
        """How many intervals overlap [low, high] (m,) of groups, and the last of these."""
        last = count_before(self.group, self.low, group, high, inclusive=True)
        first = count_before(self.group, self.high, group, low, inclusive=False)
        # Numbers of a group without intervals before `high` are those of the group before it.
        return np.maximum(last - first, 0), last - 1
