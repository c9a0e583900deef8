"""Times of named blocks: only the time of the outermost block is reported, also in a thread that
has a copy of the context."""

import contextvars
import threading
import time

import pytest

from service.measuring import AddSeconds, Measured, report_times


def measure_blocks(add: AddSeconds | None) -> None:
    """Runs measured blocks, nested, failing and in threads, with `add` as the receiver of times."""
    if add is not None:
        report_times(add)
    with Measured("outer"), Measured("inner"):
        run_in_thread()
    with pytest.raises(ValueError, match="wrong"), Measured("failed"):
        raise ValueError("wrong")
    run_in_thread()


def run_in_thread() -> None:
    """Runs a measured block in another thread, with a copy of the context of this thread."""
    thread = threading.Thread(target=contextvars.copy_context().run, args=(measure_pause,))
    thread.start()
    thread.join()


def measure_pause() -> None:
    with Measured("thread"):
        time.sleep(0)


def test_blocks_inside_measured_blocks_are_not_reported() -> None:
    times: list[tuple[str, float]] = []

    def add(name: str, seconds: float) -> None:
        times.append((name, seconds))

    contextvars.copy_context().run(measure_blocks, add)
    # The first thread runs inside the block "outer", so only the second thread reports its time.
    assert [name for name, _ in times] == ["outer", "failed", "thread"]
    assert all(seconds > 0 for _, seconds in times)


def test_blocks_work_if_no_caller_receives_times() -> None:
    contextvars.copy_context().run(measure_blocks, None)
