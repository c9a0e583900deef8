"""Threads and memory are lent in turn and within limits; computations always release them.

`acquire(turn)` takes a thread and memory, `release_thread(turn)` gives back the thread, and
`give_back(turn)` the memory.
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
from service.api.computation import (
    INLINE_SECONDS,
    MAX_INLINE_SECONDS,
    SMALL_BODY,
    TRIM_BYTES,
    Computation,
)
from service.api.threads import (
    ALONE_SECONDS,
    EXTRA_ALONE_SECONDS,
    ROUND_SECONDS,
    TRIM_PAUSE,
    Threads,
    Turn,
)
from service.cancellation import OutOfTime, checkpoint
from service.errors import Busy, TooLarge
from service.pipeline.cost import Cost, Work
from service.settings.runtime import trim_heap
from service.settings.values import Settings
from tests.clock import stop_clock

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
        computation = Computation(threads)
        in_thread = []
        for is_long in (False, True):
            work = build_work(
                1000,
                lambda: threading.current_thread() is not threading.main_thread(),
                is_long=is_long,
            )
            in_thread.append(await computation.run(work, "mesh"))
            assert threads.used_bytes == 1000
            computation.finish_work(10)  # the response, of 10 bytes, is ready
            assert threads.used_bytes == 10
            computation.finish_work(0)
        assert in_thread == [False, True]
        assert "mesh;dur=" in str(computation.timing)
        assert "wait;dur=" in str(computation.timing)
        computation.close()


async def test_work_that_takes_longer_than_estimated_moves_to_a_thread() -> None:
    callers: list[threading.Thread] = []

    def call() -> str:
        callers.append(threading.current_thread())
        time.sleep(1.1 * MAX_INLINE_SECONDS)
        checkpoint()
        return "done"

    async with lend_threads() as threads:
        computation = Computation(threads)
        assert await computation.run(build_work(call=call, is_long=False), "mesh") == "done"
        # The checkpoint on the event loop stops the work, which begins again in a thread.
        assert [thread is threading.main_thread() for thread in callers] == [True, False]
        computation.close()


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

        computations = [Computation(threads) for _ in range(5)]

        def compute() -> None:
            time.sleep(1.5 * ROUND_SECONDS)  # so each of these runs is a round
            turns_before.append(turns)

        runs = [
            computation.run(build_work(10, compute, is_long=False), "x")
            for computation in computations
        ]
        await asyncio.gather(count_turns(), *runs)
        # The other task had a turn before each piece of work.
        assert len(set(turns_before)) == 5
        for computation in computations:
            computation.close()


async def acquire(threads: Threads, memory: int = 10, caller: str = "a", **needs: Any) -> Turn:
    """A turn that has got its thread and its memory."""
    turn = Turn(caller, memory, **needs)
    await threads.acquire(turn, "mesh")
    return turn


def release(threads: Threads, *turns: Turn) -> None:
    """Gives back the threads and the memory of some turns."""
    for turn in turns:
        threads.release_thread(turn)
        threads.give_back(turn)


async def test_requests_of_one_caller_are_served_in_order_of_arrival() -> None:
    async with lend_threads(threads=3) as threads:
        order: list[str] = []

        async def use_thread(name: str, amount: int) -> None:
            turn = await acquire(threads, amount)
            order.append(name)
            await asyncio.sleep(0)
            release(threads, turn)

        sizes = {"first": LARGEST, "large": LARGEST, "small": 10, "last": 10}
        await asyncio.gather(*(use_thread(name, size) for name, size in sizes.items()))
        assert order == list(sizes)
        assert threads.seconds_waited > 0


async def test_a_full_queue_refuses_requests_and_says_when_to_try_again() -> None:
    async with lend_threads(max_queue=4) as threads:
        assert threads.retry_after() == 1
        turn = await acquire(threads)
        waiting_tasks = [asyncio.create_task(acquire(threads)) for _ in range(4)]
        await run_tasks()
        # 1 s, and 1 s for each request in the queue.
        assert (threads.queue_length, threads.retry_after()) == (4, 5)
        with pytest.raises(Busy):
            await acquire(threads)
        for task in waiting_tasks:
            release(threads, turn)
            turn = await task
        release(threads, turn)


async def test_a_full_queue_pushes_out_the_newest_request_of_the_caller_with_most() -> None:
    async with lend_threads(max_queue=3) as threads:
        turns = [await acquire(threads)]
        many = [asyncio.create_task(acquire(threads)) for _ in range(3)]
        await run_tasks()
        threads._last_start = -1e9  # the extra thread need not wait
        turns.append(await acquire(threads, caller="b"))  # by the extra thread, at once
        other = asyncio.create_task(acquire(threads, caller="c"))
        await run_tasks()
        assert [task.done() for task in (*many, other)] == [False, False, True, False]
        with pytest.raises(Busy):
            many[2].result()
        with pytest.raises(Busy):  # no other caller has more
            await acquire(threads, caller="c")
        for task in (many[0], many[1], other):
            task.cancel()
        await run_tasks()
        release(threads, *turns)


async def test_one_thread_more_takes_only_work_of_callers_that_hold_none() -> None:
    async with lend_threads(threads=1) as threads:
        first = await acquire(threads)
        second = asyncio.create_task(acquire(threads))
        other = asyncio.create_task(acquire(threads, caller="b"))
        third = asyncio.create_task(acquire(threads, caller="c"))
        await asyncio.sleep(EXTRA_ALONE_SECONDS + 0.05)
        assert [task.done() for task in (second, other, third)] == [False, True, False]
        assert threads.busy_count == threads.count + 1
        release(threads, first)  # the thread of the setting: now both threads are of the setting
        await asyncio.sleep(ALONE_SECONDS + 0.05)
        # "a" has used more than "c", which has not had a thread yet.
        assert [task.done() for task in (second, third)] == [False, True]
        release(threads, other.result(), third.result())
        release(threads, await second)


async def test_the_thread_of_a_long_computation_is_charged_to_its_caller() -> None:
    async with lend_threads(threads=1) as threads:
        with stop_clock() as clock:
            heavy = await acquire(threads, caller="heavy")
            tasks = [asyncio.create_task(acquire(threads, caller="heavy")) for _ in range(3)]
            await run_tasks()
            clock.now += 5
            light = await acquire(threads, caller="light")  # by the extra thread
            waiting = asyncio.create_task(acquire(threads, caller="light"))
            await run_tasks()
            clock.now += 1
            release(threads, light)
            release(threads, heavy)
            await run_tasks()
            assert waiting.done(), "its caller has used less, although it came later"
            for task in tasks:
                task.cancel()
            release(threads, waiting.result())
            await run_tasks()


async def test_work_that_surely_ends_too_late_is_refused_at_once() -> None:
    """Only estimates that are sure count: the least seconds of the caller's own waiting work."""
    async with lend_threads(threads=1) as threads:
        turn = await acquire(threads)
        deadline = time.monotonic() + 60
        times: Any = {"deadline": deadline, "least_seconds": 50.0}
        waiting = [asyncio.create_task(acquire(threads, **times)) for _ in range(2)]
        unknown = [asyncio.create_task(acquire(threads, deadline=deadline)) for _ in range(5)]
        await run_tasks()
        assert threads.queue_length == 7
        with pytest.raises(Busy):
            await acquire(threads, **times)  # 150 s with two threads
        unknown.append(asyncio.create_task(acquire(threads, deadline=deadline)))
        other = asyncio.create_task(acquire(threads, caller="b", **times))
        await run_tasks()
        assert threads.queue_length == 9, "an unknown time, and another caller, are not refused"
        for task in (*waiting, *unknown, other):
            task.cancel()
        await run_tasks()
        release(threads, turn)


