"""Seconds by name: what is within something measured is part of it, and threads count along."""

import contextvars
import threading
import time

import pytest

from service.measuring import Seconds, count_in, measured


def within(seconds: Seconds | None) -> None:
    if seconds is not None:
        count_in(seconds)
    with measured("outer"), measured("inner"):
        thread = threading.Thread(target=contextvars.copy_context().run, args=(other,))
        thread.start()
        thread.join()
    with pytest.raises(ValueError, match="wrong"), measured("failed"):
        raise ValueError("wrong")
    context = contextvars.copy_context()
    thread = threading.Thread(target=context.run, args=(other,))
    thread.start()
    thread.join()


def other() -> None:
    with measured("thread"):
        time.sleep(0)


def test_what_is_measured_counts_once() -> None:
    seconds = Seconds()
    contextvars.copy_context().run(within, seconds)
    found = seconds.so_far()
    assert found.keys() == {"outer", "failed", "thread"}
    assert all(value > 0 for value in found.values())
    before = found["outer"]
    seconds.add("outer", 2.0)
    assert seconds.so_far()["outer"] == before + 2


def test_where_nobody_wants_to_know_nothing_is_counted() -> None:
    contextvars.copy_context().run(within, None)
