"""Work that may be told to stop: its client has gone away, or its time is over.

Whoever starts work in a thread puts a `Stop` into the context, which threads inherit; whoever
works long calls `checkpoint()` now and then, mostly every 100 ms; large arrays are one step of up
to half a second (`make bench`). Where nobody put one there, as on the command line, that does
nothing.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import inf

from service.errors import SurfaceError


class Stopped(Exception):
    """Nobody waits for the result any more."""


class OutOfTime(SurfaceError):
    """The time that the work may take is over."""


class Stop:
    """Whether a piece of work shall end.

    Parameters
    ----------
    deadline : float
        When its time is over, on the clock `time.monotonic`.
    """

    __slots__ = ("_told", "deadline")

    def __init__(self, deadline: float = inf) -> None:
        self.deadline = deadline
        self._told = False

    def tell(self) -> None:
        """Nobody waits any more; may be called from any thread."""
        self._told = True

    def check(self) -> None:
        """Goes on, or ends the work.

        Raises
        ------
        Stopped, OutOfTime
        """
        if self._told:
            raise Stopped
        if time.monotonic() > self.deadline:
            raise OutOfTime


_current: ContextVar[Stop | None] = ContextVar("stop", default=None)


@contextmanager
def stopped_by(stop: Stop) -> Iterator[None]:
    """What is done within, and in threads that are started within, ends when `stop` says so."""
    token = _current.set(stop)
    try:
        yield
    finally:
        _current.reset(token)


def checkpoint() -> None:
    """Goes on, or ends the work that is being done; costs 0.2 µs.

    Raises
    ------
    Stopped, OutOfTime
    """
    stop = _current.get()
    if stop is not None:
        stop.check()
