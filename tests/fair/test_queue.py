"""Turns between callers: the one that has used the fewest thread seconds is served first."""

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.fair import accounts as accounts_module
from service.fair.accounts import MAX_CALLERS, Accounts
from service.fair.compute_limit import ComputeLimit, ComputeState
from service.fair.lock import FairLock
from service.fair.queue import FairQueue
from tests.clock import Clock, stop_clock


class Pool:
    """A queue with threads that serve it, by a clock that the tests set."""

    def __init__(self, clock: Clock, count: int = 1, accounts: Accounts | None = None) -> None:
        self.clock, self.count = clock, count
        self.queue: FairQueue[float] = FairQueue(Accounts() if accounts is None else accounts)
        self.running: list[tuple[float, str]] = []  # the end and the caller of each piece of work
        self.served: list[str] = []

    def send(self, caller: str, *seconds: float) -> None:
        """Work of a caller that takes these seconds each; starts it if a thread is free."""
        for each in seconds:
            self.queue.add(caller, each)
        self.start()

    def start(self) -> None:
        while self.queue.waiting and self.queue.busy_count < self.count:
            caller = self.queue.in_turn()[0]
            seconds = self.queue.first(caller)
            self.queue.take_thread(caller)
            self.queue.remove(caller, seconds)
            self.running.append((self.clock.now + seconds, caller))

    def run_until(self, end: float) -> None:
        """Moves the clock to `end`, and serves meanwhile."""
        while self.running and min(self.running)[0] <= end:
            first = min(self.running)
            self.running.remove(first)
            self.clock.now = first[0]
            self.queue.return_thread(first[1])
            self.served.append(first[1])
            self.start()
        self.clock.now = end


def test_the_caller_that_has_used_least_is_served_first(clock: Clock) -> None:
    pool = Pool(clock)
    pool.send("heavy", *[4.0] * 5)
    pool.run_until(1001)
    pool.send("light", *[1.0] * 6)  # begins with the use of the other, which is 1 s
    pool.run_until(1100)
    # At 1004 they have used 4 s and 1 s.
    assert pool.served[:4] == ["heavy", "light", "light", "light"]
    assert len(pool.served) == 11


def test_work_is_charged_while_it_runs(clock: Clock) -> None:
    """A long mesh does not keep its caller's turn until it ends."""
    pool = Pool(clock, count=2)
    pool.send("heavy", 100.0)
    pool.send("other", *[2.0] * 10)
    pool.run_until(1001)
    pool.send("heavy", 1.0)
    pool.run_until(1019.5)
    assert pool.served == ["other"] * 9
    pool.run_until(1100)
    assert pool.served[-1] == "heavy"


def test_a_newcomer_begins_at_the_least_use_of_the_active_callers(clock: Clock) -> None:
    """No caller saves up seconds while idle: a newcomer does not take all threads for long."""
    pool = Pool(clock)
    pool.send("first", *[1.0] * 200)
    pool.run_until(1100)
    pool.send("newcomer", *[1.0] * 50)
    pool.run_until(1140)
    assert pool.served[100:].count("newcomer") in range(19, 22)


def test_a_debt_stays_until_the_others_have_caught_up(clock: Clock) -> None:
    pool = Pool(clock)
    pool.send("debtor", 30.0)
    pool.send("steady", *[1.0] * 100)
    pool.run_until(1030.5)
    pool.send("debtor", 1.0)  # comes back: it has used 30 s, the other one half a second
    pool.run_until(1059.5)
    assert pool.served == ["debtor"] + ["steady"] * 29
    pool.run_until(1063)
    assert pool.served.count("debtor") == 2


def test_debts_are_forgotten_when_no_caller_is_active() -> None:
    accounts = Accounts()
    accounts.enter("a")
    accounts.charge("b", 5.0)
    for _ in range(2):  # being idle does not change a debt
        accounts.enter("b")
        assert accounts.in_turn(["b", "a"]) == ["a", "b"]
        accounts.leave("b")
    accounts.leave("a")
    assert len(accounts) == 0
    accounts.enter("a")
    accounts.enter("b")
    assert accounts.in_turn(["b", "a"]) == ["b", "a"]


def test_two_pools_share_accounts(clock: Clock) -> None:
    """Work in processes is charged to the accounts of the threads."""
    accounts = Accounts()
    threads, processes = Pool(clock, 1, accounts), Pool(clock, 2, accounts)
    processes.send("jobs", *[5.0] * 20)
    threads.send("other", 1.0)
    clock.now += 0.5
    threads.send("jobs", 1.0)
    threads.send("other", 1.0)
    threads.run_until(1010)
    assert threads.served == ["other", "other", "jobs"]


