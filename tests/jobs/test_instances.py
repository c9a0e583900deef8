"""Several instances that share one store: taking over, joining and withdrawing across instances."""

import asyncio
from unittest.mock import patch

import pytest

from service.jobs import manager, owners
from service.jobs.batch import CANCELLED
from service.jobs.keys import JOBS, OWNERS
from tests.jobs.fakes import Instance, make_part, make_parts, until


@pytest.fixture(autouse=True)
def _look_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(manager, "BEAT_SECONDS", 0.02)
    monkeypatch.setattr(manager, "SAVE_SECONDS", 0.02)


def test_another_instance_goes_on_with_the_jobs_of_one_that_stops() -> None:
    async def run() -> None:
        async with Instance(slots=1) as first:
            first.engine.stop_after = 2
            state, _ = await first.submit(make_parts("p", 4, seconds=1))
            (job,) = first.jobs.open_jobs
            await until(lambda: len(job.done) == 2)
            async with Instance(first.backend, slots=1) as second:
                await asyncio.sleep(0.1)
                assert second.engine.names == []  # the first one lives
                await first.stop()
                end = await second.wait(state.id)
                assert (end.state, end.succeeded) == ("succeeded", 4)
                assert end.started is not None
                names = first.engine.names + second.engine.names
                assert set(names) == {"p0", "p1", "p2", "p3"}
                assert len(second.engine.names) == 2  # the records of the others are there
                await until(lambda: not second.jobs.open_jobs)
                assert [page async for page in first.backend.list(OWNERS)] == []

    asyncio.run(run())


def test_an_instance_that_stands_still_loses_its_jobs_and_drops_them_when_it_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(owners, "GONE_AFTER", 0.1)

    async def run() -> None:
        first = Instance(slots=1)  # accepts, but does not give signs of life again
        first.engine.gate.clear()
        state, _ = await first.submit(make_parts("p", 2, seconds=1))
        async with Instance(first.backend, slots=1) as second:
            second.engine.gate.clear()
            await until(lambda: second.engine.running > 0)
            assert len(first.jobs.open_jobs) == 1
            async with first:
                await until(lambda: not first.jobs.open_jobs)
                first.engine.gate.set()
                second.engine.gate.set()
                assert (await first.wait(state.id)).state == "succeeded"
                assert len(second.engine.names) == 2
                assert len(first.engine.names) == 1  # the batch that ran when it lost the job

    asyncio.run(run())


def test_the_state_of_a_job_is_the_same_in_all_instances() -> None:
    async def run() -> None:
        async with Instance(slots=1) as first, Instance(first.backend) as second:
            first.engine.gate.clear()
            state, _ = await first.submit([make_part("p", 1), make_part("fail", 1)])
            other = await second.jobs.state(state.id)
            assert (other.state, other.total) == ("queued", 2)
            first.engine.gate.set()
            end = await first.wait(state.id)
            await until(lambda: not first.jobs.open_jobs)
            assert await second.jobs.state(state.id) == end
            assert end.state == "failed"
            seen = [repr(await each.results(state.id, 0, 9)) for each in (first, second)]
            assert seen[0] == seen[1]
            assert bytes((await second.content(state.id, 0))[1]) == b"p"

    asyncio.run(run())


def test_an_instance_that_has_just_started_takes_no_job_from_another() -> None:
    async def run() -> None:
        async with Instance(slots=1) as first:
            first.engine.gate.clear()
            parts = make_parts("p", 3, seconds=1)
            state, _ = await first.submit(parts, "a")
            second = Instance(first.backend)  # has not looked at the signs of life yet
            assert (await second.submit(parts, "b"))[1] is False
            assert not second.jobs.open_jobs
            first.engine.gate.set()
            assert (await first.wait(state.id)).succeeded == 3
            assert not second.engine.names

    asyncio.run(run())


def test_callers_of_another_instance_join_and_withdraw() -> None:
    async def run() -> None:
        async with Instance(slots=1) as first, Instance(first.backend) as second:
            first.engine.gate.clear()
            parts = make_parts("p", 3, seconds=1)
            state, _ = await first.submit(parts, "a")
            joined, is_new = await second.submit(parts, "b")
            assert (joined.id, is_new) == (state.id, False)
            await second.jobs.withdraw(state.id, "a")
            await asyncio.sleep(0.1)
            assert (await first.jobs.state(state.id)).state == "running"
            await second.jobs.withdraw(state.id, "b")
            assert (await second.jobs.state(state.id)).state == "cancelled"
            async with asyncio.timeout(2):
                while first.engine.running or first.jobs.open_jobs:
                    await asyncio.sleep(0.01)
            assert (await first.jobs.state(state.id)).state == "cancelled"
            assert second.engine.names == []
            # A caller that asks again, at another instance, gets the missing parts.
            await second.submit(parts, "b")
            assert (await second.wait(state.id)).state == "succeeded"
            assert (await first.jobs.state(state.id)).state == "succeeded"

    asyncio.run(run())


def test_a_job_that_waits_is_cancelled_in_all_instances_at_once() -> None:
    async def run() -> None:
        async with Instance(slots=1) as first, Instance(first.backend) as second:
            first.engine.gate.clear()
            await first.submit(make_parts("p", 1))
            waiting, _ = await first.submit(make_parts("q", 1))
            await second.jobs.withdraw(waiting.id, "a")
            for instance in (second, first):
                assert (await instance.jobs.state(waiting.id)).state == "cancelled"
            await until(lambda: len(first.jobs.open_jobs) == 1)

    asyncio.run(run())


def test_a_job_that_was_not_accepted_leaves_no_owner() -> None:
    async def run() -> None:
        instance = Instance()
        await instance.backend.write(f"{OWNERS}/{'a' * 64}", b"gone")
        await instance.backend.write(f"{JOBS}/{'a' * 64}/askers/{'b' * 64}", b"")
        async with instance:
            async with asyncio.timeout(5):
                while [page async for page in instance.backend.list(OWNERS)]:
                    await asyncio.sleep(0.01)
        assert instance.jobs.open_jobs == ()

    asyncio.run(run())


def test_a_batch_that_sees_the_cancellation_first_does_not_run_again() -> None:
    async def run() -> None:
        with patch.object(manager, "SAVE_SECONDS", 100.0):
            async with Instance(slots=1) as first, Instance(first.backend) as second:
                first.engine.gate.clear()
                state, _ = await first.submit(make_parts("p", 2, seconds=1), "a")
                await second.jobs.withdraw(state.id, "a")
                first.engine.ends.append(CANCELLED)
                first.engine.gate.set()
                await until(lambda: not first.jobs.open_jobs)
                assert first.engine.names == []
                assert (await first.jobs.state(state.id)).state == "cancelled"

    asyncio.run(run())
