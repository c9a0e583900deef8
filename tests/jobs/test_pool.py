"""Job processes: they compute, die, are replaced, and end with their parent."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from service.jobs import pool
from service.jobs.engine import EngineLost
from service.jobs.pool import ProcessEngine
from tools.processes import ROOT

PATIENCE = 30.0


def work(task: bytes) -> bytes:
    """What the processes of these tests do in place of `run_batch`."""
    match task.split():
        case [b"die"]:
            os._exit(1)
        case [b"sleep", seconds]:
            time.sleep(float(seconds))
    return b"%d %d" % (os.getpid(), os.nice(0))


@asynccontextmanager
async def open_engine(processes: int = 1) -> AsyncIterator[ProcessEngine]:
    engine = ProcessEngine(processes, 1 << 28, niceness=3)
    try:
        yield engine
    finally:
        await engine.close()


def is_alive(pid: int) -> bool:
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    except OSError:
        return False


def wait_for_end(pids: list[int], seconds: float) -> None:
    end = time.monotonic() + seconds
    while any(map(is_alive, pids)):
        assert time.monotonic() < end, "a job process has not ended"
        time.sleep(0.02)


def test_processes_compute_with_low_priority_and_a_dead_one_costs_its_task_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pool, "run_batch", work)

    async def run() -> None:
        async with open_engine(2) as engine:
            assert engine.processes == []  # they start with the first task
            sleeping = asyncio.create_task(engine.run(b"sleep 1.5"))
            with pytest.raises(EngineLost):
                await engine.run(b"die")
            pid, niceness = (await engine.run(b"")).split()
            assert int(pid) in engine.processes
            assert int(niceness) == os.nice(0) + 3
            other, _ = (await sleeping).split()
            assert other != pid
            assert len(engine.processes) == 2
            pids = engine.processes
        wait_for_end(pids, 3)

    asyncio.run(run())


def test_a_task_that_is_cancelled_ends_with_its_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool, "run_batch", work)

    async def run() -> None:
        async with open_engine() as engine:
            await engine.run(b"")
            pids = engine.processes
            sleeping = asyncio.create_task(engine.run(b"sleep 60"))
            await asyncio.sleep(0.1)
            sleeping.cancel()
            with suppress(asyncio.CancelledError):
                await sleeping
            assert not is_alive(pids[0])
            await engine.run(b"")

    asyncio.run(run())


def test_processes_without_work_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool, "run_batch", work)
    monkeypatch.setattr(pool, "IDLE_SECONDS", 0.1)

    async def run() -> None:
        async with open_engine() as engine:
            pid, _ = (await engine.run(b"")).split()
            await asyncio.sleep(0.2)
            assert engine.processes == []
            await asyncio.to_thread(wait_for_end, [int(pid)], PATIENCE)

    asyncio.run(run())


PARENT = """
import asyncio
from service.jobs import pool
from tests.jobs.test_pool import work

async def main():
    pool.run_batch = work
    engine = pool.ProcessEngine(2, 1 << 28)
    await asyncio.gather(engine.run(b""), engine.run(b""))
    print(*engine.processes, flush=True)
    await engine.run(b"sleep 60")

if __name__ == "__main__":
    asyncio.run(main())
"""


def test_processes_end_within_3_s_of_the_death_of_their_parent(tmp_path: Path) -> None:
    program = tmp_path / "parent.py"
    program.write_text(PARENT, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, str(program)], stdout=subprocess.PIPE, env=environment
    ) as parent:
        assert parent.stdout is not None
        pids = [int(pid) for pid in parent.stdout.readline().split()]
        assert len(pids) == 2
        assert all(map(is_alive, pids))
        parent.send_signal(signal.SIGKILL)
    wait_for_end(pids, 3)
