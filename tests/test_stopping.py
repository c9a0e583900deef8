"""Work that is told to stop."""

import time
from functools import partial

import anyio
import pytest
from anyio import to_thread

from service.stopping import OutOfTime, Stop, Stopped, checkpoint, stopped_by


def test_without_anybody_who_could_stop_it_work_goes_on() -> None:
    checkpoint()


def test_work_goes_on_until_it_is_told() -> None:
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


def test_threads_inherit_who_may_stop_them_and_others_do_not() -> None:
    async def started(stop: Stop) -> None:
        with stopped_by(stop):
            await to_thread.run_sync(checkpoint)

    async def both() -> list[str]:
        told, other = Stop(), Stop()
        told.tell()
        found = []
        for stop in (told, other):
            try:
                await started(stop)
                found.append("done")
            except Stopped:
                found.append("stopped")
        await to_thread.run_sync(partial(checkpoint))
        return found

    assert anyio.run(both) == ["stopped", "done"]
