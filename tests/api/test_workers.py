"""Threads and memory: the service grants them in order, limits them, and always releases them."""

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

from service.api import workers as module
from service.api.caching.cache import ResponseCache
from service.api.caching.cached_response import CachedResponse, Subject
from service.api.workers import (
    ALONE_SECONDS,
    INLINE_SECONDS,
    ROUND_SECONDS,
    SMALL_BODY,
    TRIM_BYTES,
    Job,
    Workers,
)
from service.cancellation import OutOfTime, checkpoint
from service.errors import Busy, TooLarge
from service.pipeline.cost import Cost
from service.settings.runtime import trim_heap
from service.settings.values import Settings

pytestmark = pytest.mark.anyio
CAPACITY = 1 << 24
LARGEST = CAPACITY * 11 // 16


def build_workers(cache_bytes: int = 0, **chosen: Any) -> Workers:
    defaults = {"threads": 1, "memory_bytes": CAPACITY}
    return Workers(Settings(**(defaults | chosen)), ResponseCache(cache_bytes))


class Work:
    """Work with a cost; it calls a function."""

    def __init__(
        self, memory: int = 1000, call: Any = lambda: "done", *, long: bool = True
    ) -> None:
        self.cost = Cost(0, 0, 0, memory, 10.0 if long else INLINE_SECONDS)
        self.run = call


async def run_tasks() -> None:
    """Lets all tasks run until all of them wait."""
    for _ in range(10):
        await asyncio.sleep(0)


@asynccontextmanager
async def lend_workers(**chosen: Any) -> AsyncIterator[Workers]:
    """Workers; checks at the end that all threads and memory are released."""
    workers = build_workers(**chosen)
    yield workers
    await run_tasks()
    assert (workers.used, workers.body_bytes, workers.computing, workers.waiting) == (0,) * 4


async def test_short_work_runs_at_once_and_long_work_in_a_thread() -> None:
    async with lend_workers() as workers:
        job = Job(workers)
        names = []
        for long in (False, True):
            work = Work(
                1000, lambda: threading.current_thread() is not threading.main_thread(), long=long
            )
            names.append(await job.run(work, "mesh"))
            assert workers.used == 1000
            job.finish_work(10)
            assert workers.used == 10
            job.finish_work(0)
        assert names == [False, True]
        assert "mesh;dur=" in str(job.timing)
        assert "wait;dur=" in str(job.timing)
        job.close()


async def test_work_that_is_longer_than_its_cost_says_leaves_the_event_loop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "MOST_INLINE_SECONDS", 0.0)
    places: list[threading.Thread] = []

    def call() -> str:
        places.append(threading.current_thread())
        time.sleep(0.001)
        checkpoint()
        return "done"

    async with lend_workers() as workers:
        job = Job(workers)
        assert await job.run(Work(call=call, long=False), "mesh") == "done"
        assert [place is threading.main_thread() for place in places] == [True, False]
        job.close()


async def test_short_works_take_turns_on_the_event_loop() -> None:
    """After their time, the event loop serves other tasks that are ready."""
    async with lend_workers() as workers:
        rounds: list[int] = []
        now = 0

        async def count_rounds() -> None:
            nonlocal now
            while len(rounds) < 5:
                now += 1
                await asyncio.sleep(0)

        jobs = [Job(workers) for _ in range(5)]

        def compute() -> None:
            time.sleep(1.5 * ROUND_SECONDS)
            rounds.append(now)

        works = [job.run(Work(10, compute, long=False), "x") for job in jobs]
        await asyncio.gather(count_rounds(), *works)
        assert len(set(rounds)) == 5
        for job in jobs:
            job.close()


async def test_requests_are_served_in_order_of_arrival() -> None:
    async with lend_workers(threads=3) as workers:
        order: list[str] = []

        async def hold(name: str, amount: int) -> None:
            start = await workers.acquire(amount)
            order.append(name)
            await asyncio.sleep(0)
            workers.release_thread(start)
            workers.hold(-amount)

        sizes = {"first": LARGEST, "large": LARGEST, "small": 10, "last": 10}
        await asyncio.gather(*(hold(name, size) for name, size in sizes.items()))
        assert order == list(sizes)
        assert workers.seconds_waited > 0


async def test_a_full_queue_refuses_and_says_when_to_try_again() -> None:
    async with lend_workers(max_queue=4) as workers:
        assert workers.retry_after() == 1
        start = await workers.acquire(10)
        waiting = [asyncio.create_task(workers.acquire(10)) for _ in range(4)]
        await run_tasks()
        assert (workers.waiting, workers.retry_after()) == (4, 5)
        with pytest.raises(Busy):
            await workers.acquire(10)
        assert workers.refused == 1
        for task in waiting:
            workers.release_thread(start)
            workers.hold(-10)
            start = await task
        workers.release_thread(start)
        workers.hold(-10)


async def test_a_thread_that_begins_computes_alone_for_a_while() -> None:
    async with lend_workers(threads=3) as workers:
        long = await workers.acquire(10)
        short = asyncio.create_task(workers.acquire(10))
        await run_tasks()
        assert not short.done()
        assert await short - long >= ALONE_SECONDS
        third = asyncio.create_task(workers.acquire(10))
        await run_tasks()
        workers.release_thread(short.result())
        assert (await third) - short.result() < ALONE_SECONDS, "the long one is not in its way"
        for start in (long, third.result()):
            workers.release_thread(start)
        workers.hold(-30)


