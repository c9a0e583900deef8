"""Batches of parts: files and records, what is found again, and how a batch ends early."""

import asyncio
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import orjson
import pytest

from service.encoders.registry import BY_NAME
from service.engine.mesh.mesh import ENGINE
from service.errors import UnknownSurface
from service.jobs import batch as batches
from service.jobs.batch import (
    CANCELLED,
    DONE,
    UNFINISHED,
    WRONG_ENGINE,
    BatchResult,
    Task,
    read_result,
    read_task,
    run_batch,
)
from service.jobs.checks import check_part
from service.jobs.keys import cancelled_key, part_key
from service.jobs.parts import read_part
from service.jobs.results import Result, describe_file, read_object, write_object
from service.pipeline.calls import CallLimits, File
from service.storage.address import open_store
from service.storage.canonical import plan_content
from service.surface.examples.catalogue import find
from service.surface.kinds import Surface

LIMITS = CallLimits()
PATHS = tuple(
    f"/v1/surfaces/saddle/mesh.{suffix}?resolution=2" for suffix in ("glb", "stl", "json")
)
JOB = "a" * 64


def find_none(_: str) -> Surface:
    raise UnknownSurface


def number(*documents: dict[str, Any]) -> tuple[dict[str, Any], ...]:
    """The lines of parts, as a job has them."""
    lines = [orjson.loads(check_part(each, LIMITS, find_none).line) for each in documents]
    return tuple({"part": part, **line} for part, line in enumerate(lines))


def by_path(*paths: str) -> tuple[dict[str, Any], ...]:
    return number(*({"path": path} for path in paths))


@pytest.fixture
def store(tmp_path: Path) -> str:
    """The address of a new store."""
    address = str(tmp_path / "store")
    open_store(address, 0)
    return address


def run(task: Task) -> BatchResult:
    return read_result(run_batch(task.write()))


def content_of(path: str) -> bytes:
    return bytes(read_part(path, None, LIMITS).plan(find_none).run().content)


def count_runs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Makes the list of the paths that are computed from now on."""
    paths: list[str] = []

    def read(path: str, *rest: Any) -> Any:
        paths.append(path)
        return read_part(path, *rest)

    monkeypatch.setattr(batches, "read_part", read)
    return paths


def test_a_task_is_bytes(store: str) -> None:
    task = Task(by_path(*PATHS), store, LIMITS, 60.0, JOB, "out", 5.0)
    assert read_task(task.write()) == task
    endless = replace(task, lifetime=float("inf"))
    assert read_task(endless.write()) == endless


def test_files_are_kept_under_the_ids_of_their_parts(store: str) -> None:
    lines = by_path(*PATHS)
    result = run(Task(lines, store, LIMITS, 60.0))
    assert result.end == DONE
    assert [record["part"] for record in result.records] == [0, 1, 2]
    for line, record in zip(lines, result.records, strict=True):
        expected = content_of(line["path"])
        about, content = read_object((Path(store) / part_key(line["id"])).read_bytes())
        assert content == expected
        assert record["state"] == "succeeded"
        assert record["id"] == line["id"]
        assert record["bytes"] == about.bytes == len(expected)
        assert record["sha256"] == about.sha256 == sha256(expected).hexdigest()
        assert record["suffix"] == line["path"].partition(".")[2].partition("?")[0]
        assert (record["vertices"], record["triangles"]) == (9, 8)


def test_a_file_that_is_there_is_not_computed_again(
    store: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = by_path(*PATHS)
    first = run(Task(lines, store, LIMITS, 60.0))
    paths = count_runs(monkeypatch)
    again = run(Task(lines, store, LIMITS, 60.0))
    assert paths == []
    assert all(record["found"] for record in again.records)
    assert [_without_times(record) for record in again.records] == [
        _without_times(record) for record in first.records
    ]


def _without_times(record: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in record.items() if key not in ("seconds", "found")}


def test_a_batch_begins_no_part_after_its_time(store: str) -> None:
    lines = by_path(*PATHS)
    first = run(Task(lines, store, LIMITS, 60.0, seconds=0.0))
    assert first.end == UNFINISHED
    assert [record["part"] for record in first.records] == [0]
    whole = run(Task(lines, store, LIMITS, 60.0, seconds=3600.0))
    assert whole.end == DONE
    assert len(whole.records) == len(lines)


def test_the_first_file_of_a_part_stays(store: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two processes compute one part at the same time, and on two processors digits may differ."""
    (line,) = by_path(PATHS[0])
    path = Path(store) / part_key(line["id"])
    first = File(b"of another processor", "saddle")
    about = describe_file(first, b"of another processor", BY_NAME["glb"])

    def let_another_write(file: File, content: bytes, fmt: Any) -> Result:
        path.parent.mkdir(parents=True)
        path.write_bytes(write_object(about, b"of another processor"))
        return describe_file(file, content, fmt)

    monkeypatch.setattr(batches, "describe_file", let_another_write)
    (record,) = run(Task((line,), store, LIMITS, 60.0)).records
    assert bytes(read_object(path.read_bytes())[1]) == b"of another processor"
    assert record["sha256"] == about.sha256


