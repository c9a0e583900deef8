"""Divides a budget of pairs, of a point (or ray) and a cell, among the points of a query.

Some points need a thousand times more work than others. For example, all points of a sphere are
equally near to its centre. A point that needs more pairs than its share waits until the other
points have ended; the pairs that they did not use are then shared again. When all remaining points
need more than their share, the points that have used the fewest pairs continue while pairs are
left, and the remaining points end without the requested precision. The budget counts pairs, not
seconds, so that the same request always gets the same response.
"""

import numpy as np

from service.bases.arrays import Bools, Ints


class Share:
    """The budget of pairs of m points.

    Parameters
    ----------
    pairs : int
        How many pairs of a point and a cell may be computed in all.
    points : int
        The number of points, m.

    Attributes
    ----------
    spent : ndarray of int, shape (m,)
        How many pairs each point has used.
    """

    def __init__(self, pairs: int, points: int) -> None:
        self.pairs = pairs
        self.spent = np.zeros(points, np.intp)

    def allot(self, counts: Ints, is_later: Bools | None = None) -> tuple[Bools, Bools]:
        """Decide which points continue, and which end; all other points wait.

        Parameters
        ----------
        counts : ndarray of int, shape (m,)
            How many pairs each point needs next.
        is_later : ndarray of bool, shape (m,), optional
            Points that will need more pairs later. Without it, a point with `counts` 0 has ended.

        Returns
        -------
        is_served, is_ended : ndarray of bool, shape (m,)
            Points that continue, and points that end because no pairs are left.
        """
        is_next = counts > 0
        is_open = is_next if is_later is None else is_next | is_later
        total = self.spent + counts
        # Open points have equal shares of the pairs that points which ended have not used.
        available_pairs = self.pairs - int(self.spent[~is_open].sum())
        is_served = is_next & (total * np.count_nonzero(is_open) <= available_pairs)
        is_ended = np.zeros(len(counts), bool)
        # If every share is too small, and no later pairs are to come, serve the points with the
        # smallest totals while pairs are left. Points that are not open sort first, with no counts.
        if is_next.any() and not is_served.any() and not (is_open & ~is_next).any():
            order = np.argsort(np.where(is_open, total, 0), kind="stable")
            remaining_pairs = self.pairs - int(self.spent.sum())
            is_served[order] = np.cumsum(counts[order]) <= remaining_pairs
            is_served &= is_open
            is_ended = is_open & ~is_served
        self.spent[is_served] += counts[is_served]
        return is_served, is_ended
