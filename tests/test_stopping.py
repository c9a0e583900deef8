"""Cancellation of work."""

import time

import pytest
from anyio import to_thread

from service.stopping import OutOfTime, Stop, Stopped, checkpoint, stopped_by


def test_without_a_stop_work_goes_on() -> None:
    checkpoint()


def test_work_goes_on_until_it_is_cancelled() -> None:
    stop = Stop()
    with stopped_by(stop):
        checkpoint()
        stop.tell()
        with pytest.raises(Stopped):
            checkpoint()
    checkpoint()


def test_work_ends_when_its_time_is_over() -> None:
    with stopped_by(Stop(time.monotonic() + 60)):
        checkpoint()
    with stopped_by(Stop(time.monotonic() - 1)), pytest.raises(OutOfTime):
        checkpoint()


def test_being_told_comes_before_time() -> None:
    stop = Stop(deadline=0.0)
    stop.tell()
    with pytest.raises(Stopped):
        stop.check()


@pytest.mark.anyio
async def test_threads_inherit_who_may_stop_them_and_others_do_not() -> None:
    told, other = Stop(), Stop()
    told.tell()
    found = []
    for stop in (told, other):
        try:
            with stopped_by(stop):
                await to_thread.run_sync(checkpoint)
            found.append("done")
        except Stopped:
            found.append("stopped")
    await to_thread.run_sync(checkpoint)
    assert found == ["stopped", "done"]
