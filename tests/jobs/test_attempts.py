"""Tasks whose processes die or hang: run again, then part by part; the part at fault is named."""

import asyncio
from collections.abc import Callable
from dataclasses import asdict

import pytest

from service.cancellation import OutOfTime
from service.errors import PartCrashed
from service.jobs import attempts
from service.jobs.attempts import run_task
from service.jobs.batch import DONE, SUCCEEDED, BatchResult, Task, read_task
from service.jobs.engine import EngineLost
from service.jobs.records import read_lines, read_record, write_records
from service.jobs.results import Result
from service.pipeline.calls import CallLimits

RESULT = Result("text/plain", "txt", "", 1, "0" * 64)


class Engine:
    """Runs tasks by a function of the parts' names and of how often these names were run before."""

    slots = 1

    def __init__(self, fails: Callable[[list[str], int], bool], hangs: str = "") -> None:
        self._fails, self._hangs = fails, hangs
        self.tasks: list[list[str]] = []

    async def run(self, task: bytes) -> bytes:
        lines = read_task(task).lines
        names = [line["name"] for line in lines]
        before = self.tasks.count(names)
        self.tasks.append(names)
        if self._hangs in names:
            await asyncio.Event().wait()
        if self._fails(names, before):
            raise EngineLost
        records = ({"part": x["part"], "id": x["id"], "state": SUCCEEDED} for x in lines)
        return BatchResult(tuple(record | asdict(RESULT) for record in records)).write()

    async def close(self) -> None: ...


def make_task(names: str, timeout: float = 100.0) -> Task:
    lines = tuple({"part": k, "id": f"id-{name}", "name": name} for k, name in enumerate(names))
    return Task(lines, "store", CallLimits(), timeout)


def failures(result: BatchResult) -> dict[int, str]:
    """The class of the error of each part that has failed."""
    return {
        record["part"]: record["error"]["class"] for record in result.records if "error" in record
    }


def test_a_task_is_run_again_when_its_process_dies_once() -> None:
    engine = Engine(lambda _, before: before == 0)
    result = asyncio.run(run_task(engine, make_task("ab")))
    assert (result.end, len(result.records), failures(result)) == (DONE, 2, {})
    assert engine.tasks == [["a", "b"]] * 2


def test_a_part_that_kills_its_process_twice_is_named_and_the_others_succeed() -> None:
    engine = Engine(lambda names, _: "b" in names)
    result = asyncio.run(run_task(engine, make_task("abc")))
    assert failures(result) == {1: PartCrashed.__name__}
    assert [record["part"] for record in result.records] == [0, 1, 2]
    assert engine.tasks == [[*"abc"], [*"abc"], ["a"], ["b"], ["b"], ["c"]]


def test_a_part_that_killed_its_process_once_may_succeed_alone() -> None:
    engine = Engine(lambda names, before: len(names) > 1 or (names == ["b"] and before == 0))
    result = asyncio.run(run_task(engine, make_task("ab")))
    assert failures(result) == {}


def test_a_part_that_reaches_no_checkpoint_is_ended_and_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert attempts.GRACE == 30
    monkeypatch.setattr(attempts, "GRACE", 0.05)
    engine = Engine(lambda *_: False, hangs="b")
    result = asyncio.run(run_task(engine, make_task("abc", timeout=0.05)))
    assert failures(result) == {1: OutOfTime.__name__}
    assert engine.tasks == [[*"abc"], ["a"], ["b"], ["c"]]


def test_records_keep_names_results_and_errors() -> None:
    engine = Engine(lambda names, _: "b" in names)
    result = asyncio.run(run_task(engine, make_task("ab")))
    lines = read_lines(write_records(result.records, {0: "first"}))
    first, second = map(read_record, lines)
    assert (first.part, first.id, first.name, first.result) == (0, "id-a", "first", RESULT)
    assert (second.part, second.name, second.state) == (1, "", "failed")
    assert isinstance(second.error, PartCrashed)
    assert second.error.issues[0].code == "part_crashed"
