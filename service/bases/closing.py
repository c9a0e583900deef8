"""The closure of splines whose ends are equal in exact arithmetic."""

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.extraction import SAME_SHARE
from service.bases.polynomials import Net


def close_rows(new_net: Net, old_net: Net, index: Ints, shares: FloatArray) -> Net:
    """Copy the first row of `new_net` to its last if both are equal but for rounding.

    The ends of a periodic spline are equal in exact arithmetic, and must stay equal after rounding.
    Both rows are weighted means of rows of `old_net`, by `index` and `shares`: they are equal if
    these rows are equal and the shares differ by rounding alone.
    """
    first, last = (np.flatnonzero(shares[:, end]) for end in (0, -1))
    has_same_shares = len(first) == len(last) and bool(
        (np.abs(shares[first, 0] - shares[last, -1]) <= SAME_SHARE).all()
    )
    begin, end = index[first, 0], index[last, -1]
    if has_same_shares and all(np.array_equal(v[begin], v[end]) for v in old_net if v is not None):
        for values in new_net:
            if values is not None:
                values[-1] = values[0]
    return new_net