@pytest.mark.parametrize("damage", [b"", b"x", b"{}\nx"])
def test_a_damaged_file_is_computed_again(store: str, damage: bytes) -> None:
    lines = by_path(*PATHS)
    run(Task(lines, store, LIMITS, 60.0))
    path = Path(store) / part_key(lines[1]["id"])
    whole = path.read_bytes()
    path.write_bytes(damage or whole[:-1])
    assert run(Task(lines, store, LIMITS, 60.0)).end == DONE
    assert path.read_bytes() == whole


def test_an_old_file_that_is_found_is_written_again(store: str) -> None:
    lines = by_path(PATHS[0])
    run(Task(lines, store, LIMITS, 60.0))
    path = Path(store) / part_key(lines[0]["id"])
    before = path.stat()
    run(Task(lines, store, LIMITS, 60.0, lifetime=3600.0))
    assert path.stat().st_ino == before.st_ino
    run(Task(lines, store, LIMITS, 60.0, lifetime=0.0))
    assert path.stat().st_ino != before.st_ino


def test_a_part_that_fails_is_named_and_fails_alone(store: str) -> None:
    small = "/v1/surfaces/saddle/mesh.glb?tolerance=1e-30"
    good, refused, last = by_path(PATHS[0], small, PATHS[1])
    unknown = {"part": 3, "id": "b" * 64, "path": "/v1/nothing"}
    result = run(Task((good, refused, unknown, last | {"part": 4}), store, LIMITS, 60.0))
    states = {record["part"]: record["state"] for record in result.records}
    assert states == {0: "succeeded", 1: "failed", 3: "failed", 4: "succeeded"}
    errors = [record["error"] for record in result.records if record["state"] == "failed"]
    assert [error["class"] for error in errors] == ["InvalidRequest", "InvalidRequest"]
    assert [issue["code"] for error in errors for issue in error["issues"]] == [
        "tolerance_too_small",
        "unknown_path",
    ]
    assert result.end == DONE


