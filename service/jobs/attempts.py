"""Runs a task until each of its parts has a record, whatever happens to the engine's processes.

If a process dies twice with a batch, the parts are run one by one; a part that kills its process
twice is to blame, and fails alone, with the error `PartCrashed`.
"""

import asyncio
from dataclasses import replace
from typing import Any

from service.cancellation import OutOfTime
from service.errors import Issue, PartCrashed, SurfaceError
from service.jobs.batch import DONE, FAILED, BatchResult, Task, read_result
from service.jobs.engine import Engine, EngineLost
from service.jobs.outputs import Line
from service.jobs.results import write_error

ATTEMPTS = 2
"""How often a batch, and then a part of it, is run while its process dies."""

GRACE = 30.0
"""Seconds after the timeout of a part after which its process is ended: parts end by themselves at
their next checkpoint, and this is for those that reach none."""


async def run_task(engine: Engine, task: Task) -> BatchResult:
    """The result of a task; a part that kills its process has a record too.

    Raises
    ------
    EngineUnavailable
    """
    for _ in range(ATTEMPTS):
        try:
            async with asyncio.timeout(task.timeout + GRACE):
                return read_result(await engine.run(task.write()))
        except EngineLost:
            continue
        except TimeoutError:
            if len(task.lines) == 1:
                return BatchResult((failed_record(task.lines[0], OutOfTime()),))
            break
    if len(task.lines) == 1:
        message = "The process that computed the part has died each time that it was tried."
        error = PartCrashed(Issue("part_crashed", message))
        return BatchResult((failed_record(task.lines[0], error),))
    return await run_one_by_one(engine, task)


async def run_one_by_one(engine: Engine, task: Task) -> BatchResult:
    """The result of a task, with a task of its own for each part."""
    records: list[dict[str, Any]] = []
    for line in task.lines:
        result = await run_task(engine, replace(task, lines=(line,)))
        records += result.records
        if result.end != DONE:
            return BatchResult(tuple(records), result.end)
    return BatchResult(tuple(records))


def failed_record(line: Line, error: SurfaceError) -> dict[str, Any]:
    """The record of a part that has failed outside its process."""
    about = {"part": line["part"], "id": line.get("id", ""), "state": FAILED, "seconds": 0.0}
    return {**about, "error": write_error(error)}
