"""While long Python code runs, turns of threads are short, and garbage is not collected."""

import gc
import sys
from collections.abc import Iterator
from threading import Barrier, Thread

import pytest

from service.interpreter import SHORT_SECONDS, pause_collection, run_in_short_turns, short_turns


@pytest.fixture(autouse=True)
def usual_seconds() -> Iterator[float]:
    seconds = sys.getswitchinterval()
    sys.setswitchinterval(0.004)
    yield 0.004
    sys.setswitchinterval(seconds)


def test_turns_are_short_in_the_block_alone(usual_seconds: float) -> None:
    with short_turns():
        assert sys.getswitchinterval() == pytest.approx(SHORT_SECONDS)
        with short_turns():
            pass
        assert sys.getswitchinterval() == pytest.approx(SHORT_SECONDS)
    assert sys.getswitchinterval() == pytest.approx(usual_seconds)


def test_an_error_ends_the_block(usual_seconds: float) -> None:
    with pytest.raises(ZeroDivisionError):
        run_in_short_turns(lambda: 1 // 0)
    assert sys.getswitchinterval() == pytest.approx(usual_seconds)
    assert run_in_short_turns(sys.getswitchinterval) == pytest.approx(SHORT_SECONDS)


def test_the_last_thread_restores_the_usual_time(usual_seconds: float) -> None:
    first_left, may_leave = Barrier(2), Barrier(2)

    def stay() -> None:
        with short_turns():
            first_left.wait(10)
            may_leave.wait(10)

    thread = Thread(target=stay)
    with short_turns():
        thread.start()
        first_left.wait(10)
    assert sys.getswitchinterval() == pytest.approx(SHORT_SECONDS)
    may_leave.wait(10)
    thread.join(10)
    assert sys.getswitchinterval() == pytest.approx(usual_seconds)


def test_garbage_collection_pauses_until_the_outermost_block_ends() -> None:
    with pause_collection(), pause_collection():
        assert not gc.isenabled()
    assert gc.isenabled()