@pytest.mark.parametrize(
    ("error", "code"),
    [(MemoryError(), "too_much_memory"), (RuntimeError("a secret"), "internal_error")],
)
def test_an_unexpected_error_shows_no_internal_text(
    error: Exception, code: str, store: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(batches, "read_part", fail)
    (record,) = run(Task(by_path(PATHS[0]), store, LIMITS, 60.0)).records
    assert record["error"]["issues"][0]["code"] == code
    assert "secret" not in str(record)


def test_a_part_has_a_time_limit(store: str) -> None:
    long = "/v1/surfaces/utah-teapot/mesh.glb?relative_tolerance=1e-5"
    lines = by_path(long, PATHS[0])
    result = run(Task(lines, store, LIMITS, 0.05))
    assert [record["state"] for record in result.records] == ["failed", "succeeded"]
    assert result.records[0]["error"]["class"] == "OutOfTime"


def test_another_engine_is_refused(store: str) -> None:
    task = Task(by_path(PATHS[0]), store, LIMITS, 60.0, engine=ENGINE + 1)
    assert run(task) == BatchResult((), WRONG_ENGINE)


def test_a_withdrawn_job_ends_in_its_running_part(
    store: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batches, "LOOK_INTERVAL", 0.02)
    backend = open_store(store, 0).backend
    lines = by_path(PATHS[0], "/v1/surfaces/utah-teapot/mesh.glb?relative_tolerance=1e-6", PATHS[1])

    def withdraw_and_read(path: str, *rest: Any) -> Any:
        if "teapot" in path:
            thread = threading.Thread(
                target=lambda: asyncio.run(backend.write(cancelled_key(JOB), b""))
            )
            thread.start()
            thread.join()
        return read_part(path, *rest)

    monkeypatch.setattr(batches, "read_part", withdraw_and_read)
    start = time.monotonic()
    result = run(Task(lines, store, LIMITS, 60.0, JOB))
    assert result.end == CANCELLED
    assert [record["part"] for record in result.records] == [0]
    assert time.monotonic() - start < 5


def fail_from(number: int, write: Callable[..., Any], error: OSError) -> Callable[..., Any]:
    """A function that writes, but fails from this call on."""
    calls = 0

    async def write_or_fail(*arguments: Any, **options: Any) -> None:
        nonlocal calls
        calls += 1
        if calls >= number:
            raise error
        await write(*arguments, **options)

    return write_or_fail


@pytest.mark.parametrize(
    ("error", "end"),
    [(OSError(28, "no space"), "disk_full"), (OSError(5, "broken"), "store_failed")],
)
def test_a_full_or_broken_disk_ends_the_batch_which_can_be_run_again(
    error: OSError, end: str, store: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = by_path(*PATHS)
    kind = type(open_store(store, 0).backend)
    with monkeypatch.context() as patch:
        patch.setattr(kind, "write", fail_from(2, kind.write, error))
        result = run(Task(lines, store, LIMITS, 60.0))
    assert result.end == end
    (done,) = (record["part"] for record in result.records)  # whichever was written first
    paths = count_runs(monkeypatch)
    assert run(Task(lines, store, LIMITS, 60.0)).end == DONE
    assert sorted(paths) == sorted(path for k, path in enumerate(PATHS) if k != done)


def test_stored_surfaces_are_read_from_the_store(store: str) -> None:
    id, content = plan_content(find("saddle").surface()).run()
    asyncio.run(open_store(store, 0).put(id, content))
    stored, missing = f"/v1/surfaces/{id}/mesh.glb?resolution=2", "c" * 64
    lines = (
        {"part": 0, "path": stored},
        {"part": 1, "path": f"/v1/surfaces/{missing}/mesh.glb"},
    )
    result = run(Task(lines, store, LIMITS, 60.0))
    assert result.records[0]["sha256"] == sha256(content_of(PATHS[0])).hexdigest()
    assert result.records[1]["error"]["class"] == "UnknownSurface"


def test_files_may_have_the_names_of_their_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "made" / "here"
    lines = tuple({"part": k, "path": path, "name": f"n{k}"} for k, path in enumerate(PATHS))
    result = run(Task(lines, "", LIMITS, 60.0, output=str(output)))
    assert sorted(path.name for path in output.iterdir()) == ["n0.glb", "n1.stl", "n2.json"]
    assert (output / "n1.stl").read_bytes() == content_of(PATHS[1])
    fields = ("media_type", "suffix", "name", "bytes", "sha256")
    known = [
        {"id": record["id"], "result": {name: record[name] for name in fields}}
        for record in result.records
    ]
    (output / "n2.json").write_bytes(b"changed")
    (output / "n0.glb").unlink()
    again = tuple(line | {"known": each} for line, each in zip(lines, known, strict=True))
    made: list[str] = []

    def note(file: File, content: bytes, fmt: Any) -> Any:
        made.append(fmt.suffix)
        return describe_file(file, content, fmt)

    monkeypatch.setattr(batches, "describe_file", note)
    run(Task(again, "", LIMITS, 60.0, output=str(output)))
    assert made == ["glb", "json"]
    assert (output / "n2.json").read_bytes() == content_of(PATHS[2])
