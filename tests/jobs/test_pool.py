"""Job processes: they compute, die, are replaced, and end with their parent."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from service.jobs import pool
from service.jobs.engine import EngineLost
from service.jobs.pool import ProcessEngine
from tests.jobs.fakes import until
from tests.jobs.pool_work import work
from tools.processes import ROOT

PATIENCE = 30.0


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


@pytest.mark.slow
def test_a_process_that_dies_or_is_cancelled_is_replaced_and_ends_without_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pool, "run_batch", work)

    async def run() -> None:
        engine = ProcessEngine(1, 1 << 28, niceness=3)
        assert engine.processes == []  # they start with the first task
        first, niceness = (await engine.run(b"")).split()
        assert engine.processes == [int(first)]
        assert int(niceness) == os.nice(0) + 3
        with pytest.raises(EngineLost):
            await engine.run(b"die")
        assert not is_alive(int(first))
        sleeping = asyncio.create_task(engine.run(b"sleep 60"))
        await until(lambda: engine.processes != [])
        second = engine.processes[0]
        sleeping.cancel()
        with suppress(asyncio.CancelledError):
            await sleeping
        assert not is_alive(second)
        monkeypatch.setattr(pool, "IDLE_SECONDS", 0.05)
        third, _ = (await engine.run(b"")).split()
        await until(lambda: engine.processes == [])
        await asyncio.to_thread(wait_for_end, [int(third)], PATIENCE)
        await engine.close()

    asyncio.run(run())


def test_a_task_that_is_cancelled_while_its_process_starts_leaves_no_process_that_cannot_be_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pool, "run_batch", work)

    async def run() -> None:
        engine = ProcessEngine(1, 1 << 28)
        starting = asyncio.create_task(engine.run(b""))
        await asyncio.sleep(0.01)
        assert engine.processes == []
        starting.cancel()
        with suppress(asyncio.CancelledError):
            await starting
        sleeping = asyncio.create_task(engine.run(b"sleep 60"))
        await until(lambda: engine.processes != [])
        await engine.close()
        with pytest.raises(EngineLost):
            await sleeping

    asyncio.run(run())


PARENT = """
import asyncio
from service.jobs import pool
from tests.jobs.pool_work import work

async def main():
    pool.run_batch = work
    engine = pool.ProcessEngine(1, 1 << 28)
    await engine.run(b"")
    print(*engine.processes, flush=True)
    await engine.run(b"sleep 60")

if __name__ == "__main__":
    asyncio.run(main())
"""


@pytest.mark.slow
def test_processes_end_within_3_s_of_the_death_of_their_parent(tmp_path: Path) -> None:
    program = tmp_path / "parent.py"
    program.write_text(PARENT, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, str(program)], stdout=subprocess.PIPE, env=environment
    ) as parent:
        assert parent.stdout is not None
        pids = [int(pid) for pid in parent.stdout.readline().split()]
        assert len(pids) == 1
        assert all(map(is_alive, pids))
        parent.send_signal(signal.SIGKILL)
    wait_for_end(pids, 3)