@given(st.lists(st.tuples(st.integers(0, LARGEST), st.integers(0, 3)), max_size=12))
def test_cancelled_requests_release_threads_and_memory(asks: list[tuple[int, int]]) -> None:
    """A request that is cancelled before, while or after it gets a thread leaves nothing behind."""

    async def scenario() -> None:
        async with lend_workers(threads=2) as workers:

            async def hold(amount: int) -> None:
                start = await workers.acquire(amount)
                try:
                    await asyncio.sleep(0)
                finally:
                    workers.release_thread(start)
                    workers.hold(-amount)

            tasks = [asyncio.create_task(hold(amount)) for amount, _ in asks]
            for at in range(4):
                await asyncio.sleep(0)
                for task, (_, rounds) in zip(tasks, asks, strict=True):
                    if rounds == at and rounds:
                        task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(scenario())


async def test_bodies_have_a_quarter_and_never_wait() -> None:
    async with lend_workers() as workers:
        large, small, third = Job(workers), Job(workers), Job(workers)
        most = workers.max_body * 9 // 10
        with pytest.raises(TooLarge) as refused:
            large.hold_body(most + 1)
        assert refused.value.issues[0].code == "too_much_memory"
        large.hold_body(most)
        with pytest.raises(Busy):
            third.hold_body(SMALL_BODY + 1)
        small.hold_body(workers.max_body - most)
        with pytest.raises(Busy):
            third.hold_body(1)
        # The largest work still fits beside them, and small work beside that.
        start = await workers.acquire(workers.max_memory)
        assert await third.run(Work(1000, long=False), "x") == "done"
        workers.release_thread(start)
        workers.hold(-workers.max_memory)
        large.shrink_body(10)
        large.shrink_body(20)
        assert workers.body_bytes == 10 + workers.max_body - most
        for job in (large, small, third):
            job.close()


def build_entry(name: str, size: int) -> CachedResponse:
    return CachedResponse(Subject(name, name, name, for_ever=True), bytes(size), ())


async def test_cached_responses_are_dropped_unless_they_are_being_sent() -> None:
    async with lend_workers(cache_bytes=CAPACITY, threads=2, memory_bytes=CAPACITY) as workers:
        cache: ResponseCache = workers._cache
        read, *unread = (build_entry(name, CAPACITY // 8) for name in "abc")
        for each in (read, *unread):
            assert cache.put(each, cache.generation)
        cache.begin(read)
        first = asyncio.create_task(workers.acquire(workers.max_memory))
        second = asyncio.create_task(workers.acquire(CAPACITY * 3 // 16))
        await run_tasks()
        assert first.done()
        assert not second.done()
        assert cache.holds(read)
        assert not all(cache.holds(each) for each in unread)
        workers.release_thread(first.result())
        await run_tasks()
        assert not second.done(), "a thread is free, memory is not"
        cache.end(read)
        await second
        assert not cache.holds(read)
        workers.release_thread(second.result())
        workers.hold(-workers.max_memory - CAPACITY * 3 // 16)


@pytest.mark.parametrize("leaves", [True, False])
async def test_a_thread_without_a_client_keeps_its_memory_until_it_ends(leaves: bool) -> None:
    """The client goes away, or the deadline passes; the thread ends at its next checkpoint."""
    async with lend_workers(request_timeout=0.2) as workers:
        gone = asyncio.Event()

        async def receive() -> dict[str, str]:
            await gone.wait()
            return {"type": "http.disconnect"}

        def compute() -> None:
            while True:
                time.sleep(0.001)
                checkpoint()

        job = Job(workers, receive)
        task = asyncio.create_task(job.run(Work(1000, compute), "x"))
        while not workers.computing:
            await asyncio.sleep(0.001)
        if leaves:
            gone.set()
        with pytest.raises(ClientDisconnect if leaves else OutOfTime):
            await task
        job.close()
        while workers.computing:
            assert workers.used == 1000
            await asyncio.sleep(0.001)


async def test_large_requests_that_end_together_hand_memory_back_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: list[int] = []
    monkeypatch.setattr(module, "trim_heap", lambda: calls.append(1))
    monkeypatch.setattr(module, "TRIM_PAUSE", 0.01)
    counts = []
    async with lend_workers() as workers:
        for sizes in ((TRIM_BYTES - 1,), (TRIM_BYTES, TRIM_BYTES), (TRIM_BYTES,)):
            jobs = [Job(workers) for _ in sizes]
            for job, size in zip(jobs, sizes, strict=True):
                await job.run(Work(size, long=False), "x")
            for job in jobs:  # both end before the event loop continues
                job.close()
            if trimming := workers._trimming:
                await trimming
            counts.append(len(calls))
    assert counts == [0, 1, 2]
    trim_heap()


class _Large:
    """A value that work refers to."""


def test_failed_work_keeps_no_local_variables() -> None:
    held: list[weakref.ref[_Large]] = []

    def first() -> None:
        large = _Large()
        held.append(weakref.ref(large))
        raise KeyError

    def work() -> None:
        large = _Large()
        held.append(weakref.ref(large))
        try:
            first()
        except KeyError:
            raise ArithmeticError from None  # the error refers to the first one and its frames

    async def scenario() -> None:
        async with lend_workers() as workers:
            job = Job(workers)
            with pytest.raises(ArithmeticError) as failed:
                await job.run(Work(1000, work), "x")
            assert extract_tb(failed.value.__traceback__)[-1].name == "work"
            del failed
            job.close()

    gc.collect()
    gc.disable()
    try:
        asyncio.run(scenario())
        end = time.monotonic() + 10
        while any(large() for large in held) and time.monotonic() < end:
            time.sleep(0.001)  # the thread releases its reference a moment later
        assert [large() for large in held] == [None, None]
    finally:
        gc.enable()
