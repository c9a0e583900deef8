"""Single flight: one task computes a result for all requests that ask for it at the same time."""

import asyncio
import gc
import threading
import time
import weakref
from collections.abc import Awaitable, Callable
from contextlib import closing

import pytest

from service.api.caching.cache import ResponseCache
from service.api.computation import Computation
from service.api.single_flight import SingleFlight
from service.api.threads import Threads
from service.cancellation import Cancelled, checkpoint
from service.pipeline.cost import Cost
from service.pipeline.cost import Work as LongWork
from service.settings.values import Settings

pytestmark = pytest.mark.anyio


class Flights(SingleFlight):
    """`SingleFlight` with a method that waits for a result as a request does."""

    def __init__(self) -> None:
        self.threads = Threads(Settings(threads=2, memory_bytes=1 << 24), ResponseCache(0))
        super().__init__(self.threads)

    async def send_request(
        self, key: str, work: Callable[[Computation], Awaitable[object]]
    ) -> object:
        """The result of one request, which ends when it has the result."""
        with closing(Computation(self.threads)) as computation:
            return await self.join(key, work, computation, computation.on_ready)


class Work:
    """Work that runs until `may_end` is set; then it returns its result, or raises an exception."""

    def __init__(self, result: object = "done") -> None:
        self.calls = 0
        self.may_end = asyncio.Event()
        self.result = result

    async def __call__(self, _: Computation) -> object:
        self.calls += 1
        await self.may_end.wait()
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


async def begin_requests(work: Work, flights: Flights, count: int) -> list[asyncio.Task[object]]:
    """Tasks of `count` requests for the same work, which has begun."""
    tasks = [asyncio.create_task(flights.send_request("key", work)) for _ in range(count)]
    while not work.calls:
        await asyncio.sleep(0)
    return tasks


async def test_many_requests_wait_for_one_computation() -> None:
    flights, work = Flights(), Work()
    tasks = await begin_requests(work, flights, 1000)
    assert len(flights) == 1
    work.may_end.set()
    assert await asyncio.gather(*tasks) == ["done"] * 1000
    assert (work.calls, len(flights)) == (1, 0)
    await flights.send_request("key", work)
    assert work.calls == 2, "a result is not kept after its requests"


async def test_the_first_request_may_be_cancelled() -> None:
    flights, work = Flights(), Work()
    first_task, *other_tasks = await begin_requests(work, flights, 5)
    first_task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await first_task
    work.may_end.set()
    assert await asyncio.gather(*other_tasks) == ["done"] * 4
    assert work.calls == 1


async def test_work_is_cancelled_with_its_last_request_and_a_later_request_starts_it_again() -> (
    None
):
    flights, work, other_work = Flights(), Work(), Work("other")
    cancelled_tasks = await begin_requests(work, flights, 3)
    other_task = asyncio.create_task(flights.send_request("other", other_work))
    for task in cancelled_tasks[:2]:
        task.cancel()
    await asyncio.wait(cancelled_tasks[:2])
    assert len(flights) == 2, "the third request still waits"
    cancelled_tasks[2].cancel()
    await asyncio.wait(cancelled_tasks)
    assert len(flights) == 1
    later_task = asyncio.create_task(flights.send_request("key", work))
    while work.calls < 2:
        await asyncio.sleep(0)
    work.may_end.set()
    other_work.may_end.set()
    assert await later_task == "done"
    assert await other_task == "other"
    assert (work.calls, other_work.calls, len(flights)) == (2, 1, 0)


async def test_a_result_is_shared_as_long_as_a_request_uses_it() -> None:
    """`finish_work` of a computation calls its `on_ready`, and `close` its `on_end`."""
    flights, work = Flights(), Work()
    work.may_end.set()
    first, second = Computation(flights.threads), Computation(flights.threads)
    await flights.join("key", work, first, first.on_ready)
    first.finish_work(0)
    assert len(flights) == 0, "the request needs the result no longer"
    for computation in (first, second):
        await flights.join("key", work, computation, computation.on_end)
        computation.finish_work(0)
    assert (work.calls, len(flights)) == (2, 1)
    first.close()
    assert len(flights) == 1
    second.close()
    assert len(flights) == 0


async def test_a_thread_without_requests_is_cancelled_and_keeps_its_memory_until_it_ends() -> None:
    is_cancelled, may_end = threading.Event(), threading.Event()

    def compute() -> None:
        try:
            while True:
                time.sleep(0.001)
                checkpoint()
        except Cancelled:
            is_cancelled.set()
            assert may_end.wait(10)
            raise

    async def work(computation: Computation) -> None:
        cost = Cost(memory=1000, seconds=1.0)
        await computation.run(LongWork(cost, compute), "x")

    flights = Flights()
    threads = flights.threads
    tasks = [asyncio.create_task(flights.send_request("key", work)) for _ in range(2)]
    while not threads.busy_count:
        await asyncio.sleep(0.001)
    for task in tasks:
        task.cancel()
    await asyncio.wait(tasks)
    assert len(flights) == 0
    assert (threads.used_bytes, threads.busy_count) == (1000, 1)
    may_end.set()
    while threads.used_bytes:
        await asyncio.sleep(0.001)
    assert is_cancelled.is_set()
    assert threads.busy_count == 0


async def test_all_waiting_requests_get_the_error_which_is_not_kept() -> None:
    flights, work = Flights(), Work(ValueError("no"))
    tasks = await begin_requests(work, flights, 10)
    work.may_end.set()
    results = await asyncio.gather(*tasks, return_exceptions=True)
    assert [type(result) for result in results] == [ValueError] * 10
    assert len(flights) == 0
    work.result = "done"
    assert await flights.send_request("key", work) == "done"


def test_the_error_of_work_without_requests_is_not_logged() -> None:
    reports: list[object] = []

    async def cancel_request() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: reports.append(context))
        flights, work = Flights(), Work(ValueError("no"))
        (task,) = await begin_requests(work, flights, 1)
        task.cancel()
        work.may_end.set()
        while len(flights):
            await asyncio.sleep(0)
        # asyncio logs an error that nothing has read when it deletes the task.
        del work, task
        gc.collect()

    asyncio.run(cancel_request())
    assert reports == []


def test_failed_work_leaves_no_reference_cycles() -> None:
    references: list[weakref.ref[Computation]] = []

    async def fail(computation: Computation) -> object:
        references.append(weakref.ref(computation))
        del computation  # the traceback of the error refers to the local variables of this function
        await asyncio.sleep(0)
        raise ArithmeticError

    async def send_requests() -> None:
        flights = Flights()
        for _ in range(2):
            with pytest.raises(ArithmeticError):
                await flights.send_request("key", fail)
        await asyncio.sleep(0)

    gc.collect()
    gc.disable()
    try:
        asyncio.run(send_requests())
        assert [reference() for reference in references] == [None, None]
    finally:
        gc.enable()
