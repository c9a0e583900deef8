"""Cancellation of work."""

import time

import pytest
from anyio import to_thread

from service.cancellation import Cancellation, Cancelled, OutOfTime, cancelled_by, checkpoint


def test_without_a_stop_work_goes_on() -> None:
    checkpoint()


def test_work_goes_on_until_it_is_cancelled() -> None:
    cancellation = Cancellation()
    with cancelled_by(cancellation):
        checkpoint()
        cancellation.cancel()
        with pytest.raises(Cancelled):
            checkpoint()
    checkpoint()


def test_work_ends_when_its_time_is_over() -> None:
    with cancelled_by(Cancellation(time.monotonic() + 60)):
        checkpoint()
    with cancelled_by(Cancellation(time.monotonic() - 1)), pytest.raises(OutOfTime):
        checkpoint()


def test_being_told_comes_before_time() -> None:
    cancellation = Cancellation(deadline=0.0)
    cancellation.cancel()
    with pytest.raises(Cancelled):
        cancellation.check()


@pytest.mark.anyio
async def test_threads_inherit_who_may_stop_them_and_others_do_not() -> None:
    told, other = Cancellation(), Cancellation()
    told.cancel()
    found = []
    for cancellation in (told, other):
        try:
            with cancelled_by(cancellation):
                await to_thread.run_sync(checkpoint)
            found.append("done")
        except Cancelled:
            found.append("stopped")
    await to_thread.run_sync(checkpoint)
    assert found == ["stopped", "done"]
