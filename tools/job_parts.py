"""Parts of jobs for benchmarks and faults: many small B-splines, and tasks that compute them."""

import asyncio
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from service.jobs.batch import DONE, Task, read_result
from service.jobs.engine import Engine, EngineUnavailable
from service.pipeline.calls import CallLimits

PART_TIMEOUT = 600.0
"""Seconds of one part."""

PAUSE = 0.5
"""Seconds after which a task is run again that could not be run."""


def make_parts(number: int) -> list[dict[str, Any]]:
    """Parts of a job: bicubic B-splines of 8 × 8 control points as GLB, at resolution 16."""
    heights = random.Random(1)
    return [{"path": "/v1/mesh?format=glb", "body": _make_body(heights)} for _ in range(number)]


def _make_body(heights: random.Random) -> dict[str, Any]:
    net = [[[i, j, heights.random()] for j in range(8)] for i in range(8)]
    surface = {"type": "bspline", "degree": 3, "knots": "clamped", "control_net": net}
    return {"surface": surface, "resolution": 16}


def make_tasks(parts: Sequence[dict[str, Any]], size: int, store: Path) -> list[bytes]:
    """Tasks of `size` parts each, whose files go to a store in a folder."""
    lines = [{"part": part, **line} for part, line in enumerate(parts)]
    return [
        Task(tuple(lines[first : first + size]), str(store), CallLimits(), PART_TIMEOUT).write()
        for first in range(0, len(lines), size)
    ]


async def run_tasks(engine: Engine, tasks: Sequence[bytes]) -> list[dict[str, Any]]:
    """The records of all tasks; the engine always has as many tasks as it runs at one time.

    A task that cannot be run at the moment is run again, as jobs do.

    Raises
    ------
    RuntimeError
        A batch ended early.
    """
    waiting = iter(tasks)
    records: list[dict[str, Any]] = []

    async def run_in_turn() -> None:
        for task in waiting:
            result = read_result(await run_until_done(engine, task))
            if result.end != DONE:
                raise RuntimeError(f"a batch ended with {result.end}")
            records.extend(result.records)

    async with asyncio.TaskGroup() as group:
        for _ in range(engine.slots):
            group.create_task(run_in_turn())
    return records


async def run_until_done(engine: Engine, task: bytes) -> bytes:
    """The result of a task, however often the engine is unavailable."""
    while True:
        try:
            return await engine.run(task)
        except EngineUnavailable:
            await asyncio.sleep(PAUSE)


async def wait_for_slots(engine: Engine, slots: int, store: Path) -> None:
    """Runs a task without parts again and again until the engine has this number of slots."""
    task = Task((), str(store), CallLimits(), PART_TIMEOUT).write()
    while engine.slots < slots:
        await run_until_done(engine, task)
        await asyncio.sleep(PAUSE)
