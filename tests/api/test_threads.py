"""Threads and memory are lent in order and within limits; jobs always release them.

`acquire(amount)` takes a thread and `amount` bytes, and returns the time at which the thread
begins. `release_thread(start)` gives back the thread that began then, `hold(-amount)` the bytes.
"""

import asyncio
import gc
import threading
import time
import weakref
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from traceback import extract_tb
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.requests import ClientDisconnect

from service.api import threads as threads_module
from service.api.caching.cache import ResponseCache
from service.api.caching.cached_response import CachedResponse, Subject
from service.api.job import INLINE_SECONDS, MAX_INLINE_SECONDS, SMALL_BODY, TRIM_BYTES, Job
from service.api.threads import ALONE_SECONDS, ROUND_SECONDS, TRIM_PAUSE, Threads
from service.cancellation import OutOfTime, checkpoint
from service.errors import Busy, TooLarge
from service.pipeline.cost import Cost, Work
from service.settings.runtime import trim_heap
from service.settings.values import Settings

pytestmark = pytest.mark.anyio
CAPACITY = 1 << 24  # bytes
LARGEST = CAPACITY * 11 // 16  # bytes that the largest work may take; bodies may take 4/16


def build_work(
    memory: int = 1000, call: Any = lambda: "done", *, is_long: bool = True
) -> Work[Any]:
    """Work that calls a function, with an estimate of its memory and its time.

    The estimate says whether the work is too long for the event loop.
    """
    seconds = 10.0 if is_long else INLINE_SECONDS
    return Work(Cost(memory, seconds), call)


async def run_tasks() -> None:
    """Lets all tasks run until all of them wait."""
    for _ in range(10):
        await asyncio.sleep(0)


@asynccontextmanager
async def lend_threads(
    cache: ResponseCache | None = None, **settings: Any
) -> AsyncIterator[Threads]:
    """Threads with these settings, by default one thread and `CAPACITY` bytes.

    At the end of the block, all must be released.
    """
    defaults = {"threads": 1, "memory_bytes": CAPACITY}
    threads = Threads(
        Settings(**(defaults | settings)), ResponseCache(0) if cache is None else cache
    )
    yield threads
    await run_tasks()
    assert (threads.used_bytes, threads.body_bytes, threads.busy_count, threads.queue_length) == (
        0,
    ) * 4


async def test_short_work_runs_on_the_event_loop_and_long_work_in_a_thread() -> None:
    async with lend_threads() as threads:
        job = Job(threads)
        in_thread = []
        for is_long in (False, True):
            work = build_work(
                1000,
                lambda: threading.current_thread() is not threading.main_thread(),
                is_long=is_long,
            )
            in_thread.append(await job.run(work, "mesh"))
            assert threads.used_bytes == 1000
            job.finish_work(10)  # the response, of 10 bytes, is ready
            assert threads.used_bytes == 10
            job.finish_work(0)
        assert in_thread == [False, True]
        assert "mesh;dur=" in str(job.timing)
        assert "wait;dur=" in str(job.timing)
        job.close()


async def test_work_that_takes_longer_than_estimated_moves_to_a_thread() -> None:
    callers: list[threading.Thread] = []

    def call() -> str:
        callers.append(threading.current_thread())
        time.sleep(1.1 * MAX_INLINE_SECONDS)
        checkpoint()
        return "done"

    async with lend_threads() as threads:
        job = Job(threads)
        assert await job.run(build_work(call=call, is_long=False), "mesh") == "done"
        # The checkpoint on the event loop stops the work, which begins again in a thread.
        assert [thread is threading.main_thread() for thread in callers] == [True, False]
        job.close()


async def test_other_tasks_run_between_short_pieces_of_work() -> None:
    """Short work runs in rounds of `ROUND_SECONDS`; after a round, other tasks have a turn."""
    async with lend_threads() as threads:
        turns_before: list[int] = []
        turns = 0

        async def count_turns() -> None:
            nonlocal turns
            while len(turns_before) < 5:
                turns += 1
                await asyncio.sleep(0)

        jobs = [Job(threads) for _ in range(5)]

        def compute() -> None:
            time.sleep(1.5 * ROUND_SECONDS)  # so each of these runs is a round
            turns_before.append(turns)

        runs = [job.run(build_work(10, compute, is_long=False), "x") for job in jobs]
        await asyncio.gather(count_turns(), *runs)
        # The other task had a turn before each piece of work.
        assert len(set(turns_before)) == 5
        for job in jobs:
            job.close()


