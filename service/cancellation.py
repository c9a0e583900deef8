"""Cancels work when its client has disconnected, or when its time is over.

A caller that starts work in a thread puts a `Cancellation` into the context, which the thread
inherits. Long work calls `checkpoint()` about every 100 ms; a step on large arrays takes up to half
a second (`make bench`). Without a `Cancellation` in the context, as on the command line,
`checkpoint` does nothing.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import inf

from service.errors import SurfaceError


class Cancelled(Exception):
    """The work was cancelled: no request waits for its result."""


class OutOfTime(SurfaceError):
    """The work was not done at its deadline."""


class Cancellation:
    """Says whether a piece of work must end.

    Parameters
    ----------
    deadline : float
        The time at which the work must end, on the clock `time.monotonic`.
    """

    __slots__ = ("_is_cancelled", "deadline")

    def __init__(self, deadline: float = inf) -> None:
        self.deadline = deadline
        self._is_cancelled = False

    def cancel(self) -> None:
        """Cancels the work; may be called from any thread."""
        self._is_cancelled = True

    def raise_if_over(self) -> None:
        """Raises an error if the work is cancelled or out of time; else does nothing.

        Raises
        ------
        Cancelled, OutOfTime
        """
        if self._is_cancelled:
            raise Cancelled
        if time.monotonic() > self.deadline:
            raise OutOfTime


_current: ContextVar[Cancellation | None] = ContextVar("cancellation", default=None)


@contextmanager
def cancelled_by(cancellation: Cancellation) -> Iterator[None]:
    """Lets `cancellation` end the `with` block, and the threads that the block starts."""
    token = _current.set(cancellation)
    try:
        yield
    finally:
        _current.reset(token)


def checkpoint() -> None:
    """Ends the current work if it is cancelled or out of time; costs 0.2 µs.

    Raises
    ------
    Cancelled, OutOfTime
    """
    cancellation = _current.get()
    if cancellation is not None:
        cancellation.raise_if_over()
