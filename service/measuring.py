"""Measures how many seconds each named part of the work takes.

`with Measured(name):` surrounds a part. A caller that needs the times calls `report_times`, which
puts a function into the context; threads inherit the context. Without this function, as on the
command line, nothing is measured.
"""

import time
from collections.abc import Callable
from contextvars import ContextVar
from typing import TypeAlias

AddSeconds: TypeAlias = Callable[[str, float], None]
"""A function of the name of a part and its seconds; any thread may call it."""

_current: ContextVar[AddSeconds | None] = ContextVar("seconds", default=None)


def report_times(add_seconds: AddSeconds) -> None:
    """Makes `Measured` call `add_seconds` from now on, in this task and the threads it starts."""
    _current.set(add_seconds)


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
