"""Long work in pieces: runs of rows, so few at a time that what is computed of them stays small."""

from collections.abc import Iterator

from service.cancellation import checkpoint


def runs(count: int, step: int) -> Iterator[tuple[int, int]]:
    """Rows [first, last) of `count`, in order, `step` at a time; work may be stopped between."""
    for first in range(0, count, step):
        checkpoint()
        yield first, min(first + step, count)


def chunks(count: int, width: int, room: int) -> Iterator[slice]:
    """The same as slices: as many rows at a time as `room` holds that need `width` each."""
    for first, last in runs(count, max(1, room // width)):
        yield slice(first, last)
