"""The work for each point of a query: the points share a number of pairs.

Some points need a thousand times more work than others: at the centre of a sphere all its points
are equally near. Points that need more than their share wait until the others have ended; the pairs
that these did not use are then shared again. When only such points are left, those that used the
fewest pairs continue while pairs are left. The others end with wider intervals. The budget counts
pairs and not seconds, so that the same request gets the same response.
"""

import numpy as np

from service.bases.arrays import Bools, Ints


class Share:
    """The budget of pairs of m points.

    Parameters
    ----------
    pairs : int
        Pairs of a point and a cell whose bounds may be computed.
    points : int
        m.

    Attributes
    ----------
    spent : ndarray of int, shape (m,)
        Pairs that each point has used.
    """

    def __init__(self, pairs: int, points: int) -> None:
        self.pairs = pairs
        self.spent = np.zeros(points, np.intp)

    def allot(self, counts: Ints, is_later: Bools | None = None) -> tuple[Bools, Bools]:
        """Which points continue, and which end; the others wait.

        Parameters
        ----------
        counts : ndarray of int, shape (m,)
            Pairs that each point needs next.
        is_later : ndarray of bool, shape (m,), optional
            Points that will need more pairs later. Other points with `counts` 0 end.
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
