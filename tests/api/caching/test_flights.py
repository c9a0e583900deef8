"""Work that many wait for and one task does."""

import asyncio
import gc

import pytest

from service.api.caching.flights import Flights


class Work:
    """Work that goes on until it is let go."""

    def __init__(self, result: object = "done") -> None:
        self.calls = 0
        self.gate = asyncio.Event()
        self.result = result

    async def __call__(self) -> object:
        self.calls += 1
        await self.gate.wait()
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


async def begun(work: Work, flights: Flights, count: int) -> list[asyncio.Task[object]]:
    tasks = [asyncio.create_task(flights.join("key", work)) for _ in range(count)]
    while not work.calls:
        await asyncio.sleep(0)
    return tasks


def test_many_wait_and_one_works() -> None:
    async def scenario() -> None:
        flights, work = Flights(), Work()
        tasks = await begun(work, flights, 1000)
        assert len(flights) == 1
        work.gate.set()
        assert await asyncio.gather(*tasks) == ["done"] * 1000
        assert (work.calls, len(flights)) == (1, 0)
        await flights.join("key", work)
        assert work.calls == 2, "nothing is kept here"

    asyncio.run(scenario())


def test_whoever_asked_first_may_go_away() -> None:
    async def scenario() -> None:
        flights, work = Flights(), Work()
        first, *others = await begun(work, flights, 5)
        first.cancel()
        with pytest.raises(asyncio.CancelledError):
            await first
        work.gate.set()
        assert await asyncio.gather(*others) == ["done"] * 4
        assert work.calls == 1

    asyncio.run(scenario())


def test_the_work_is_done_when_everybody_went_away() -> None:
    async def scenario() -> None:
        flights, work = Flights(), Work()
        for task in await begun(work, flights, 3):
            task.cancel()
        await asyncio.sleep(0)
        assert len(flights) == 1
        again = asyncio.create_task(flights.join("key", work))
        work.gate.set()
        assert await again == "done"
        assert (work.calls, len(flights)) == (1, 0)

    asyncio.run(scenario())


def test_a_failure_is_everybody_s_and_is_not_kept() -> None:
    async def scenario() -> None:
        flights, work = Flights(), Work(ValueError("no"))
        tasks = await begun(work, flights, 10)
        work.gate.set()
        results = await asyncio.gather(*tasks, return_exceptions=True)
        assert [type(result) for result in results] == [ValueError] * 10
        assert len(flights) == 0
        work.result = "done"
        assert await flights.join("key", work) == "done"

    asyncio.run(scenario())


def test_a_failure_that_nobody_waits_for_is_quiet() -> None:
    complaints: list[object] = []

    async def scenario() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, what: complaints.append(what))
        flights, work = Flights(), Work(ValueError("no"))
        (task,) = await begun(work, flights, 1)
        task.cancel()
        work.gate.set()
        while len(flights):
            await asyncio.sleep(0)
        del work, task
        gc.collect()

    asyncio.run(scenario())
    assert complaints == []


def test_different_keys_are_different_work() -> None:
    async def scenario() -> None:
        flights, one, two = Flights(), Work(1), Work(2)
        one.gate.set()
        two.gate.set()
        results = await asyncio.gather(flights.join("a", one), flights.join("b", two))
        assert list(results) == [1, 2]

    asyncio.run(scenario())
