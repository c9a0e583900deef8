"""How much work each point of a query gets: its points share a number of pairs.

Some points need a thousand times as much work as others: seen from the centre of a sphere all of it
is as near. Points that would take more than their part wait until those that need less have ended,
and what these leave is shared again. At last, when only such points are left, those that took least
go on while it lasts; the others end as they are, with wider intervals.

Pairs are counted, not seconds: the same request gets the same answer.
"""

import numpy as np

from service.bases.arrays import Bools, Ints


class Share:
    """The pairs that m points together may spend.

    Parameters
    ----------
    pairs : int
        Pairs of a point and a cell that may be looked at.
    points : int
        m.

    Attributes
    ----------
    spent : ndarray of int, shape (m,)
        Pairs of each point that were looked at.
    """

    def __init__(self, pairs: int, points: int) -> None:
        self.pairs = pairs
        self.spent = np.zeros(points, np.intp)

    def allot(self, counts: Ints, is_later: Bools | None = None) -> tuple[Bools, Bools]:
        """Which points go on, and which end; the others wait.

        Parameters
        ----------
        counts : ndarray of int, shape (m,)
            Pairs that each would look at next.
        is_later : ndarray of bool, shape (m,), optional
            Points that will look at more pairs than these, later. The others end with `counts` 0.
        """
        is_next = counts > 0
        is_open = is_next if is_later is None else is_next | is_later
        total = self.spent + counts
        free = self.pairs - int(self.spent[~is_open].sum())
        goes = is_next & (total * np.count_nonzero(is_open) <= free)
        ends = np.zeros(len(counts), bool)
        if is_next.any() and not goes.any() and not (is_open & ~is_next).any():
            order = np.argsort(np.where(is_open, total, 0), kind="stable")
            left = self.pairs - int(self.spent.sum())
            goes[order] = np.cumsum(counts[order]) <= left
            goes &= is_open
            ends = is_open & ~goes
        self.spent[goes] += counts[goes]
        return goes, ends
