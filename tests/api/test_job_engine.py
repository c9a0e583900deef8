"""The jobs of an application: their engine, their place, the memory that batches reserve."""

import asyncio
from pathlib import Path

import pytest

from service.api.app import create_app
from service.api.caching.cache import ResponseCache
from service.api.job_engine import JobMemory, open_engine
from service.api.threads import Threads, Turn
from service.jobs.dask_engine import DaskEngine
from service.jobs.pool import ProcessEngine
from service.settings.values import Settings
from service.settings.workers import share_settings


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("address", "engine_type", "reserved"),
    [("", ProcessEngine, 1000), ("tcp://127.0.0.1:8786", DaskEngine, 0)],
)
async def test_batches_on_a_cluster_reserve_no_memory_of_this_machine(
    address: str, engine_type: type, reserved: int
) -> None:
    settings = Settings(dask=address, store="/surfaces")
    threads = Threads(settings, ResponseCache(0))
    engine, reserve = open_engine(settings, JobMemory(threads))
    assert type(engine) is engine_type
    async with reserve(1000):
        assert threads.used_bytes == reserved
    assert threads.used_bytes == 0


def make_threads(memory: int) -> Threads:
    return Threads(Settings(memory_bytes=memory), ResponseCache(0))


def test_batches_hold_at_most_half_of_the_memory() -> None:
    async def run() -> None:
        threads = make_threads(64 << 20)
        memory = JobMemory(threads)
        assert memory.capacity == 32 << 20
        async with memory.reserve(20 << 20):
            assert threads.used_bytes == 20 << 20
            second = asyncio.create_task(memory.reserve(20 << 20).__aenter__())
            await asyncio.sleep(0.1)
            assert not second.done()
        await second
        assert threads.used_bytes == 20 << 20

    asyncio.run(run())


def test_a_batch_waits_for_memory_that_requests_hold_and_takes_no_more_than_there_is() -> None:
    async def run() -> None:
        threads = make_threads(64 << 20)
        memory = JobMemory(threads)
        threads.hold(40 << 20)
        waiting = asyncio.create_task(memory.reserve(1 << 40).__aenter__())
        await asyncio.sleep(0.1)
        assert not waiting.done()
        threads.hold(-(40 << 20))
        await waiting
        assert threads.used_bytes == memory.capacity

    asyncio.run(run())


def test_a_large_batch_is_not_passed_by_small_ones_for_ever() -> None:
    async def run() -> None:
        memory = JobMemory(make_threads(64 << 20))
        started: list[str] = []

        async def reserve(name: str, amount: int) -> None:
            async with memory.reserve(amount):
                started.append(name)
                await asyncio.sleep(0.06)

        small = [asyncio.create_task(reserve("small", 8 << 20)) for _ in range(3)]
        await asyncio.sleep(0)
        large = asyncio.create_task(reserve("large", 32 << 20))
        await asyncio.sleep(0)
        small += [asyncio.create_task(reserve("later", 8 << 20)) for _ in range(3)]
        await asyncio.gather(large, *small)
        assert started == ["small"] * 3 + ["large"] + ["later"] * 3

    asyncio.run(run())


def test_batches_do_not_keep_memory_from_a_request_that_claims_it() -> None:
    async def run() -> None:
        threads = make_threads(64 << 20)
        memory = JobMemory(threads)
        threads.hold(30 << 20)  # of a request that runs
        claiming = Turn("a", 40 << 20)
        request = asyncio.create_task(threads.acquire(claiming, "mesh"))
        await asyncio.sleep(0)
        batch = asyncio.create_task(memory.reserve(24 << 20).__aenter__())
        small_batch = asyncio.create_task(JobMemory(threads).reserve(8 << 20).__aenter__())
        await small_batch  # leaves enough for the claim
        await asyncio.sleep(0.1)
        assert not batch.done()
        threads.hold(-(30 << 20))
        await request
        assert not batch.done()
        threads.release_thread(claiming)
        threads.give_back(claiming)
        await batch

    asyncio.run(run())


def test_jobs_of_a_store_in_memory_are_in_a_folder_that_ends_with_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    app = create_app(Settings())
    assert len(list(tmp_path.iterdir())) == 1

    async def run() -> None:
        async with app.router.lifespan_context(app):
            await asyncio.sleep(0)  # the work in the background begins
            assert len(list(tmp_path.iterdir())) == 1

    asyncio.run(run())
    assert list(tmp_path.iterdir()) == []


def test_jobs_can_be_switched_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert create_app(Settings(jobs=False)).state.services.jobs is None
    assert list(tmp_path.iterdir()) == []


def test_workers_share_the_job_processes() -> None:
    settings = Settings(job_processes=5, memory_bytes=1 << 32)
    assert [share_settings(settings, count).job_process_count for count in (1, 2, 8)] == [5, 2, 1]
    assert Settings(memory_bytes=256 << 20).job_process_count == 1  # a container of 512 MiB
