"""Jobs that cannot go on for a while: they say why, and go on by themselves."""

import asyncio

import pytest
from obstore.store import MemoryStore

from service.errors import JobQuotaFull
from service.fair.compute_limit import ComputeLimit
from service.jobs import dispatch, manager
from service.jobs.batch import STORE_FAILED, WRONG_ENGINE
from service.jobs.engine import EngineUnavailable
from service.jobs.keys import JOBS, PARTS
from service.storage.backends import Bucket
from tests.clock import stop_clock
from tests.jobs.fakes import Instance, make_parts, until


@pytest.fixture(autouse=True)
def _retry_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dispatch, "RETRY_SECONDS", 0.1)
    monkeypatch.setattr(manager, "SAVE_SECONDS", 0.02)


async def count_again(instance: Instance) -> None:
    """Counts the bytes in use; the first call may wait for a count that began before."""
    for _ in range(2):
        await instance.jobs.usage.recount()


async def wait_until_it_waits(instance: Instance, id: str) -> str:
    """The reason for which a job waits."""
    async with asyncio.timeout(20):
        while not (state := await instance.jobs.state(id)).waiting_for:
            assert not state.has_ended
            await asyncio.sleep(0.005)
    return state.waiting_for


@pytest.mark.parametrize("end", ["disk_full", "store_full", STORE_FAILED, WRONG_ENGINE])
def test_a_batch_that_ends_early_is_named_and_tried_again(end: str) -> None:
    async def run() -> None:
        async with Instance(slots=1) as instance:
            instance.engine.ends.append(end)
            state, _ = await instance.submit(make_parts("p", 2, seconds=1))
            assert await wait_until_it_waits(instance, state.id) == end
            done = await instance.wait(state.id)
            assert (done.state, done.waiting_for) == ("succeeded", "")
            assert sorted(instance.engine.names) == ["p0", "p1"]

    asyncio.run(run())


def test_an_engine_without_processes_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    async def run() -> None:
        async with Instance() as instance:
            compute = instance.engine.run
            calls = 0

            async def run_later(task: bytes) -> bytes:
                nonlocal calls
                calls += 1
                if calls < 3:
                    raise EngineUnavailable("no_scheduler")
                return await compute(task)

            monkeypatch.setattr(instance.engine, "run", run_later)
            state, _ = await instance.submit(make_parts("p", 1))
            assert await wait_until_it_waits(instance, state.id) == "no_scheduler"
            assert (await instance.wait(state.id)).state == "succeeded"

    asyncio.run(run())


class Disk(Bucket):
    """A backend in memory whose disk may be full, or gone."""

    error: OSError | None = None

    def fail(self, error: OSError | None) -> None:
        object.__setattr__(self, "error", error)

    async def write(self, key: str, content: bytes, *, durable: bool = True) -> None:
        if self.error is not None:
            raise self.error
        await super().write(key, content, durable=durable)


@pytest.mark.parametrize(
    ("number", "code"), [(28, "disk_full"), (5, STORE_FAILED)], ids=["full", "lost"]
)
def test_records_and_the_end_of_a_job_wait_for_the_disk(number: int, code: str) -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk, slots=1) as instance:
            instance.engine.gate.clear()
            state, _ = await instance.submit(make_parts("p", 2, seconds=1))
            disk.fail(OSError(number, "no"))
            instance.engine.gate.set()
            assert await wait_until_it_waits(instance, state.id) == code
            assert (await instance.jobs.state(state.id)).succeeded == 0
            disk.fail(None)
            assert (await instance.wait(state.id)).state == "succeeded"
            # The end alone waits too: until it is stored, the job has not ended.
            instance.engine.gate.clear()
            other, _ = await instance.submit(make_parts("q", 1))
            write = disk.write

            async def write_no_state(key: str, content: bytes, *, durable: bool = True) -> None:
                if key == f"{JOBS}/{other.id}/state.json":
                    raise OSError(number, "no")
                await write(key, content, durable=durable)

            object.__setattr__(disk, "write", write_no_state)
            instance.engine.gate.set()
            await until(lambda: "q0" in instance.engine.names)
            await asyncio.sleep(0.1)
            assert (await instance.jobs.state(other.id)).state == "running"
            object.__setattr__(disk, "write", write)
            assert (await instance.wait(other.id)).state == "succeeded"

    asyncio.run(run())