async def test_requests_are_served_in_order_of_arrival() -> None:
    async with lend_threads(threads=3) as threads:
        order: list[str] = []

        async def use_thread(name: str, amount: int) -> None:
            start = await threads.acquire(amount)
            order.append(name)
            await asyncio.sleep(0)
            threads.release_thread(start)
            threads.hold(-amount)

        sizes = {"first": LARGEST, "large": LARGEST, "small": 10, "last": 10}
        await asyncio.gather(*(use_thread(name, size) for name, size in sizes.items()))
        assert order == list(sizes)
        assert threads.seconds_waited > 0


async def test_a_full_queue_refuses_requests_and_says_when_to_try_again() -> None:
    async with lend_threads(max_queue=4) as threads:
        assert threads.retry_after() == 1
        start = await threads.acquire(10)
        waiting_tasks = [asyncio.create_task(threads.acquire(10)) for _ in range(4)]
        await run_tasks()
        # 1 s, and 1 s for each request in the queue.
        assert (threads.queue_length, threads.retry_after()) == (4, 5)
        with pytest.raises(Busy):
            await threads.acquire(10)
        for task in waiting_tasks:
            threads.release_thread(start)
            threads.hold(-10)
            start = await task
        threads.release_thread(start)
        threads.hold(-10)


async def test_a_thread_that_starts_computes_alone_for_a_while() -> None:
    async with lend_threads(threads=3) as threads:
        first_start = await threads.acquire(10)
        second_task = asyncio.create_task(threads.acquire(10))
        await run_tasks()
        assert not second_task.done()
        assert await second_task - first_start >= ALONE_SECONDS
        third_task = asyncio.create_task(threads.acquire(10))
        await run_tasks()
        threads.release_thread(second_task.result())
        # The first thread still computes, but it started long ago, so the third need not wait.
        assert (await third_task) - second_task.result() < ALONE_SECONDS
        for start in (first_start, third_task.result()):
            threads.release_thread(start)
        threads.hold(-30)


@given(st.lists(st.tuples(st.integers(0, LARGEST), st.integers(0, 3)), max_size=12))
def test_cancelled_requests_release_threads_and_memory(requests: list[tuple[int, int]]) -> None:
    """Each request has an amount of memory and the round in which it is cancelled, or 0 for never.

    In that round the request waits for a thread, gets one, computes, or has ended.
    """

    async def send_and_cancel() -> None:
        async with lend_threads(threads=2) as threads:

            async def use_thread(amount: int) -> None:
                start = await threads.acquire(amount)
                try:
                    await asyncio.sleep(0)
                finally:
                    threads.release_thread(start)
                    threads.hold(-amount)

            tasks = [asyncio.create_task(use_thread(amount)) for amount, _ in requests]
            for current_round in range(4):
                await asyncio.sleep(0)
                for task, (_, cancelled_in) in zip(tasks, requests, strict=True):
                    if cancelled_in == current_round and cancelled_in:
                        task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(send_and_cancel())


async def test_bodies_have_a_memory_budget_of_their_own_and_never_wait() -> None:
    async with lend_threads() as threads:
        large_job, small_job, third_job = Job(threads), Job(threads), Job(threads)
        large_size = threads.max_body * 9 // 10  # the rest is for small bodies
        with pytest.raises(TooLarge) as error:
            large_job.hold_body(large_size + 1)
        assert error.value.issues[0].code == "too_much_memory"
        large_job.hold_body(large_size)
        with pytest.raises(Busy):
            third_job.hold_body(SMALL_BODY + 1)
        small_job.hold_body(threads.max_body - large_size)
        with pytest.raises(Busy):
            third_job.hold_body(1)
        # The largest work has memory besides the bodies, and short work besides the largest work.
        start = await threads.acquire(threads.max_memory)
        assert await third_job.run(build_work(1000, is_long=False), "x") == "done"
        threads.release_thread(start)
        threads.hold(-threads.max_memory)
        large_job.shrink_body(10)
        large_job.shrink_body(20)  # no effect, because the body takes less
        assert threads.body_bytes == 10 + threads.max_body - large_size
        for job in (large_job, small_job, third_job):
            job.close()


