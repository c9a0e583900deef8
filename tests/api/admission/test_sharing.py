"""One memory for all: bodies, what is computed, and what is kept of answers."""

import asyncio

import pytest

from service.api.admission.admission import FREE_ARRIVAL, LEFT, Admission
from service.api.admission.arrivals import Arrival
from service.api.admission.busy import Busy
from service.api.admission.pool import Lease
from service.api.admission.visits import Visit
from service.api.caching.answers import AnswerCache
from service.api.caching.entries import Entry, Subject
from service.api.timing import Timing
from service.api.work import parsed
from service.errors import TooLarge
from service.settings.values import Settings

SETTINGS = Settings(threads=2, cache_bytes=1 << 30, memory_bytes=400_000_000)


def entry(name: str, size: int) -> Entry:
    return Entry(Subject(f"/{name}", name, name, False), bytes(size), {})


def test_all_pools_together_are_the_memory_there_is() -> None:
    admission = Admission(SETTINGS)
    pools = (admission.arriving, admission.small.memory, admission.large.memory)
    assert sum(pool.capacity for pool in pools) == SETTINGS.memory_bytes == admission.capacity


def test_bodies_lodge_where_nobody_waits() -> None:
    admission = Admission(SETTINGS)
    arriving, working = admission.arriving, admission.large.memory
    large, other, small = Arrival(admission), Arrival(admission), Arrival(admission)
    large.claim(arriving.capacity + 1000)
    assert arriving.used == arriving.capacity - arriving.capacity // LEFT
    assert large.amount == arriving.used + working.used == arriving.capacity + 1000
    large.claim(1000)
    assert large.amount == arriving.capacity + 1000, "it does not shrink as more arrives"
    small.claim(FREE_ARRIVAL)
    assert small.amount == FREE_ARRIVAL
    with pytest.raises(Busy):
        other.claim(working.capacity)
    assert (other.amount, arriving.refused) == (0, 1)
    with pytest.raises(TooLarge):
        other.claim(SETTINGS.memory_bytes)
    large.parsed()
    assert working.used == 0
    assert large.amount == (arriving.capacity + 1000) // 4
    for arrival in (large, other, small):
        arrival.release()
    assert admission.used == 0


def test_bodies_do_not_lodge_where_somebody_waits() -> None:
    async def scenario() -> None:
        admission = Admission(SETTINGS)
        working = admission.large.memory
        first = await working.lent(working.capacity - 1000)
        waits = asyncio.create_task(working.lent(2000))
        await asyncio.sleep(0)
        arrival = Arrival(admission)
        with pytest.raises(Busy):
            arrival.claim(admission.arriving.capacity)
        first.release()
        (await waits).release()
        arrival.claim(admission.arriving.capacity)

    asyncio.run(scenario())


@pytest.mark.parametrize("lodges", [False, True])
def test_nobody_waits_for_a_body_that_comes_slowly(lodges: bool) -> None:
    """One that takes of the memory that another waits for leaves at once; others stay."""

    async def scenario() -> None:
        admission = Admission(SETTINGS)
        working, arrival = admission.large.memory, Arrival(admission)
        arrival.claim(admission.arriving.capacity if lodges else 1000)

        async def arrives() -> None:
            with arrival.within(60):
                await asyncio.sleep(60)

        arriving = asyncio.create_task(arrives())
        await asyncio.sleep(0)
        first = await working.lent(working.capacity - arrival.amount)
        assert not arriving.done(), "nobody waits"
        waiting = asyncio.create_task(working.lent(arrival.amount + 1))
        await asyncio.wait([arriving], timeout=0.01)
        assert arriving.done() == lodges
        if lodges:
            assert isinstance(arriving.exception(), Busy)
        assert working.refused == lodges
        arriving.cancel()
        arrival.release()
        first.release()
        (await waiting).release()
        assert not working.lodgers

    asyncio.run(scenario())


def test_a_body_has_so_long() -> None:
    async def scenario() -> None:
        with Arrival(Admission(SETTINGS)).within(0.01):
            await asyncio.sleep(60)

    with pytest.raises(TimeoutError):
        asyncio.run(scenario())


def test_a_body_that_lodges_is_parsed_though_others_have_the_threads() -> None:
    """Who has the thread waits for the memory that the body takes."""

    async def scenario() -> None:
        admission = Admission(Settings(threads=1))
        lane = admission.large
        lodger, other = Visit(admission), Visit(admission)
        lodger.arrival.claim(admission.arriving.capacity + 1000)
        await other.thread(lane)
        waits = asyncio.create_task(other.room(lane, lane.memory.capacity))
        await asyncio.sleep(0)
        assert lane.memory.waiting == 1
        assert not admission.has_room(lane.memory.capacity)
        with lodger.current():
            async with asyncio.timeout(30):
                await parsed(lambda: None, Timing(), is_long=True)
        await waits
        lodger.close()
        other.close()
        assert (admission.used, admission.computing) == (0, 0)
        assert admission.has_room(lane.memory.capacity)

    asyncio.run(scenario())


def test_answers_that_are_kept_give_way() -> None:
    answers = AnswerCache(SETTINGS.cache_bytes)
    admission = Admission(SETTINGS, answers)
    pool = admission.large.memory
    size = pool.capacity // 10
    for number in range(20):
        answers.put(entry(str(number), size), answers.age)
    assert pool.capacity - size < answers.bytes <= pool.capacity
    lease = Lease(pool)
    for part in range(1, 10):
        assert lease.grow(size)
        assert answers.bytes <= answers.allowed == pool.capacity - part * size
    assert not answers.put(entry("more", 2 * size), answers.age)
    lease.release()
    assert answers.allowed == pool.capacity
    assert answers.put(entry("more", 2 * size), answers.age)


def test_what_is_being_read_is_kept_and_waited_for() -> None:
    answers = AnswerCache(SETTINGS.cache_bytes)
    admission = Admission(SETTINGS, answers)
    pool = admission.large.memory
    answers.freed = pool.settle
    read, forgotten, unread = (entry(name, pool.capacity // 10) for name in "abc")
    for each in (read, forgotten, unread):
        answers.put(each, answers.age)

    async def scenario() -> None:
        with answers.reading(read):
            with answers.reading(forgotten), answers.reading(forgotten):
                answers.forget("b")
                assert answers.fixed == read.size + forgotten.size
                most = pool.capacity - answers.fixed
                lease = await pool.lent(most)
                assert (answers.holds(read), answers.holds(unread)) == (True, False)
                assert answers.add(read, "gzip", bytes(1000)).body == bytes(1000)
                assert "gzip" not in read.variants, "there is no room for it"
                waits = asyncio.create_task(lease.grown(most + forgotten.size))
                await asyncio.sleep(0)
                assert pool.waiting == 1
            await waits
            assert answers.fixed == read.size
            waits = asyncio.create_task(lease.grown(pool.capacity))
            await asyncio.sleep(0)
            assert pool.waiting == 1
        await waits
        assert (answers.bytes, len(answers), pool.used) == (0, 0, pool.capacity)
        lease.release()

    asyncio.run(scenario())


def test_when_to_come_again_is_told_by_those_who_wait() -> None:
    async def scenario() -> None:
        admission = Admission(SETTINGS)
        threads = admission.large.threads
        assert admission.retry_after() == 1
        held = await threads.lent(2)
        waiting = [asyncio.create_task(threads.lent(1)) for _ in range(5)]
        await asyncio.sleep(0)
        assert (admission.waiting, admission.retry_after()) == (5, 4)
        held.release()
        for task in waiting:
            (await task).release()

    asyncio.run(scenario())