def test_results_count_against_a_quota_of_their_own() -> None:
    async def run() -> None:
        async with Instance(slots=1, job_quota=4000) as instance:
            state, _ = await instance.submit(make_parts("p", 1))
            await instance.wait(state.id)
            await instance.backend.write(f"{PARTS}/ab/0", bytes(4000))
            await count_again(instance)
            with pytest.raises(JobQuotaFull):
                await instance.submit(make_parts("o", 1))
        # A job that has been accepted waits for room.
        async with Instance(instance.backend, slots=1, job_quota=10_000) as instance:
            instance.engine.gate.clear()
            state, _ = await instance.submit(make_parts("q", 2, seconds=1))
            await instance.backend.write(f"{PARTS}/ab/1", bytes(10_000))
            await count_again(instance)
            instance.engine.gate.set()
            assert await wait_until_it_waits(instance, state.id) == "job_quota_full"
            await instance.backend.delete(f"{PARTS}/ab/1")
            await count_again(instance)
            assert (await instance.wait(state.id)).state == "succeeded"

    asyncio.run(run())


def test_batches_of_a_caller_over_its_compute_limit_wait() -> None:
    async def run() -> None:
        async with Instance(slots=1) as instance:
            limit = instance.accounts.limit = ComputeLimit(60)
            limit.spend("a", 61)
            mine, _ = await instance.submit(make_parts("p", 1), "a")
            others, _ = await instance.submit(make_parts("q", 1), "b")
            assert (await instance.wait(others.id)).state == "succeeded"
            assert (await instance.jobs.state(mine.id)).state == "queued"
            assert (await instance.wait(mine.id)).state == "succeeded"

    asyncio.run(run())


def test_a_batch_that_waits_for_memory_is_not_charged() -> None:
    async def run() -> None:
        with stop_clock() as clock:
            instance = Instance(slots=1)
            limit = instance.accounts.limit = ComputeLimit(6)
            memory, waiting = asyncio.Lock(), []

            def reserve(amount: int) -> asyncio.Lock:
                waiting.append(amount)
                return memory

            instance.jobs.dispatcher._reserve = reserve
            instance.engine.clock = clock  # the batch takes a second
            async with memory:
                await instance.submit(make_parts("p", 1))
                while not waiting:
                    await asyncio.sleep(0)
                clock.now += 30.0
            while instance.jobs.open_jobs:
                await asyncio.sleep(0)
            assert limit.state("a").reset == 9  # 10 s for a thread second, of which one has passed
            assert instance.jobs.dispatcher.seconds == 1.0

    asyncio.run(run())


def test_an_unexpected_error_fails_one_batch_and_stops_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def run() -> None:
        async with Instance(slots=1) as instance:
            compute = instance.engine.run
            errors = [RuntimeError("a secret")]

            async def fail_once(task: bytes) -> bytes:
                if errors:
                    raise errors.pop()
                return await compute(task)

            monkeypatch.setattr(instance.engine, "run", fail_once)
            state, _ = await instance.submit(make_parts("p", 4))
            ended = await instance.wait(state.id)
            assert (ended.state, ended.succeeded, ended.failed) == ("failed", 2, 2)
            results = await instance.results(state.id, 0, 10)
            assert [result.state for result in results] == ["failed"] * 2 + ["succeeded"] * 2
            assert results[0].error is not None
            assert [issue.code for issue in results[0].error.issues] == ["internal_error"]
            assert "secret" not in str(results)
            # Asking again computes what has failed.
            await instance.submit(make_parts("p", 4))
            assert (await instance.wait(state.id)).state == "succeeded"

    asyncio.run(run())