async def test_large_work_claims_its_memory_and_small_work_passes_beside_it() -> None:
    """Memory is counted in sixteenths: 15 for all, 4 of them for others beside the largest work."""
    part = CAPACITY // 16
    async with lend_threads(threads=8) as threads:

        def begin(caller: str, parts: int) -> "asyncio.Task[Turn]":
            threads._last_start = -1e9  # no thread computes alone
            return asyncio.create_task(acquire(threads, parts * part, caller))

        old = await begin("old", 6)
        large = begin("large", 11)
        await run_tasks()
        passing = []
        for number in range(6):
            passing.append(begin(f"small {number}", 1))
            await run_tasks()
        # Six would fit beside the old work, but with the claim only four do.
        assert [task.done() for task in passing] == [True] * 4 + [False] * 2
        assert not large.done()
        release(threads, old)
        await run_tasks()
        threads._last_start = -1e9
        threads.start_queued()
        await run_tasks()
        assert large.done(), "it begins as soon as the old work has ended"
        release(threads, *(task.result() for task in passing[:4]))
        for _ in range(2):
            await run_tasks()
            threads._last_start = -1e9
            threads.start_queued()
        await run_tasks()
        release(threads, large.result(), *(task.result() for task in passing[4:]))
        await run_tasks()
        assert threads.passed_bytes == 0


