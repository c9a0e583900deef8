"""Jobs, results and unfinished intakes are deleted when they have expired."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from obstore.store import MemoryStore

from service.errors import UnknownJob
from service.jobs.expiry import UNFINISHED_SECONDS, delete_expired
from service.jobs.files import JobFiles
from service.jobs.keys import CALLERS, INTAKE, JOBS, PARTS, state_key
from service.jobs.state import decode_state
from service.storage.backends import Backend, Bucket, Entry
from tests.jobs.fakes import Instance, make_parts

DAY = 86400.0


class Aged(Bucket):
    """A backend whose objects are all older than they are."""

    age: float = 0.0

    def grow_older(self, seconds: float) -> None:
        object.__setattr__(self, "age", seconds)

    async def list(self, prefix: str, after: str = "") -> AsyncIterator[list[Entry]]:
        async for page in super().list(prefix, after):
            yield [entry._replace(modified=entry.modified - self.age) for entry in page]


async def list_names(backend: Bucket) -> set[str]:
    """The first parts of all keys."""
    names = set()
    for prefix in (JOBS, INTAKE, PARTS, CALLERS):
        async for _ in backend.list(prefix):
            names.add(prefix)
    return names


async def expire(backend: Backend, id: str, seconds: float) -> None:
    """Lets a job end `seconds` earlier."""
    state = decode_state(await backend.read(state_key(id)))
    assert state is not None
    assert state.ended is not None
    back = timedelta(seconds=seconds)
    earlier = replace(state, ended=state.ended - back, expires=state.expires - back)
    await backend.write(state_key(id), earlier.encode())


def test_a_job_expires_after_its_lifetime_and_its_parts_after_two() -> None:
    async def run() -> None:
        backend = Aged(MemoryStore())
        files = JobFiles(backend)
        async with Instance(backend) as instance:
            state, _ = await instance.submit(make_parts("p", 3))
            await instance.wait(state.id)
            everything = await list_names(backend)
            assert everything == {JOBS, INTAKE, PARTS, CALLERS}
            await delete_expired(files, 7 * DAY)
            assert await list_names(backend) == everything
            await expire(backend, state.id, 7 * DAY + 10)
            with pytest.raises(UnknownJob):
                await instance.jobs.state(state.id)
            assert await instance.jobs.list("a") == []
            await delete_expired(files, 7 * DAY)
            assert await list_names(backend) == everything  # a request may just be running
            await expire(backend, state.id, 3700)
            backend.grow_older(7 * DAY + 3700)
            await delete_expired(files, 7 * DAY)
            assert await list_names(backend) == {PARTS}
            backend.grow_older(14 * DAY + 1)
            await delete_expired(files, 7 * DAY)
            assert await list_names(backend) == set()

    asyncio.run(run())


def test_jobs_that_have_not_ended_do_not_expire_and_unfinished_intakes_do() -> None:
    async def run() -> None:
        backend = Aged(MemoryStore())
        files = JobFiles(backend)
        async with Instance(backend) as instance:
            instance.engine.gate.clear()
            state, _ = await instance.submit(make_parts("p", 3))
            intake = instance.jobs.start_intake("a")
            await intake.__aenter__()
            await intake.add(make_parts("q", 3, seconds=1))
            assert len(await files.names(INTAKE)) > 2
            number = len(await files.names(INTAKE))
            backend.grow_older(UNFINISHED_SECONDS - 10)
            await delete_expired(files, DAY / 10)
            assert len(await files.names(INTAKE)) == number
            backend.grow_older(UNFINISHED_SECONDS + 10)
            await delete_expired(files, DAY / 10)
            assert len(await files.names(INTAKE)) == number - 2
            assert (await instance.jobs.state(state.id)).id == state.id
            assert [job.id for job in await instance.jobs.list("a")] == [state.id]

    asyncio.run(run())


def test_a_job_that_is_asked_for_again_late_lives_longer() -> None:
    async def run() -> None:
        async with Instance() as instance:
            parts = make_parts("p", 2)
            state, _ = await instance.submit(parts)
            await instance.wait(state.id)
            await expire(instance.backend, state.id, 3 * DAY)
            soon, _ = await instance.submit(parts)
            assert soon.state == "succeeded"
            await expire(instance.backend, state.id, DAY)
            late, _ = await instance.submit(parts)
            assert late.state == "running"  # so that its parts are written again
            end = await instance.wait(state.id)
            assert end.expires > datetime.now(UTC) + timedelta(days=6.9)

    asyncio.run(run())
