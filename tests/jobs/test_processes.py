"""Jobs in a folder, computed by job processes: what they do when processes are killed."""

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, nullcontext
from hashlib import sha256
from pathlib import Path
from typing import Any, NoReturn

import orjson
import pytest

from service.errors import UnknownSurface
from service.fair.accounts import Accounts
from service.jobs.checks import CheckedPart, check_part
from service.jobs.limits import part_limits
from service.jobs.manager import Jobs
from service.jobs.parts import read_part
from service.jobs.pool import ProcessEngine
from service.jobs.state import JobState
from service.settings.values import Settings
from service.storage.address import open_store


def check(document: dict[str, Any]) -> CheckedPart:
    return check_part(document, part_limits(Settings()), find_none)


def find_none(_: str) -> NoReturn:
    raise UnknownSurface


def make_parts(count: int, seconds: float = 0.1) -> list[CheckedPart]:
    """Meshes of different patches, in batches of 1 / `seconds` parts."""
    parts = []
    for number in range(count):
        net = [[[i, j, (i * j) % 7 + number / 7] for j in range(8)] for i in range(8)]
        surface = {"type": "bspline", "degree": 3, "knots": "clamped", "control_net": net}
        body = {"surface": surface, "resolution": 8 + number % 7}
        part = check({"path": "/v1/mesh?format=glb", "body": body})
        parts.append(CheckedPart(part.id, part.line, seconds, part.memory))
    return parts


@asynccontextmanager
async def run_jobs(folder: Path, processes: int = 2) -> AsyncIterator[tuple[Jobs, ProcessEngine]]:
    address = str(folder)
    engine = ProcessEngine(processes, 1 << 28)
    jobs = Jobs(
        address,
        open_store(address, 0).backend,
        Settings(),
        engine,
        accounts=Accounts(),
        reserve=lambda _: nullcontext(),
    )
    running = asyncio.create_task(jobs.run())
    try:
        yield jobs, engine
    finally:
        running.cancel()
        await asyncio.wait({running})


async def submit(jobs: Jobs, parts: list[CheckedPart]) -> JobState:
    async with jobs.start_intake("a") as intake:
        await intake.add(parts)
        return (await intake.finish())[0]


async def wait(jobs: Jobs, id: str) -> JobState:
    async with asyncio.timeout(60):
        return [state async for state in jobs.watch(id)][-1]


async def digests(jobs: Jobs, id: str) -> list[str]:
    state = await jobs.state(id)
    parts = await jobs.results(state, 0, state.total)
    return [sha256((await jobs.content(id, part))[1]).hexdigest() for part in parts if part.result]


def compute(part: CheckedPart) -> str:
    """The hash of the file of a part, computed in this process."""
    line = orjson.loads(part.line)
    plan = read_part(line["path"], line["body"], part_limits(Settings())).plan
    return sha256(bytes(plan(find_none).run().content)).hexdigest()


@pytest.mark.slow
def test_a_killed_process_costs_its_batch_and_all_parts_are_as_if_it_lived(tmp_path: Path) -> None:
    parts = make_parts(40)

    async def run() -> list[str]:
        async with run_jobs(tmp_path) as (jobs, engine):
            id = (await submit(jobs, parts)).id
            async with asyncio.timeout(60):
                while not engine.processes:
                    await asyncio.sleep(0.01)
            os.kill(engine.processes[0], signal.SIGKILL)
            assert (await wait(jobs, id)).state == "succeeded"
            return await digests(jobs, id)

    assert asyncio.run(run()) == [compute(part) for part in parts]


@pytest.mark.slow
def test_cancelling_leaves_nothing_running_after_2_s(tmp_path: Path) -> None:
    # A mesh that takes half a minute.
    net = [[[i, j, ((i * 7 + j * 13) % 11) / 5] for j in range(40)] for i in range(40)]
    surface = {"type": "bspline", "degree": 3, "knots": "clamped", "control_net": net}
    body = {"surface": surface, "tolerance": 1e-4}
    part = check({"path": "/v1/mesh?format=glb", "body": body})

    async def run() -> None:
        async with run_jobs(tmp_path, processes=1) as (jobs, engine):
            id = (await submit(jobs, [part])).id
            async with asyncio.timeout(60):
                while not engine.processes:
                    await asyncio.sleep(0.01)
            await asyncio.sleep(0.3)
            assert (await jobs.state(id)).running == 1
            await jobs.withdraw(id, "a")
            async with asyncio.timeout(2):
                while jobs.dispatcher.busy_count:
                    await asyncio.sleep(0.01)
            assert (await jobs.state(id)).state == "cancelled"

    asyncio.run(run())