@given(
    st.lists(
        st.tuples(st.sampled_from("abcd"), st.integers(1, 11), st.integers(0, 3)),
        min_size=1,
        max_size=40,
    ),
    st.integers(1, 3),
)
def test_all_work_begins_whatever_memory_others_need(
    requests: list[tuple[str, int, int]], count: int
) -> None:
    """Small work arrives all the time; nevertheless the largest work waits for a bounded time.

    A request is a caller, sixteenths of the memory, and the number of rounds that it computes.
    """

    async def serve() -> None:
        with stop_clock() as clock:
            async with lend_threads(threads=count, max_queue=1000) as threads:
                part = CAPACITY // 16

                async def use_thread(caller: str, parts: int, rounds: int) -> None:
                    turn = await acquire(threads, parts * part, caller)
                    for _ in range(rounds + 1):
                        await asyncio.sleep(0)
                    release(threads, turn)

                tasks = [asyncio.create_task(use_thread(*request)) for request in requests]
                large = asyncio.create_task(use_thread("large", 11, 0))
                flood: list[asyncio.Task[None]] = []
                for number in range(400):
                    clock.now += 1
                    threads.start_queued()
                    # Without its claim, the largest work would wait as long as the flood lasts.
                    if number < 300:
                        flood.append(asyncio.create_task(use_thread(f"f{number}", 3, 5)))
                    await asyncio.sleep(0)
                    assert large.done() or number < 290
                while not all(task.done() for task in (*tasks, *flood)):
                    clock.now += 1
                    threads.start_queued()
                    await asyncio.sleep(0)
                await asyncio.gather(*tasks, *flood, large)

    asyncio.run(serve())


