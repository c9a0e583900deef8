"""Measures how many seconds each named part of the work takes.

`with Measured(name):` surrounds a part. A caller that wants the times sets a function in the
context, which threads inherit; without it, as on the command line, nothing is measured.
"""

import time
from collections.abc import Callable
from contextvars import ContextVar
from typing import TypeAlias

Add: TypeAlias = Callable[[str, float], None]
"""Takes a name and seconds; called from any thread."""

_current: ContextVar[Add | None] = ContextVar("seconds", default=None)


def report_times(add: Add) -> None:
    """Calls `add` with each measured time from now on, in this task and in threads it starts."""
    _current.set(add)


class Measured:
    """Measures the `with` block, unless it is part of another measured block."""

    __slots__ = ("_add", "_name", "_start", "_token")

    def __init__(self, name: str) -> None:
        self._name = name

    def __enter__(self) -> None:
        self._add = _current.get()
        if self._add is not None:
            self._token = _current.set(None)
            self._start = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        if self._add is not None:
            seconds = time.perf_counter() - self._start
            _current.reset(self._token)
            self._add(self._name, seconds)
