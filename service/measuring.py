"""How long the ways of computing take altogether, counted where they are and read elsewhere.

Whoever wants to know puts `Seconds` into the context, which threads inherit. Where nobody did, as
on the command line, nothing is counted.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Lock


class Seconds:
    """Seconds by name; may be added to from any thread."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._seconds: dict[str, float] = {}

    def add(self, name: str, seconds: float) -> None:
        """So many more."""
        with self._lock:
            self._seconds[name] = self._seconds.get(name, 0.0) + seconds

    def so_far(self) -> dict[str, float]:
        """All of them at this moment."""
        with self._lock:
            return self._seconds.copy()


_current: ContextVar[Seconds | None] = ContextVar("seconds", default=None)


def count_in(seconds: Seconds) -> None:
    """What the task does from here on, and threads and tasks that it starts, is counted there."""
    _current.set(seconds)


@contextmanager
def measured(name: str) -> Iterator[None]:
    """Counts the time of what is done within, as long as that is no part of something measured."""
    seconds = _current.get()
    if seconds is None:
        yield
        return
    token = _current.set(None)
    start = time.perf_counter()
    try:
        yield
    finally:
        _current.reset(token)
        seconds.add(name, time.perf_counter() - start)