@given(
    st.lists(
        st.tuples(st.sampled_from("abcd"), st.sampled_from([0.1, 0.5, 1.0, 3.0])),
        min_size=1,
        max_size=60,
    ),
    st.integers(1, 3),
)
def test_callers_that_always_wait_use_as_much_as_each_other(
    work: list[tuple[str, float]], count: int
) -> None:
    """While two callers both wait, their use differs by at most one piece of work for each thread.

    And no thread is idle while work waits, and all work is served once.
    """
    with stop_clock() as clock:
        pool = Pool(clock, count)
        for caller, seconds in work:
            pool.queue.add(caller, seconds)
        pool.start()
        used = dict.fromkeys("abcd", 0.0)
        longest = max(seconds for _, seconds in work)
        while pool.running:
            assert len(pool.running) == count or not pool.queue.waiting
            waiting = [c for c in used if c in pool.queue.waiting]
            values = [used[caller] for caller in waiting]
            assert not values or max(values) - min(values) <= count * longest + 1e-6
            end = min(pool.running)[0]
            for _, caller in pool.running:
                used[caller] += end - clock.now
            pool.run_until(end)
        assert sorted(pool.served) == sorted(caller for caller, _ in work)
        assert pool.queue.length == pool.queue.busy_count == len(pool.queue.accounts.active) == 0


def test_a_full_queue_pushes_out_the_newest_work_of_the_caller_with_most() -> None:
    queue: FairQueue[int] = FairQueue(Accounts())
    for number in range(5):
        queue.add("many", number)
    queue.add("few", 10)
    assert queue.push_out("new") == 4
    assert queue.push_out("few") == 3
    assert queue.push_out("many") is None, "its own new work is one too many"
    assert list(queue.waiting["many"]) == [0, 1, 2]
    assert queue.length == 4
    empty: FairQueue[int] = FairQueue(Accounts())
    assert empty.push_out("new") is None


def test_the_number_of_accounts_is_bounded_and_active_callers_stay() -> None:
    accounts = Accounts()
    accounts.enter("active")
    accounts.charge("active", 1.0)
    for number in range(MAX_CALLERS + 10):
        accounts.charge(f"idle {number}", 1.0)
    assert len(accounts) == MAX_CALLERS
    assert accounts.in_turn(["active"]) == ["active"]


def test_the_compute_limit_is_a_bucket_that_work_may_overdraw(clock: Clock) -> None:
    limit = ComputeLimit(30)
    assert limit.state("a") == ComputeState(30, 0, 0)
    limit.spend("a", 12.5)
    assert limit.state("a") == ComputeState(17, 25, 0)
    limit.spend("a", 17.0)
    assert limit.state("a") == ComputeState(0, 59, 0), "half a second is left, so work may begin"
    limit.spend("a", 10.5)
    assert limit.state("a") == ComputeState(0, 80, 20)
    assert limit.state("b") == ComputeState(30, 0, 0)
    clock.now += 20
    assert limit.state("a").retry_after == 1, "nothing is left, and nothing is owed"
    clock.now += 0.1
    assert limit.state("a") == ComputeState(0, 60, 0)
    clock.now += 60
    assert limit.state("a") == ComputeState(30, 0, 0)


def test_the_compute_limit_is_charged_while_work_runs(clock: Clock) -> None:
    accounts = Accounts(ComputeLimit(60))
    accounts.enter("a")
    accounts.take_thread("a")
    clock.now += 20
    accounts.charge_running()
    assert accounts.limit is not None
    assert accounts.limit.state("a").remaining == 60, "one thread uses as much as is refilled"
    accounts.take_thread("a")
    clock.now += 15
    accounts.charge_running()
    assert accounts.limit.state("a").remaining == 60 - 2 * 15 + 15


def test_the_compute_limit_remembers_a_bounded_number_of_callers() -> None:
    limit = ComputeLimit(1)
    for number in range(MAX_CALLERS + 100):
        limit.spend(str(number), 1.0)
        limit.spend("frequent", 1.0)
    assert len(limit) == MAX_CALLERS
    assert limit.state("frequent").retry_after


def test_a_lock_is_lent_in_turn_and_survives_cancellation() -> None:
    async def run() -> list[str]:
        lock, order = FairLock(Accounts()), list[str]()

        async def use(caller: str) -> None:
            await lock.acquire(caller)
            order.append(caller)
            with stop_clock() as clock:
                clock.now += 1
            await asyncio.sleep(0)
            lock.release(caller)

        await lock.acquire("a")
        tasks = [asyncio.create_task(use(caller)) for caller in "aaab"]
        await asyncio.sleep(0)
        tasks[0].cancel()
        await asyncio.sleep(0)
        lock.release("a")
        tasks[1].cancel()  # the lock may just have been granted to it
        await asyncio.gather(*tasks, return_exceptions=True)
        assert not lock.locked()
        return order

    assert sorted(asyncio.run(run())) == ["a", "b"]


def test_a_caller_more_than_there_are_accounts_gets_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accounts_module, "MAX_CALLERS", 2)
    accounts = Accounts()
    for number in range(2):
        accounts.enter(str(number))
    accounts.charge("idle", 1.0)  # all others are active
    accounts.enter("new")
    assert accounts.in_turn(["new", "0"]) == ["new", "0"]
    assert len(accounts) == 3  # all are active


def test_a_pause_is_not_charged() -> None:
    with stop_clock() as clock:
        limit = ComputeLimit(6)
        accounts = Accounts(limit)
        for caller in "ab":
            accounts.enter(caller)
            accounts.take_thread(caller)
        clock.now += 10.0
        with accounts.pause("a"):
            clock.now += 10.0
        clock.now += 10.0
        for caller in "ab":
            accounts.return_thread(caller)
        assert accounts.in_turn("ba") == ["a", "b"]
        assert limit.state("b").reset - limit.state("a").reset == 100  # 10 thread seconds
