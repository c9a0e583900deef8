"""The interpreter while long Python code runs: turns of threads, and the garbage collector."""

import gc
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import TypeVar

SHORT_SECONDS = 1e-4
"""Time after which a thread in Python code gives the lock to another that waits for it. By default
it is 5 ms. The teapot takes 0.6 ms of the event loop, but some 30 NumPy calls in it give the lock
away: beside a thread in Python code it then takes 0.1 s, and with this time some 10 ms. That other
thread becomes 5 % slower."""

Result = TypeVar("Result")

_lock = Lock()
_users = 0
_usual_seconds = sys.getswitchinterval()


@contextmanager
def short_turns() -> Iterator[None]:
    """Lets other threads have Python's lock soon, while the `with` block runs Python code for long.

    Several threads may be in such blocks; the last one that leaves restores the usual time.
    """
    global _users, _usual_seconds  # noqa: PLW0603  (the interpreter has one such time)
    with _lock:
        if not _users:
            _usual_seconds = sys.getswitchinterval()
            sys.setswitchinterval(SHORT_SECONDS)
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if not _users:
                sys.setswitchinterval(_usual_seconds)


def run_in_short_turns(call: Callable[[], Result]) -> Result:
    """The result of `call()`, run in `short_turns`."""
    with short_turns():
        return call()


@contextmanager
def pause_collection() -> Iterator[None]:
    """Switches the garbage collector off in the `with` block.

    For parsing a document, which makes no reference cycles.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
