"""Seconds by name: nested blocks count once, and threads count too."""

import contextvars
import threading
import time

import pytest

from service.measuring import Add, Measured, report_times


def within(add: Add | None) -> None:
    if add is not None:
        report_times(add)
    with Measured("outer"), Measured("inner"):
        thread = threading.Thread(target=contextvars.copy_context().run, args=(other,))
        thread.start()
        thread.join()
    with pytest.raises(ValueError, match="wrong"), Measured("failed"):
        raise ValueError("wrong")
    context = contextvars.copy_context()
    thread = threading.Thread(target=context.run, args=(other,))
    thread.start()
    thread.join()


def other() -> None:
    with Measured("thread"):
        time.sleep(0)


def test_each_measurement_counts_once() -> None:
    calls: list[tuple[str, float]] = []
    contextvars.copy_context().run(within, lambda name, seconds: calls.append((name, seconds)))
    assert [name for name, _ in calls] == ["outer", "failed", "thread"]
    assert all(seconds > 0 for _, seconds in calls)


def test_without_a_measuring_caller_nothing_is_recorded() -> None:
    contextvars.copy_context().run(within, None)
