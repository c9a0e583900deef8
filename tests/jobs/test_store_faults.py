"""Jobs whose store fails in the worst moments, or has lost what was not forced to the disk."""

import asyncio
from collections.abc import Callable
from errno import EIO

import pytest
from obstore.store import MemoryStore

from service.errors import StoreFailed
from service.jobs import dispatch, manager
from service.jobs.keys import (
    INSTANCES,
    INTAKE,
    OWNERS,
    instance_key,
    owner_key,
    results_key,
    state_key,
)
from service.storage.backends import Bucket
from tests.jobs.fakes import Instance, make_parts, until


@pytest.fixture(autouse=True)
def _look_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dispatch, "RETRY_SECONDS", 0.1)
    monkeypatch.setattr(manager, "BEAT_SECONDS", 0.05)
    monkeypatch.setattr(manager, "SAVE_SECONDS", 0.02)


def never(_: str) -> bool:
    return False


class Disk(Bucket):
    """A backend in memory; writing the keys that are chosen fails, and that of others may wait."""

    fails: Callable[[str], bool] = staticmethod(never)
    waits: Callable[[str], bool] = staticmethod(never)
    durable_waits: bool = False
    gate: asyncio.Event

    def set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    async def write(self, key: str, content: bytes, *, durable: bool = True) -> None:
        if self.fails(key):
            raise OSError(EIO, "no")
        if self.waits(key) and durable == self.durable_waits:
            await self.gate.wait()
        await super().write(key, content, durable=durable)


async def list_names(backend: Bucket, prefix: str) -> list[str]:
    return [entry.key async for page in backend.list(prefix) for entry in page]


def test_an_accepted_job_keeps_its_parts_although_its_state_cannot_be_stored() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk) as instance:
            disk.set(fails=lambda key: key.endswith("state.json"))
            state, is_new = await instance.submit(make_parts("p", 2))
            assert is_new
            disk.set(fails=never)
            assert (await instance.wait(state.id)).state == "succeeded"

    asyncio.run(run())


def test_a_job_whose_manifest_cannot_be_stored_leaves_nothing_behind() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk, max_jobs=1) as instance:
            disk.set(fails=lambda key: key.endswith("job.json"))
            with pytest.raises(StoreFailed):
                await instance.submit(make_parts("p", 2))
            assert await list_names(disk, INTAKE) == []
            disk.set(fails=never)
            state, is_new = await instance.submit(make_parts("q", 2))  # is not one too many
            assert is_new
            assert (await instance.wait(state.id)).state == "succeeded"

    asyncio.run(run())


def test_a_request_that_is_cancelled_while_its_job_is_accepted_leaves_a_whole_job() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk) as instance:
            disk.set(gate=asyncio.Event(), waits=lambda key: key.endswith("state.json"))
            request = asyncio.create_task(instance.submit(make_parts("p", 2)))
            await until(lambda: bool(instance.jobs.open_jobs))
            request.cancel()
            await asyncio.sleep(0.01)
            disk.gate.set()
            await asyncio.gather(request, return_exceptions=True)
            (job,) = await instance.jobs.list("a")
            assert (await instance.wait(job.id)).state == "succeeded"

    asyncio.run(run())


def test_a_job_that_is_taken_over_while_the_disk_is_full_goes_on() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk) as first:
            first.engine.gate.clear()
            state, _ = await first.submit(make_parts("p", 2))
        disk.set(fails=lambda key: key.endswith("state.json"))
        async with Instance(disk) as second:
            await until(lambda: bool(second.jobs.open_jobs))
            disk.set(fails=never)
            assert (await second.wait(state.id)).state == "succeeded"

    asyncio.run(run())


def test_a_slow_write_of_a_state_does_not_replace_the_end() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk, slots=1) as instance:
            instance.engine.gate.clear()
            state, _ = await instance.submit(make_parts("p", 1))
            disk.set(gate=asyncio.Event(), waits=lambda key: key.endswith("state.json"))
            await asyncio.sleep(0.1)  # `save` stores the state now
            instance.engine.gate.set()
            await until(lambda: "p0" in instance.engine.names)
            await asyncio.sleep(0.1)
            disk.gate.set()
            await until(lambda: not instance.jobs.open_jobs)
            await asyncio.sleep(0.05)
            assert (await instance.jobs.state(state.id)).state == "succeeded"

    asyncio.run(run())


