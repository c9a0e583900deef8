"""How long each way of computing takes: timed where it happens, counted elsewhere.

A caller that wants to know puts a function into the context, which threads inherit. Without one, as
on the command line, nothing is timed.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeAlias

Add: TypeAlias = Callable[[str, float], None]
"""Takes a name and seconds; called from any thread."""

_current: ContextVar[Add | None] = ContextVar("seconds", default=None)


def count_in(add: Add) -> None:
    """Hands seconds to `add` from here on: in this task, and in threads and tasks it starts."""
    _current.set(add)


@contextmanager
def measured(name: str) -> Iterator[None]:
    """Times what is done within, unless it is part of something that is timed."""
    add = _current.get()
    if add is None:
        yield
        return
    token = _current.set(None)
    start = time.perf_counter()
    try:
        yield
    finally:
        _current.reset(token)
        add(name, time.perf_counter() - start)
