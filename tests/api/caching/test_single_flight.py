"""Single flight: one task computes a result for several requests."""

import asyncio
import gc
import threading
import time
import weakref
from collections.abc import Awaitable, Callable
from contextlib import closing

import pytest

from service.api.caching.cache import ResponseCache
from service.api.caching.single_flight import SingleFlight
from service.api.workers import Job, Workers
from service.cancellation import Cancelled, checkpoint
from service.pipeline.cost import Cost
from service.settings.values import Settings

pytestmark = pytest.mark.anyio


class Airport(SingleFlight):
    """SingleFlight with a method that joins as a request does."""

    def __init__(self) -> None:
        self.workers = Workers(Settings(threads=2, memory_bytes=1 << 24), ResponseCache(0))
        super().__init__(self.workers)

    async def asked(self, key: str, work: Callable[[Job], Awaitable[object]]) -> object:
        """The result of one request, which then ends at once."""
        with closing(Job(self.workers)) as job:
            return await self.join(key, work, job.until_ready)


class Work:
    """Work that runs until the test ends it."""

    def __init__(self, result: object = "done") -> None:
        self.calls = 0
        self.gate = asyncio.Event()
        self.result = result

    async def __call__(self, _: Job) -> object:
        self.calls += 1
        await self.gate.wait()
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


async def begin_requests(work: Work, flights: Airport, count: int) -> list[asyncio.Task[object]]:
    tasks = [asyncio.create_task(flights.asked("key", work)) for _ in range(count)]
    while not work.calls:
        await asyncio.sleep(0)
    return tasks


async def test_many_wait_and_one_works() -> None:
    flights, work = Airport(), Work()
    tasks = await begin_requests(work, flights, 1000)
    assert len(flights) == 1
    work.gate.set()
    assert await asyncio.gather(*tasks) == ["done"] * 1000
    assert (work.calls, len(flights)) == (1, 0)
    await flights.asked("key", work)
    assert work.calls == 2, "nothing is kept here"


async def test_the_first_request_may_be_cancelled() -> None:
    flights, work = Airport(), Work()
    first, *others = await begin_requests(work, flights, 5)
    first.cancel()
    with pytest.raises(asyncio.CancelledError):
        await first
    work.gate.set()
    assert await asyncio.gather(*others) == ["done"] * 4
    assert work.calls == 1


async def test_the_work_is_cancelled_with_the_last_request_and_a_later_one_starts_it_again() -> (
    None
):
    flights, work, other = Airport(), Work(), Work("other")
    leaving = await begin_requests(work, flights, 3)
    staying = asyncio.create_task(flights.asked("other", other))
    for task in leaving[:2]:
        task.cancel()
    await asyncio.wait(leaving[:2])
    assert len(flights) == 2, "the third one waits"
    leaving[2].cancel()
    await asyncio.wait(leaving)
    assert len(flights) == 1
    again = asyncio.create_task(flights.asked("key", work))
    while work.calls < 2:
        await asyncio.sleep(0)
    work.gate.set()
    other.gate.set()
    assert await again == "done"
    assert await staying == "other"
    assert (work.calls, other.calls, len(flights)) == (2, 1, 0)


async def test_a_result_is_shared_as_long_as_a_request_uses_it() -> None:
    flights, work = Airport(), Work()
    work.gate.set()
    first, second = Job(flights.workers), Job(flights.workers)
    await flights.join("key", work, first.until_ready)
    first.finish_work(0)
    assert len(flights) == 0, "what was computed from it is there"
    for job in (first, second):
        await flights.join("key", work, job.until_end)
        job.finish_work(0)
    assert (work.calls, len(flights)) == (2, 1)
    first.close()
    assert len(flights) == 1
    second.close()
    assert len(flights) == 0


async def test_an_abandoned_thread_is_cancelled_and_keeps_its_memory_until_it_ends() -> None:
    reported, let_go = threading.Event(), threading.Event()

    def compute() -> None:
        try:
            while True:
                time.sleep(0.001)
                checkpoint()
        except Cancelled:
            reported.set()
            assert let_go.wait(10)
            raise

    class Computing:
        cost = Cost(0, 0, 0, 1000, 1.0)
        run = staticmethod(compute)

    async def work(job: Job) -> None:
        await job.run(Computing(), "x")

    flights = Airport()
    workers = flights.workers
    asking = [asyncio.create_task(flights.asked("key", work)) for _ in range(2)]
    while not workers.computing:
        await asyncio.sleep(0.001)
    for task in asking:
        task.cancel()
    await asyncio.wait(asking)
    assert len(flights) == 0
    assert (workers.used, workers.computing) == (1000, 1)
    let_go.set()
    while workers.used:
        await asyncio.sleep(0.001)
    assert reported.is_set()
    assert workers.computing == 0


async def test_all_waiting_requests_get_a_failure_which_is_not_kept() -> None:
    flights, work = Airport(), Work(ValueError("no"))
    tasks = await begin_requests(work, flights, 10)
    work.gate.set()
    results = await asyncio.gather(*tasks, return_exceptions=True)
    assert [type(result) for result in results] == [ValueError] * 10
    assert len(flights) == 0
    work.result = "done"
    assert await flights.asked("key", work) == "done"


def test_an_abandoned_failure_is_quiet() -> None:
    complaints: list[object] = []

    async def scenario() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, what: complaints.append(what))
        flights, work = Airport(), Work(ValueError("no"))
        (task,) = await begin_requests(work, flights, 1)
        task.cancel()
        work.gate.set()
        while len(flights):
            await asyncio.sleep(0)
        del work, task
        gc.collect()

    asyncio.run(scenario())
    assert complaints == []


def test_work_that_fails_leaves_nothing() -> None:
    left: list[weakref.ref[Job]] = []

    async def fails(job: Job) -> object:
        left.append(weakref.ref(job))
        del job
        await asyncio.sleep(0)
        raise ArithmeticError

    async def scenario() -> None:
        flights = Airport()
        for _ in range(2):
            with pytest.raises(ArithmeticError):
                await flights.asked("key", fails)
        await asyncio.sleep(0)

    gc.collect()
    gc.disable()
    try:
        asyncio.run(scenario())
        assert [job() for job in left] == [None, None]
    finally:
        gc.enable()
