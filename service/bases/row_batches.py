"""Runs of consecutive rows: batches that keep arrays small, and runs of various lengths."""

from collections.abc import Iterator

import numpy as np

from service.bases.arrays import Ints
from service.cancellation import checkpoint


def row_runs(count: int, step: int) -> Iterator[tuple[int, int]]:
    """Ranges [first, last) of `count` rows, `step` at a time; work can be cancelled in between."""
    for first in range(0, count, step):
        checkpoint()
        yield first, min(first + step, count)


def row_slices(count: int, width: int, room: int) -> Iterator[slice]:
    """Slices of `count` rows of `width` numbers; a slice has at most `room` numbers, or one row."""
    for first, last in row_runs(count, max(1, room // width)):
        yield slice(first, last)


def expand_runs(count: Ints, first: Ints | int = 0) -> tuple[Ints, Ints]:
    """For n runs of `count` (n,) rows each: the run and the number of every row, run after run.

    The rows of each run are numbered upwards from its `first`, shape (n,). Both results have shape
    (Σ count,).
    """
    run = np.arange(len(count)).repeat(count)
    return run, np.arange(len(run)) + (first - count.cumsum() + count)[run]