@pytest.mark.parametrize("content", [b"", b"\0" * 40, b'{"id": "'], ids=["empty", "zeros", "half"])
def test_a_job_and_others_go_on_after_a_power_failure(content: bytes) -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk, slots=1) as first:
            first.engine.stop_after = 1
            state, _ = await first.submit(make_parts("p", 3, seconds=1))
            other, _ = await first.submit(make_parts("q", 1))
            await until(lambda: not first.engine.gate.is_set())
            sign = instance_key((await disk.read(owner_key(state.id))).decode())
            await until(lambda: bool(first.jobs.open_jobs[0].done))
        await disk.write(state_key(state.id), content)
        await disk.write(results_key(state.id, 0), content)
        await disk.write(sign, content)
        await disk.write(owner_key(other.id), content)
        async with Instance(disk) as second:
            assert (await second.jobs.state(state.id)).state == "queued"
            assert {each.id for each in await second.jobs.list("a")} == {state.id, other.id}
            for id in (state.id, other.id):
                assert (await second.wait(id)).state == "succeeded"
            await until(lambda: not second.jobs.open_jobs)
            assert await list_names(disk, OWNERS) == []

    asyncio.run(run())


def test_a_job_whose_parts_are_lost_fails_and_keeps_no_other_waiting() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk, slots=1) as instance:
            instance.engine.gate.clear()
            await instance.submit(make_parts("o", 1))
            state, _ = await instance.submit(make_parts("p", 2, seconds=1))
            folder = instance.jobs.open_jobs[1].manifest.folder
            await disk.delete(f"{INTAKE}/{folder}/000001")
            instance.engine.gate.set()
            end = await instance.wait(state.id)
            assert (end.state, end.succeeded, end.failed) == ("failed", 1, 1)
            assert (await instance.jobs.state(state.id)).waiting_for == ""
            lost = (await instance.results(state.id, 1, 1))[0]
            assert (lost.part, lost.state, lost.name) == (1, "failed", "")

    asyncio.run(run())


def test_instances_stop_in_order_while_a_job_ends() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        instance = Instance(disk)
        async with instance:
            instance.engine.gate.clear()
            for prefix in "pqr":
                await instance.submit(make_parts(prefix, 1))
            disk.set(gate=asyncio.Event(), durable_waits=True)
            disk.set(waits=lambda key: key.endswith("state.json"))
            instance.engine.gate.set()
            await until(lambda: all(each.is_ending for each in instance.jobs.open_jobs))
            assert len(instance.engine.names) == 3
            stopping = asyncio.create_task(instance.stop())
            await asyncio.sleep(0.05)
            disk.gate.set()
            await stopping
        assert instance.jobs.open_jobs == ()
        assert await list_names(disk, INSTANCES) == []

    asyncio.run(run())


def test_parts_that_are_not_accepted_do_not_count_against_the_quota() -> None:
    async def run() -> None:
        instance = Instance(job_quota=1 << 20)
        await instance.jobs.usage.recount()
        async with instance.jobs.start_intake("a") as intake:
            await intake.add(make_parts("p", 20))
            assert instance.jobs.usage.used
        assert instance.jobs.usage.used == 0

    asyncio.run(run())


def test_parts_whose_lines_are_lost_are_listed() -> None:
    async def run() -> None:
        disk = Disk(MemoryStore())
        async with Instance(disk, slots=1) as instance:
            instance.engine.gate.clear()
            state, _ = await instance.submit(make_parts("p", 3, seconds=1))
            folder = instance.jobs.open_jobs[0].manifest.folder
            await disk.delete(f"{INTAKE}/{folder}/000001")
            results = await instance.results(state.id, 0, 9)
            assert [(each.part, each.name) for each in results] == [(0, "p0"), (1, ""), (2, "p2")]

    asyncio.run(run())
