"""Work that calls `checkpoint` ends when its caller cancels it, or when its time is over."""

import time

import pytest
from anyio import to_thread

from service.cancellation import Cancellation, Cancelled, OutOfTime, cancelled_by, checkpoint


def test_checkpoint_without_a_cancellation_does_nothing() -> None:
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


def test_cancelled_work_after_its_deadline_raises_cancelled() -> None:
    cancellation = Cancellation(deadline=0.0)
    cancellation.cancel()
    with pytest.raises(Cancelled):
        cancellation.raise_if_over()


@pytest.mark.anyio
async def test_threads_inherit_the_cancellation_of_their_caller_only() -> None:
    cancelled_work, running_work = Cancellation(), Cancellation()
    cancelled_work.cancel()
    outcomes = []
    for cancellation in (cancelled_work, running_work):
        try:
            with cancelled_by(cancellation):
                await to_thread.run_sync(checkpoint)
            outcomes.append("done")
        except Cancelled:
            outcomes.append("cancelled")
    await to_thread.run_sync(checkpoint)
    assert outcomes == ["cancelled", "done"]
