"""What is lent: counted, in the order of asking, and given back whatever happens."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from service.api.admission.busy import Busy
from service.api.admission.pool import Lease, Pool

CAPACITY = 100


class Cache:
    """A tenant that keeps as much as it may."""

    def __init__(self) -> None:
        self.fixed = 0
        self.size = CAPACITY

    def resize(self, room: int) -> None:
        self.size = room
        assert self.fixed <= self.size, "there was no room for what cannot be given up"


async def rest() -> None:
    """Lets all others go on until they wait."""
    for _ in range(5):
        await asyncio.sleep(0)


def played(scenario: Callable[[Pool], Awaitable[None]], pool: Pool | None = None) -> None:
    """Runs a scenario, after which nothing is lent."""
    pool = pool or Pool(CAPACITY)

    async def play() -> None:
        await scenario(pool)

    asyncio.run(play())
    assert (pool.used, pool.waiting) == (0, 0)


def test_what_is_lent_is_counted_until_it_is_given_back() -> None:
    async def scenario(pool: Pool) -> None:
        with suppress(ZeroDivisionError), await pool.lent(60) as lease:
            assert pool.used == 60
            await lease.grown(80)
            assert lease.grow(10)
            assert not lease.grow(11)
            assert not lease.grow(5, leaving=6)
            lease.shrink(95)
            assert pool.used == 90
            lease.shrink(30)
            assert (pool.used, lease.amount) == (30, 30)
            raise ZeroDivisionError
        assert pool.used == 0

    played(scenario)


def test_who_asks_for_much_is_not_passed_by() -> None:
    async def scenario(pool: Pool) -> None:
        first = await pool.lent(50)
        large = asyncio.create_task(pool.lent(60))
        await rest()
        small = asyncio.create_task(pool.lent(1))
        await rest()
        assert pool.waiting == 2
        assert not Lease(pool).grow(1), "nor by those who do not wait"
        first.release()
        for each in (await large, await small):
            each.release()
        assert pool.seconds > 0

    played(scenario)


def test_who_goes_away_makes_way() -> None:
    async def scenario(pool: Pool) -> None:
        first = await pool.lent(50)
        large = asyncio.create_task(pool.lent(60))
        small = asyncio.create_task(pool.lent(10))
        await rest()
        large.cancel()
        (await small).release()
        late = asyncio.create_task(pool.lent(60))
        await rest()
        first.release()
        late.cancel()  # what it was given a moment ago is not lost
        with pytest.raises(asyncio.CancelledError):
            await late

    played(scenario)


def test_more_than_there_is_counts_as_the_whole() -> None:
    async def scenario(pool: Pool) -> None:
        lease = await pool.lent(CAPACITY + 1)
        assert lease.amount == CAPACITY
        await lease.grown(2 * CAPACITY)
        lease.release()

    played(scenario)


def test_so_many_may_wait() -> None:
    pool = Pool(CAPACITY, max_waiting=2)

    async def scenario(pool: Pool) -> None:
        first = await pool.lent(CAPACITY)
        waiting = [asyncio.create_task(pool.lent(1)) for _ in range(2)]
        await rest()
        with pytest.raises(Busy):
            await pool.lent(1)
        assert pool.refused == 1
        first.release()
        for task in waiting:
            (await task).release()

    played(scenario, pool)


@dataclass(eq=False)
class Asking:
    """Somebody who waits, or waited."""

    lease: Lease
    to: int
    task: asyncio.Task[None]


class Lending(RuleBasedStateMachine):
    """Whatever is asked for and given back, in whatever order, and whoever goes away meanwhile."""

    def __init__(self) -> None:
        super().__init__()
        self.loop = asyncio.new_event_loop()
        self.cache = Cache()
        self.pool = Pool(CAPACITY, tenant=self.cache)
        self.held: list[Lease] = []
        self.waiting: list[Asking] = []

    def run(self) -> None:
        """Lets everybody go on; those who waited are served in their order."""
        self.loop.run_until_complete(rest())
        served = [asking.task.done() for asking in self.waiting]
        assert served == sorted(served, reverse=True), "somebody was passed by"
        for asking in [each for each in self.waiting if each.task.done()]:
            asking.task.result()
            assert asking.lease.amount == asking.to
            self.held.append(asking.lease)
            self.waiting.remove(asking)

    @rule(amount=st.integers(1, CAPACITY))
    def ask(self, amount: int) -> None:
        lease = Lease(self.pool)
        task = self.loop.create_task(lease.grown(amount))
        self.waiting.append(Asking(lease, amount, task))
        self.run()

    @precondition(lambda self: self.held)
    @rule(data=st.data(), by=st.integers(0, CAPACITY), leaving=st.integers(0, 10))
    def grow(self, data: st.DataObject, by: int, leaving: int) -> None:
        lease = data.draw(st.sampled_from(self.held))
        fits = self.pool.used + self.cache.fixed + by + leaving <= CAPACITY
        assert lease.grow(by, leaving=leaving) == (not by or (fits and not self.waiting))

    @precondition(lambda self: self.held)
    @rule(data=st.data(), to=st.integers(0, CAPACITY))
    def shrink(self, data: st.DataObject, to: int) -> None:
        data.draw(st.sampled_from(self.held)).shrink(to)
        self.run()

    @precondition(lambda self: self.held)
    @rule(data=st.data())
    def give_back(self, data: st.DataObject) -> None:
        lease = data.draw(st.sampled_from(self.held))
        self.held.remove(lease)
        lease.release()
        self.run()

    @precondition(lambda self: self.waiting)
    @rule(data=st.data(), at_once=st.booleans())
    def go_away(self, data: st.DataObject, at_once: bool) -> None:
        asking = data.draw(st.sampled_from(self.waiting))
        self.waiting.remove(asking)
        if at_once and self.held:  # in the moment in which it may be served
            self.held.pop().release()
        asking.task.cancel()
        self.run()
        assert asking.task.cancelled()
        assert asking.lease.amount == 0

    @rule(fixed=st.integers(0, CAPACITY))
    def use_cache(self, fixed: int) -> None:
        self.cache.fixed = min(fixed, self.cache.size)
        self.pool.settle()
        self.run()

    @invariant()
    def counted(self) -> None:
        assert self.pool.used == sum(lease.amount for lease in self.held)
        assert self.pool.waiting == len(self.waiting)
        assert self.pool.used + self.cache.fixed <= CAPACITY
        assert self.cache.size == CAPACITY - self.pool.used

    @invariant()
    def nobody_waits_for_nothing(self) -> None:
        if self.waiting:
            free = CAPACITY - self.pool.used - self.cache.fixed
            assert self.waiting[0].to > free

    def teardown(self) -> None:
        for asking in self.waiting:
            asking.task.cancel()
        self.loop.run_until_complete(rest())
        for lease in self.held:
            lease.release()
        self.loop.run_until_complete(rest())
        self.loop.close()
        assert (self.pool.used, self.pool.waiting) == (0, 0)


Lending.TestCase.settings = settings(max_examples=40, stateful_step_count=30, deadline=None)
TestLending = Lending.TestCase
