"""Files for the parts of a list: what is made, found, named, tried again and recorded."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import orjson
import pytest

from service.jobs import bake as baking
from service.jobs.bake import FILES_ELSEWHERE, Bake, BakeStopped, Entry, is_file_name
from service.jobs.bake_record import FOLDER
from service.jobs.batch import (
    BATCH_SECONDS,
    DONE,
    UNFINISHED,
    WRONG_ENGINE,
    BatchResult,
    Task,
    read_result,
    read_task,
    run_batch,
)
from service.jobs.engine import EngineUnavailable
from service.jobs.parts import read_part
from service.pipeline.calls import CallLimits
from service.storage.address import open_output


def entry(name: str, resolution: int = 2, place: str = "") -> Entry:
    path = f"/v1/surfaces/saddle/mesh.off?resolution={resolution}"
    return Entry(place or name, name, {"path": path}, 100)


class ThreadEngine:
    """Runs tasks in a thread; `answer` may replace the result of a task."""

    slots = 2

    def __init__(
        self, answer: Callable[[Task, BatchResult], BatchResult | Awaitable[BatchResult]]
    ) -> None:
        self.tasks: list[Task] = []
        self._answer = answer

    async def run(self, task: bytes) -> bytes:
        self.tasks.append(read_task(task))
        result = read_result(await asyncio.to_thread(run_batch, task))
        answer = self._answer(self.tasks[-1], result)
        return (answer if isinstance(answer, BatchResult) else await answer).write()

    async def close(self) -> None:
        """Has nothing to end."""


async def run_entries(bakery: Bake, entries: Iterable[Entry]) -> None:
    """Runs a bake whose texts stand for these entries."""
    known: dict[str, Entry] = {}

    def write() -> Iterator[str]:
        for number, each in enumerate(entries):
            text = f"{number}".ljust(each.size)
            known[text] = each
            yield text

    await bakery.run(write(), lambda _, text: known[text])


def leave(_: Task, result: BatchResult) -> BatchResult:
    return result


def bake(
    folder: Path,
    entries: Iterable[Entry],
    answer: Callable[[Task, BatchResult], BatchResult | Awaitable[BatchResult]] = leave,
) -> tuple[Bake, list[Task]]:
    """Bakes into a folder; returns the bake, and the tasks that the engine got."""

    async def run() -> tuple[Bake, list[Task]]:
        engine = ThreadEngine(answer)
        task = Task((), "", CallLimits(), 60.0, output=str(folder))
        result = Bake(engine, open_output(str(folder)), task, lambda _: None)
        await run_entries(result, entries)
        return result, engine.tasks

    return asyncio.run(run())


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def records(folder: Path) -> list[dict[str, Any]]:
    paths = sorted((folder / FOLDER).glob("*"))
    return [orjson.loads(line) for path in paths for line in path.read_bytes().splitlines()]


def content(resolution: int) -> bytes:
    part = read_part(entry("x", resolution).line["path"], None, CallLimits())
    return bytes(part.plan(lambda _: pytest.fail("a stored surface")).run().content)


def failures(result: Bake) -> list[tuple[str, str, str]]:
    return [
        (each.place, each.name, issue["code"])
        for each in result.record.failures()
        for issue in each.error["issues"]
    ]


def test_each_part_gets_a_file_and_a_record(tmp_path: Path) -> None:
    result, _ = bake(tmp_path, (entry(f"part {k}", 1 + k) for k in range(20)))
    assert files(tmp_path) == {f"part {k}.off": content(1 + k) for k in range(20)}
    assert (result.counts.made, result.counts.found, result.counts.failed) == (20, 0, 0)
    assert sorted(each["name"] for each in records(tmp_path)) == sorted(
        f"part {k}" for k in range(20)
    )


def test_files_that_agree_are_not_made_again(tmp_path: Path) -> None:
    bake(tmp_path, [entry(name) for name in "abcd"])
    before = records(tmp_path)
    times = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    (tmp_path / "b.off").write_bytes(b"changed")
    (tmp_path / "c.off").unlink()
    result, _ = bake(tmp_path, [entry("a"), entry("b"), entry("c"), entry("d", 3), entry("e")])
    assert (result.counts.made, result.counts.found) == (4, 1)
    assert files(tmp_path) == {f"{name}.off": content(2) for name in "abce"} | {"d.off": content(3)}
    assert (tmp_path / "a.off").stat().st_mtime_ns == times["a.off"]
    assert len(records(tmp_path)) == len(before) + 4


def test_a_second_bake_writes_nothing(tmp_path: Path) -> None:
    bake(tmp_path, [entry("a"), entry("b")])
    times = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    result, _ = bake(tmp_path, [entry("b"), entry("a")])
    assert result.counts.found == 2
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == times


def test_a_torn_record_costs_only_its_part(tmp_path: Path) -> None:
    bake(tmp_path, [entry("a"), entry("b")])
    (path,) = (tmp_path / FOLDER).iterdir()
    path.write_bytes(path.read_bytes()[:-30] + b"\n[]\n\xff\n")
    result, _ = bake(tmp_path, [entry("a"), entry("b")])
    assert (result.counts.made, result.counts.found) == (1, 1)


def test_a_part_that_fails_is_named_and_fails_alone(tmp_path: Path) -> None:
    wrong = Entry("line 2", "b", {"path": "/v1/mesh", "body": {"surface": {"type": "sponge"}}}, 9)
    result, _ = bake(tmp_path, [entry("a"), wrong, entry("c")])
    assert failures(result) == [("line 2", "b", "unknown_type")]
    assert files(tmp_path).keys() == {"a.off", "c.off"}
    # A part that failed is tried again.
    result, _ = bake(tmp_path, [entry("a"), entry("b"), entry("c")])
    assert (result.counts.made, result.counts.found) == (1, 2)


@pytest.mark.parametrize(
    "line", ['{"name": "a"}', '{"name": ["a"], "id": "", "result": {}}', "[1]"]
)
def test_a_damaged_record_is_made_again(tmp_path: Path, line: str) -> None:
    bake(tmp_path, [entry("a")])
    (record,) = (tmp_path / FOLDER).iterdir()
    record.write_text(f"{line}\n", encoding="utf-8")
    result, _ = bake(tmp_path, [entry("a")])
    assert (result.counts.made, result.counts.failed) == (1, 0)


def test_names_are_unique_also_without_capitals(tmp_path: Path) -> None:
    entries = [entry("Lid", place="line 1"), entry("lid", place="line 2"), entry("x"), entry("x")]
    result, _ = bake(tmp_path, entries)
    assert failures(result) == [("line 2", "lid", "repeated_name"), ("x", "x", "repeated_name")]
    assert [each.error["issues"][0]["got"] for each in result.record.failures()] == [
        "the name of line 1",
        "the name of x",
    ]
    assert files(tmp_path).keys() == {"Lid.off", "x.off"}


UNSAFE: tuple[str, ...] = (
    "",
    ".",
    "..",
    ".hidden",
    "a/b",
    "../a",
    "a\\b",
    "a\nb",
    "a:b",
    "a.",
    " a",
    "x" * 201,
)
UNSAFE += ("nul", "COM1.old")


@pytest.mark.parametrize("name", UNSAFE, ids=ascii)
def test_names_that_are_unsafe_as_files_are_refused(tmp_path: Path, name: str) -> None:
    assert not is_file_name(name)
    result, tasks = bake(tmp_path / "out", [entry(name)])
    assert failures(result) == [(name, name, "invalid_name")]
    assert tasks == []
    assert [path.name for path in tmp_path.rglob("*")] == ["out"]


@pytest.mark.parametrize(
    "name", ["a", "Deckel-groß", "part (1) #2 100%", "v1.2", "部品", "x" * 200]
)
def test_other_names_are_those_of_the_files(tmp_path: Path, name: str) -> None:
    bake(tmp_path, [entry(name)])
    assert files(tmp_path).keys() == {f"{name}.off"}


def test_parts_that_were_not_begun_go_into_another_batch(tmp_path: Path) -> None:
    def keep_first(_: Task, result: BatchResult) -> BatchResult:
        end = DONE if len(result.records) == 1 else UNFINISHED
        return BatchResult(result.records[:1], end)

    result, tasks = bake(tmp_path, [entry(f"{k}") for k in range(9)], keep_first)
    assert result.counts.made == 9
    assert len(tasks) >= 9
    assert len(records(tmp_path)) == 9


@pytest.mark.slow
@pytest.mark.parametrize(("seconds", "most"), [(0.0001, 400), (0.1, 10), (5.0, 1)])
def test_batches_take_about_a_second(tmp_path: Path, seconds: float, most: int) -> None:
    def slow(_: Task, result: BatchResult) -> BatchResult:
        return BatchResult(tuple(each | {"seconds": seconds} for each in result.records))

    _, tasks = bake(tmp_path, [entry(f"{k}") for k in range(most + 100)], slow)
    # The first two tasks, one in each slot, are made before anything is measured.
    sizes = [len(task.lines) for task in tasks][2:]
    assert max(sizes) <= most
    assert max(sizes) > most / 4
    assert all(task.seconds == BATCH_SECONDS for task in tasks)


@pytest.mark.parametrize(("size", "most"), [(10, 5000), (100_000, 1000)])
def test_the_list_is_read_as_parts_are_taken(tmp_path: Path, size: int, most: int) -> None:
    count = 0

    def read() -> Iterator[Entry]:
        nonlocal count
        for count in range(10_000):
            yield Entry("", f"{count}", entry("").line, size)

    async def hold(_: Task, result: BatchResult) -> BatchResult:
        await asyncio.Event().wait()
        return result

    async def run() -> None:
        bakery = make_bake(tmp_path, hold)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(run_entries(bakery, read()), 0.3)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(baking, "STOP_SECONDS", 0.0)
        asyncio.run(run())
    assert 0 < count < most


def make_bake(folder: Path, answer: Callable[[Task, BatchResult], Any]) -> Bake:
    task = Task((), "", CallLimits(), 60.0, output=str(folder))
    return Bake(ThreadEngine(answer), open_output(str(folder)), task, lambda _: None)


def test_files_that_were_made_before_a_stop_are_recorded(tmp_path: Path) -> None:
    """Also what a batch makes that ends within `STOP_SECONDS` after the stop."""
    count = 0

    async def run() -> None:
        stopped = asyncio.Event()

        async def hold(_: Task, result: BatchResult) -> BatchResult:
            nonlocal count
            count += len(result.records)
            if count > baking.FIRST_PARTS:
                if not stopping.cancelling():
                    stopping.cancel()
                    asyncio.get_running_loop().call_later(0.1, stopped.set)
                await stopped.wait()
            return result

        bakery = make_bake(tmp_path, hold)
        stopping = asyncio.create_task(run_entries(bakery, [entry(f"{k}") for k in range(300)]))
        with pytest.raises(asyncio.CancelledError):
            await stopping
        assert bakery.counts.made == len(records(tmp_path)) == count

    asyncio.run(run())
    result, _ = bake(tmp_path, (entry(f"{k}") for k in range(300)))
    assert (result.counts.made, result.counts.found) == (300 - count, count)


@pytest.mark.parametrize("end", ["disk_full", WRONG_ENGINE])
def test_a_bake_that_cannot_go_on_stops_and_can_be_continued(tmp_path: Path, end: str) -> None:
    def fill(_: Task, result: BatchResult) -> BatchResult:
        return BatchResult(result.records[:-1], end)

    entries = [entry(f"{k}") for k in range(4)]
    with pytest.raises(BakeStopped) as stop:
        bake(tmp_path, entries, fill)
    assert stop.value.reason == end
    count = len(records(tmp_path))  # batches have as many parts as a slow machine makes
    assert count < 4
    result, _ = bake(tmp_path, entries)
    assert files(tmp_path).keys() == {f"{k}.off" for k in range(4)}
    assert (result.counts.found, result.counts.made) == (count, 4 - count)


def test_files_on_the_disk_of_a_worker_are_noticed(tmp_path: Path) -> None:
    def write_elsewhere(_: Task, result: BatchResult) -> BatchResult:
        (tmp_path / "a.off").unlink()
        return result

    with pytest.raises(BakeStopped) as stop:
        bake(tmp_path, [entry("a")], write_elsewhere)
    assert stop.value.reason == FILES_ELSEWHERE


def test_a_bake_waits_for_an_engine_that_has_worked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baking, "RETRY_SECONDS", 0.0)
    tries = 0

    def answer(_: Task, result: BatchResult) -> BatchResult:
        nonlocal tries
        tries += 1
        if 3 < tries < 10:
            raise EngineUnavailable("no_workers")
        return result

    result, _ = bake(tmp_path, [entry(f"{k}") for k in range(50)], answer)
    assert result.counts.ended == 50


def test_an_engine_that_never_worked_is_named_at_once(tmp_path: Path) -> None:
    def answer(*_: object) -> BatchResult:
        raise EngineUnavailable("no_scheduler")

    with pytest.raises(BakeStopped) as stop:
        bake(tmp_path, [entry("a")], answer)
    assert stop.value.reason == "no_scheduler"


def test_an_error_of_the_list_comes_after_the_parts_before_it(tmp_path: Path) -> None:
    def read() -> Iterator[Entry]:
        yield entry("a")
        raise OSError(5, "the disk of the list failed")

    with pytest.raises(OSError, match="the disk of the list"):
        bake(tmp_path, read())
    assert len(records(tmp_path)) == len(files(tmp_path)) <= 1