def build_entry(name: str, size: int) -> CachedResponse:
    return CachedResponse(Subject(name, name, name, is_permanent=True), bytes(size), ())


async def test_work_that_needs_memory_drops_cached_responses_that_are_not_being_sent() -> None:
    """Work and responses being sent may take 15/16 of the memory together.

    The first work takes 11/16, the second 3/16, and each response a little more than 2/16.
    """
    cache = ResponseCache(CAPACITY)
    async with lend_threads(cache, threads=2) as threads:
        sent_entry, *idle_entries = (build_entry(name, CAPACITY // 8) for name in "abc")
        for each in (sent_entry, *idle_entries):
            assert cache.put(each, cache.generation)
        cache.begin(sent_entry)
        first_task = asyncio.create_task(threads.acquire(threads.max_memory))
        second_task = asyncio.create_task(threads.acquire(CAPACITY * 3 // 16))
        await run_tasks()
        assert first_task.done()
        assert not second_task.done()
        assert cache.holds(sent_entry)
        assert not all(cache.holds(each) for each in idle_entries)
        threads.release_thread(first_task.result())
        await run_tasks()
        assert not second_task.done(), "a thread is free, but memory is not"
        cache.end(sent_entry)
        await second_task
        assert not cache.holds(sent_entry)
        threads.release_thread(second_task.result())
        threads.hold(-threads.max_memory - CAPACITY * 3 // 16)


@pytest.mark.parametrize("client_leaves", [True, False])
async def test_a_cancelled_thread_keeps_its_memory_until_it_ends(client_leaves: bool) -> None:
    """The client disconnects, or the deadline passes; the thread ends at its next checkpoint."""
    async with lend_threads(request_timeout=0.2) as threads:
        has_left = asyncio.Event()

        async def receive() -> dict[str, str]:
            await has_left.wait()
            return {"type": "http.disconnect"}

        def compute() -> None:
            while True:
                time.sleep(0.001)
                checkpoint()

        job = Job(threads, receive)
        task = asyncio.create_task(job.run(build_work(1000, compute), "x"))
        while not threads.busy_count:
            await asyncio.sleep(0.001)
        if client_leaves:
            has_left.set()
        with pytest.raises(ClientDisconnect if client_leaves else OutOfTime):
            await task
        job.close()
        while threads.busy_count:
            assert threads.used_bytes == 1000
            await asyncio.sleep(0.001)


async def test_large_requests_that_end_together_trim_the_heap_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: list[int] = []
    monkeypatch.setattr(threads_module, "trim_heap", lambda: calls.append(1))
    counts = []
    async with lend_threads() as threads:
        for sizes in ((TRIM_BYTES - 1,), (TRIM_BYTES, TRIM_BYTES), (TRIM_BYTES,)):
            jobs = [Job(threads) for _ in sizes]
            for job, size in zip(jobs, sizes, strict=True):
                await job.run(build_work(size, is_long=False), "x")
            for job in jobs:  # all end before the event loop continues
                job.close()
            await asyncio.sleep(TRIM_PAUSE + 0.1)
            counts.append(len(calls))
    assert counts == [0, 1, 2]
    trim_heap()  # the real function, which the test replaced: it must not raise an error


class _Value:
    """A value to which local variables of work refer."""


def test_the_error_of_failed_work_does_not_keep_its_local_variables() -> None:
    """Otherwise the arrays of failed work would stay in memory as long as its error."""
    references: list[weakref.ref[_Value]] = []

    def fail() -> None:
        value = _Value()
        references.append(weakref.ref(value))
        raise KeyError

    def work() -> None:
        value = _Value()
        references.append(weakref.ref(value))
        try:
            fail()
        except KeyError:
            # The new error refers to the first error as its context, and so to the frame of `fail`.
            raise ArithmeticError from None

    async def run_work() -> None:
        async with lend_threads() as threads:
            job = Job(threads)
            with pytest.raises(ArithmeticError) as error:
                await job.run(build_work(1000, work), "x")
            assert extract_tb(error.value.__traceback__)[-1].name == "work"
            del error
            job.close()

    gc.collect()
    gc.disable()
    try:
        asyncio.run(run_work())
        deadline = time.monotonic() + 10
        while any(value() for value in references) and time.monotonic() < deadline:
            time.sleep(0.001)  # the thread releases its reference a moment later
        assert [value() for value in references] == [None, None]
    finally:
        gc.enable()
