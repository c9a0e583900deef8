"""Runs of rows: batches that keep arrays small, and runs of any lengths one after another."""

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
    """Slices of `count` rows, room // width rows at a time (at least 1): `room` numbers in all."""
    for first, last in row_runs(count, max(1, room // width)):
        yield slice(first, last)


def expand_runs(count: Ints, first: Ints | int = 0) -> tuple[Ints, Ints]:
    """The runs that rows belong to, and their numbers, for n runs of `count` rows, run after run.

    The rows of each run are numbered from its `first`, shape (n,), upwards. Shape (Σ count,) each.
    """
    run = np.arange(len(count)).repeat(count)
    return run, np.arange(len(run)) + (first - count.cumsum() + count)[run]