async def test_a_caller_that_reads_slowly_waits_and_others_do_not() -> None:
    """Its unread responses hold at most 1/8 of the memory, or one response if that is larger."""
    async with lend_threads(threads=4) as threads:
        share = CAPACITY // 8
        kinds = {"response": share // 2, "memory": share // 2}

        def begin(caller: str, **needs: int) -> "asyncio.Task[Turn]":
            threads._last_start = -1e9
            return asyncio.create_task(acquire(threads, caller=caller, **needs))

        turns = [await begin("slow", **kinds), await begin("slow", **kinds)]
        third, other = begin("slow", **kinds), begin("other", **kinds)
        unknown = begin("slow")
        await run_tasks()
        assert [task.done() for task in (third, other, unknown)] == [False, True, False]
        release(threads, turns[0])
        threads._last_start = -1e9
        threads.start_queued()
        await run_tasks()
        assert (third.done(), unknown.done()) == (True, False)
        release(threads, turns[1], third.result())
        threads._last_start = -1e9
        threads.start_queued()
        await run_tasks()
        release(threads, unknown.result(), other.result())
        large = await begin("slow", response=2 * share, memory=2 * share)
        release(threads, large)
        assert threads.unread.totals == {}


async def test_a_response_is_counted_until_it_is_read_buffer_by_buffer() -> None:
    async with lend_threads() as threads:
        computation = Computation(threads, find_caller=lambda: "a")
        size = 1 << 18
        work = Work(Cost(4 * size, 10.0, response=3 * size), lambda: "done")
        await computation.run(work, "mesh")
        assert threads.unread.totals == {"a": 3 * size}
        computation.finish_work(2 * size)
        assert threads.unread.totals == {"a": 2 * size} == {"a": threads.used_bytes}
        computation.release_sent(size)
        assert threads.unread.totals == {"a": size} == {"a": threads.used_bytes}
        computation.close()
        assert threads.unread.totals == {}


async def test_short_work_and_parsing_are_charged_beside_other_work() -> None:
    async with lend_threads() as threads:
        turn = await acquire(threads, caller="other")
        computation = Computation(threads, find_caller=lambda: "short")
        await computation.run(build_work(call=lambda: time.sleep(0.02), is_long=False), "mesh")
        await computation.parse(lambda: time.sleep(0.02), is_long=False)
        await computation.parse(lambda: time.sleep(0.02), is_long=True)
        computation.close()
        assert threads.accounts._used["short"] >= 0.06
        release(threads, turn)


async def test_a_thread_that_starts_computes_alone_for_a_while() -> None:
    async with lend_threads(threads=3) as threads:
        first = await acquire(threads)
        second_task = asyncio.create_task(acquire(threads))
        await run_tasks()
        assert not second_task.done()
        second = await second_task
        assert second.start - first.start >= ALONE_SECONDS
        third_task = asyncio.create_task(acquire(threads))
        await run_tasks()
        release(threads, second)
        # The first thread still computes, but it started long ago, so the third need not wait.
        third = await third_task
        assert third.start - second.start < ALONE_SECONDS
        release(threads, first, third)


@given(st.lists(st.tuples(st.integers(0, LARGEST), st.integers(0, 3)), max_size=12))
def test_cancelled_requests_release_threads_and_memory(requests: list[tuple[int, int]]) -> None:
    """Each request has an amount of memory and the round in which it is cancelled, or 0 for never.

    In that round the request waits for a thread, gets one, computes, or has ended.
    """

    async def send_and_cancel() -> None:
        async with lend_threads(threads=2) as threads:

            async def use_thread(amount: int) -> None:
                turn = await acquire(threads, amount, "abc"[amount % 3], response=amount // 2)
                try:
                    await asyncio.sleep(0)
                finally:
                    release(threads, turn)

            tasks = [asyncio.create_task(use_thread(amount)) for amount, _ in requests]
            for current_round in range(4):
                await asyncio.sleep(0)
                for task, (_, cancelled_in) in zip(tasks, requests, strict=True):
                    if cancelled_in == current_round and cancelled_in:
                        task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            assert threads.unread.totals == {}

    asyncio.run(send_and_cancel())


async def test_bodies_have_a_memory_budget_of_their_own_and_never_wait() -> None:
    async with lend_threads() as threads:
        large, small, third = Computation(threads), Computation(threads), Computation(threads)
        large_size = threads.max_body * 9 // 10  # the rest is for small bodies
        with pytest.raises(TooLarge) as error:
            large.hold_body(large_size + 1)
        assert error.value.issues[0].code == "too_much_memory"
        large.hold_body(large_size)
        with pytest.raises(Busy):
            third.hold_body(SMALL_BODY + 1)
        small.hold_body(threads.max_body - large_size)
        with pytest.raises(Busy):
            third.hold_body(1)
        # The largest work has memory besides the bodies, and short work besides the largest work.
        turn = await acquire(threads, threads.max_memory)
        assert await third.run(build_work(1000, is_long=False), "x") == "done"
        release(threads, turn)
        large.shrink_body(10)
        large.shrink_body(20)  # no effect, because the body takes less
        assert threads.body_bytes == 10 + threads.max_body - large_size
        for computation in (large, small, third):
            computation.close()


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
        first_task = asyncio.create_task(acquire(threads, threads.max_memory))
        second_task = asyncio.create_task(acquire(threads, CAPACITY * 3 // 16))
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
        threads.give_back(first_task.result())
        threads.give_back(second_task.result())


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

        computation = Computation(threads, receive)
        task = asyncio.create_task(computation.run(build_work(1000, compute), "x"))
        while not threads.busy_count:
            await asyncio.sleep(0.001)
        if client_leaves:
            has_left.set()
        with pytest.raises(ClientDisconnect if client_leaves else OutOfTime):
            await task
        computation.close()
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
            computations = [Computation(threads) for _ in sizes]
            for computation, size in zip(computations, sizes, strict=True):
                await computation.run(build_work(size, is_long=False), "x")
            for computation in computations:  # all end before the event loop continues
                computation.close()
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
            computation = Computation(threads)
            with pytest.raises(ArithmeticError) as error:
                await computation.run(build_work(1000, work), "x")
            assert extract_tb(error.value.__traceback__)[-1].name == "work"
            del error
            computation.close()

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
