"""Batches of rows, small enough that the arrays computed for one batch stay small."""

from collections.abc import Iterator

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
