"""Jobs from their acceptance to their end, with a fake engine."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256

import pytest
from obstore.store import MemoryStore

from service.errors import (
    PartCrashed,
    TooLarge,
    TooManyJobs,
    UnknownJob,
    UnknownResult,
)
from service.jobs import intake
from service.jobs.keys import manifest_key, part_key, results_key, state_key
from service.storage.backends import Bucket, reserve_nothing
from service.storage.keys import key_of
from service.storage.store import SurfaceStore
from tests.clock import stop_clock
from tests.jobs.fakes import Instance, make_part, make_parts, until

UNKNOWN = "0" * 64


def test_a_job_runs_and_its_results_can_be_read() -> None:
    async def run() -> None:
        async with Instance() as instance:
            state, is_new = await instance.submit(make_parts("p", 5))
            assert is_new
            assert (state.state, state.total, state.queued + state.running) == ("running", 5, 5)
            end = await instance.wait(state.id)
            assert (end.state, end.succeeded, end.failed, end.queued) == ("succeeded", 5, 0, 0)
            assert end.started is not None
            assert end.ended is not None
            assert (end.expires - end.ended).total_seconds() == 7 * 86400
            results = await instance.results(state.id, 1, 3)
            assert [(each.part, each.name, each.state) for each in results] == [
                (1, "p1", "succeeded"),
                (2, "p2", "succeeded"),
                (3, "p3", "succeeded"),
            ]
            result, content = await instance.content(state.id, 4)
            assert bytes(content) == b"p4"
            assert results[0].result is not None
            assert result.bytes == 2

    asyncio.run(run())


def test_a_part_that_fails_is_named_and_fails_alone() -> None:
    async def run() -> None:
        async with Instance() as instance:
            state, _ = await instance.submit([make_part("p"), make_part("fail"), make_part("q")])
            end = await instance.wait(state.id)
            assert (end.state, end.succeeded, end.failed) == ("failed", 2, 1)
            results = await instance.results(state.id, 0, 10)
            assert [each.state for each in results] == ["succeeded", "failed", "succeeded"]
            assert isinstance(results[1].error, TooLarge)
            with pytest.raises(UnknownResult):
                await instance.content(state.id, 1)

    asyncio.run(run())


def test_a_part_that_kills_its_process_is_named_and_fails_alone() -> None:
    async def run() -> None:
        async with Instance() as instance:
            parts = [make_part("p", 0.1), make_part("crash", 0.1), make_part("q", 0.1)]
            state, _ = await instance.submit(parts)
            end = await instance.wait(state.id)
            assert (end.state, end.succeeded, end.failed) == ("failed", 2, 1)
            results = await instance.results(state.id, 0, 10)
            assert [type(each.error) for each in results] == [type(None), PartCrashed, type(None)]

    asyncio.run(run())


def test_the_same_parts_are_one_job_and_run_once() -> None:
    async def run() -> None:
        async with Instance() as instance:
            first, _ = await instance.submit(make_parts("p", 3))
            again, is_new = await instance.submit(make_parts("p", 3), "b")
            assert (again.id, is_new) == (first.id, False)
            await instance.wait(first.id)
            done, is_new = await instance.submit(make_parts("p", 3))
            assert (done.state, is_new) == ("succeeded", False)
            assert sorted(instance.engine.names) == ["p0", "p1", "p2"]
            other, _ = await instance.submit(make_parts("p", 2))
            assert other.id != first.id
            assert [state.id for state in await instance.jobs.list("b")] == [first.id]
            assert {state.id for state in await instance.jobs.list(None)} == {first.id, other.id}

    asyncio.run(run())


def test_a_failed_job_that_is_asked_for_again_tries_only_the_batch_that_failed() -> None:
    async def run() -> None:
        async with Instance(slots=1) as instance:
            parts = [make_part("p", 1), make_part("fail", 1), make_part("q", 1)]
            state, _ = await instance.submit(parts)
            assert (await instance.wait(state.id)).state == "failed"
            again, is_new = await instance.submit(parts)
            assert (again.state, is_new) == ("running", False)
            assert (again.succeeded, again.failed, again.queued + again.running) == (2, 0, 1)
            assert (await instance.wait(state.id)).state == "failed"
            assert instance.engine.names == ["p", "fail", "q", "fail"]

    asyncio.run(run())


def test_a_job_ends_when_its_last_asker_withdraws_and_resumes_when_asked_again() -> None:
    async def run() -> None:
        async with Instance(slots=1) as instance:
            instance.engine.stop_after = 2
            parts = make_parts("p", 6, seconds=1)
            state, _ = await instance.submit(parts, "a")
            await instance.submit(parts, "b")
            (job,) = instance.jobs.open_jobs
            await until(lambda: len(job.done) == 2)
            await instance.jobs.withdraw(state.id, "a")
            await instance.jobs.withdraw(state.id, "a")
            assert (await instance.jobs.state(state.id)).state == "running"
            assert await instance.jobs.list("a") == []
            await instance.jobs.withdraw(state.id, "b")
            cancelled = await instance.jobs.state(state.id)
            assert cancelled.state == "cancelled"
            async with asyncio.timeout(2):
                while instance.engine.running or instance.jobs.open_jobs:
                    await asyncio.sleep(0.01)
            assert (await instance.jobs.state(state.id)).state == "cancelled"
            results = await instance.results(state.id, 0, 10)
            assert {each.state for each in results} == {"succeeded", "cancelled"}
            assert [each.state for each in await instance.jobs.list("b")] == ["cancelled"]
            instance.engine.gate.set()
            again, is_new = await instance.submit(parts, "a")
            assert not is_new
            assert again.state in ("queued", "running")
            assert (await instance.wait(state.id)).state == "succeeded"
            assert sorted(instance.engine.names) == [f"p{number}" for number in range(6)]

    asyncio.run(run())


def test_unknown_jobs_and_results_are_errors() -> None:
    async def run() -> None:
        async with Instance() as instance:
            jobs = instance.jobs
            for id in (UNKNOWN, "../etc", ""):
                with pytest.raises(UnknownJob):
                    await jobs.state(id)
                with pytest.raises(UnknownJob):
                    await jobs.withdraw(id, "a")
            instance.engine.gate.clear()
            state, _ = await instance.submit(make_parts("p", 1))
            with pytest.raises(UnknownJob):
                await jobs.results(replace(state, id=UNKNOWN), 0, 10)
            with pytest.raises(UnknownResult):
                await instance.content(state.id, 0)
            assert await jobs.results(state, 1, 10) == []


def test_the_file_of_a_part_takes_one_reading_of_each_object() -> None:
    keys: list[str] = []

    class Recorder(Bucket):
        """A backend that remembers what is read."""

        async def read(self, key: str, reserve: Callable[[int], None] = reserve_nothing) -> bytes:
            keys.append(key)
            return await super().read(key, reserve)

    async def run() -> None:
        async with Instance(Recorder(MemoryStore())) as instance:
            parts = make_parts("p", 2)
            state, _ = await instance.submit(parts)
            await instance.wait(state.id)
            await until(lambda: not instance.jobs.open_jobs)
            keys.clear()
            await instance.content(state.id, 1)
            about_job = [state_key(state.id), manifest_key(state.id), results_key(state.id, 0)]
            assert keys == [*about_job, part_key(parts[1].id)]

    asyncio.run(run())

    asyncio.run(run())


def test_a_damaged_result_is_made_again_when_the_job_is_asked_for_again() -> None:
    async def run() -> None:
        async with Instance() as instance:
            parts = make_parts("p", 3, seconds=1)
            state, _ = await instance.submit(parts)
            await instance.wait(state.id)
            await instance.backend.write(part_key(parts[1].id), b"{}\nother")
            with pytest.raises(UnknownResult, match="damaged"):
                await instance.content(state.id, 1)
            await instance.submit(parts)
            assert (await instance.wait(state.id)).state == "succeeded"
            assert bytes((await instance.content(state.id, 1))[1]) == b"p1"
            assert sorted(instance.engine.names) == ["p0", "p1", "p1", "p2"]

    asyncio.run(run())


def test_the_open_jobs_of_a_caller_are_limited() -> None:
    async def run() -> None:
        async with Instance(max_jobs=2) as instance:
            instance.engine.gate.clear()
            first, _ = await instance.submit(make_parts("p", 1))
            await instance.submit(make_parts("q", 1))
            with pytest.raises(TooManyJobs):
                await instance.submit(make_parts("r", 1))
            await instance.submit(make_parts("r", 1), "b")
            instance.engine.gate.set()
            await instance.wait(first.id)
            await instance.submit(make_parts("s", 1))

    asyncio.run(run())


def test_jobs_that_are_sent_at_the_same_time_are_counted_too() -> None:
    async def run() -> None:
        async with Instance(max_jobs=2) as instance:
            instance.engine.gate.clear()
            sending = (instance.submit(make_parts(f"p{number}-", 1)) for number in range(5))
            results = await asyncio.gather(*sending, return_exceptions=True)
            assert sum(isinstance(result, TooManyJobs) for result in results) == 3
            assert len(instance.jobs.open_jobs) == 2
            keys = [entry.key async for page in instance.backend.list("intake") for entry in page]
            assert len(keys) == 2

    asyncio.run(run())


def test_an_intake_that_is_left_keeps_nothing() -> None:
    async def run() -> None:
        instance = Instance(max_job_parts=3)
        async with instance.jobs.start_intake("a") as intake:
            await intake.add(make_parts("p", 3, seconds=1))
        with pytest.raises(TooLarge):
            await instance.submit(make_parts("p", 4))
        assert [page async for page in instance.backend.list("intake")] == []

    asyncio.run(run())


def test_callers_take_turns() -> None:
    async def run() -> None:
        with stop_clock() as clock:
            instance = Instance(slots=1)
            instance.engine.clock = clock
            instance.engine.gate.clear()
            for caller in "abc":
                for job in range(3):
                    parts = make_parts(f"{caller}{job}-", 3, seconds=1)
                    await instance.submit(parts, caller)
            instance.engine.gate.set()
            while instance.jobs.open_jobs:
                await asyncio.sleep(0)
            names = instance.engine.names
        assert len(names) == 27
        # Callers take turns, and the jobs of one caller run one after the other.
        for first in range(0, 27, 3):
            assert {name[0] for name in names[first : first + 3]} == {*"abc"}
        for caller in "abc":
            own = [name for name in names if name[0] == caller]
            assert own == sorted(own)

    asyncio.run(run())


def test_watching_shows_changes_and_ends_with_the_job() -> None:
    async def run() -> None:
        async with Instance(slots=1) as instance:
            instance.engine.gate.clear()
            job, _ = await instance.submit(make_parts("p", 2, seconds=1))
            seen = []
            async for state in instance.jobs.watch(job.id):
                instance.engine.gate.set()
                seen.append(state.state)
            assert seen == ["running", "succeeded"]

    asyncio.run(run())


def test_surfaces_that_only_this_process_can_read_are_copied_for_the_others() -> None:
    async def run() -> None:
        surfaces = SurfaceStore(Bucket(MemoryStore()), 0)
        content = b"a surface"
        id = sha256(content).hexdigest()
        await surfaces.put(id, content)
        parts = [
            make_part("p", path=f"/v1/surfaces/{surface}/mesh.glb?resolution=2")
            for surface in (id, UNKNOWN, "saddle")
        ]
        async with Instance() as instance:
            instance.jobs.dispatcher.surfaces = surfaces
            state, _ = await instance.submit(parts)
            assert (await instance.wait(state.id)).state == "succeeded"
            assert await instance.backend.read(key_of(id)) == content
            keys = [entry.key async for page in instance.backend.list("surfaces") for entry in page]
            assert keys == [key_of(id)]

    asyncio.run(run())


def test_batches_grow_in_large_jobs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(intake, "GROWTH", 2)

    async def run() -> None:
        async with Instance() as instance:
            instance.engine.gate.clear()
            await instance.submit(make_parts("p", 20))
            (job,) = instance.jobs.open_jobs
            assert [batch.parts for batch in job.manifest.batches] == [2, 2, 4, 4, 6, 2]
            instance.engine.gate.set()
            assert (await instance.wait(job.id)).succeeded == 20

    asyncio.run(run())
