"""Runs of consecutive rows of an array.

Work on one batch of rows at a time keeps temporary arrays small.
"""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import Ints
from service.cancellation import checkpoint


def row_runs(count: int, step: int) -> Iterator[tuple[int, int]]:
    """Ranges [begin, end) of `step` rows that cover `count` rows; the last may be shorter.

    A request can be cancelled before each range.
    """
    for begin in range(0, count, step):
        checkpoint()
        yield begin, min(begin + step, count)


def row_slices(count: int, width: int, max_size: int) -> Iterator[slice]:
    """Slices that cover `count` rows. A row has the size `width`, in numbers or in bytes.

    A slice has at most the size `max_size`, in the same unit, but at least one row. A request can
    be cancelled before each slice.
    """
    for begin, end in row_runs(count, max(1, max_size // width)):
        yield slice(begin, end)


def expand_runs(count: Ints, first: Ints | int = 0) -> tuple[Ints, Ints]:
    """The rows of n runs, one run after another: for each row its run and its number.

    Parameters
    ----------
    count : ndarray of int, shape (n,)
        How many rows each run has.
    first : ndarray of int, shape (n,), or int
        The number of the first row of each run; the rows of a run are numbered consecutively.

    Returns
    -------
    run, number : ndarray of int, shape (Σ count,)
    """
    run = np.arange(len(count)).repeat(count)
    return run, np.arange(len(run)) + (first - count.cumsum() + count)[run]
