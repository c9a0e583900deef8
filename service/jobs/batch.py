"""Computes a batch of parts, in a job process or in a worker of Dask.

A task and its result are bytes, so no object of this service travels between processes, and any
process that reaches the store can compute any batch. All that a task does can be done again: a part
whose file is there is not computed a second time.
"""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import asdict, dataclass
from math import inf
from threading import Event, Thread
from typing import Any, NoReturn

import orjson

from service.cancellation import Cancellation, Cancelled, cancelled_by
from service.decoders.format import Decoder, FileLimits
from service.engine.mesh.mesh import ENGINE
from service.errors import (
    Issue,
    StoreFailed,
    StoreFull,
    SurfaceError,
    TooLarge,
    UnknownSurface,
)
from service.jobs.file_parts import file_part_id, read_file_part
from service.jobs.keys import cancelled_key
from service.jobs.outputs import Line, NamedFiles, Output, StoredParts
from service.jobs.parts import FindSurface, Part, read_part
from service.jobs.results import Result, describe_file, write_error
from service.pipeline.calls import CallLimits
from service.pipeline.limits import Limits
from service.schemas.document import DocumentLimits
from service.storage.address import open_output, open_store
from service.storage.canonical import restore_surface
from service.storage.failures import translate_errors

BATCH_SECONDS, BATCH_PARTS, BATCH_BYTES = 1.0, 400, 4 << 20
"""The size at which batches are cut: seconds of work, parts, and bytes of their lines. Passing a
batch to a process costs little beside a second, and callers take turns after each batch."""

MAX_WRITING = 8
"""Files that are being written while the next part is computed."""

LOOK_INTERVAL = 1.0
"""Seconds between two looks whether the job is withdrawn."""

DONE, CANCELLED, WRONG_ENGINE, STORE_FAILED = "done", "cancelled", "wrong_engine", "store_failed"
UNFINISHED = "unfinished"
"""Ends of a batch; others are the codes of `StoreFull` and `StoreFailed`."""

SUCCEEDED, FAILED = "succeeded", "failed"
"""States of a part that has ended."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Task:
    """A batch of parts, and all that a process must know to compute it.

    Attributes
    ----------
    lines : tuple of dict
        The parts in the form of `check_part`, each with its index `part`. If a line has no `id`,
        the process finds the id. The `file` of a line is the id of a file in the store; with an
        `output` it is the path of a file on this machine.
    store : str
        The address of the store that has the surfaces and the job; if empty, parts can read no
        stored surfaces.
    limits : CallLimits
    timeout : float
        The most seconds of each part.
    job : str
        The id of the job; empty for a batch that no caller can withdraw.
    output : str
        The folder or the bucket for files that have the names of the parts. If empty, results are
        kept in the store, under the ids of the parts.
    lifetime : float
        Seconds for which results are kept. A result that is found, and is older than half of that,
        is written again.
    seconds : float
        After this time no part begins but the first; the end of the batch is then `UNFINISHED`.
    engine : int
    """

    lines: tuple[Line, ...]
    store: str
    limits: CallLimits
    timeout: float
    job: str = ""
    output: str = ""
    lifetime: float = inf
    seconds: float = inf
    engine: int = ENGINE

    def write(self) -> bytes:
        """The task as JSON, which has null in place of infinity."""
        return orjson.dumps(self)


def read_task(text: bytes) -> Task:
    """The task that `Task.write` wrote."""
    fields = orjson.loads(text)
    limits = fields["limits"]
    return Task(
        **fields
        | {
            "lines": tuple(fields["lines"]),
            "limits": CallLimits(
                DocumentLimits(**limits["document"]),
                Limits(**limits["result"]),
                FileLimits(**limits["file"]),
            ),
        }
        | {name: inf for name in ("lifetime", "seconds") if fields[name] is None}
    )


@dataclass(frozen=True, slots=True)
class BatchResult:
    """The records of the parts that have ended, by index, and how the batch ended.

    A record has the index `part`, the `id`, the `state`, the `seconds` of the processor, and the
    fields of `Result`, with `found` if its file was there; or, of a part that failed, the `error`
    (`service.jobs.results`).
    """

    records: tuple[dict[str, Any], ...]
    end: str = DONE

    def write(self) -> bytes:
        """The records and the end as lines of JSON."""
        return b"\n".join(map(orjson.dumps, (*self.records, {"end": self.end})))


def read_result(text: bytes) -> BatchResult:
    """The result that `BatchResult.write` wrote."""
    *records, last = map(orjson.loads, text.split(b"\n"))
    return BatchResult(tuple(records), last["end"])


def run_batch(text: bytes) -> bytes:
    """Computes the parts of a task one after the other, and writes their files.

    A part that fails has a record with its error, and the others go on. The batch ends early if the
    job is withdrawn, and if the store is full or fails; run again, it finds the files that are
    there.
    """
    task = read_task(text)
    if task.engine != ENGINE:
        return BatchResult((), WRONG_ENGINE).write()
    return asyncio.run(_Batch(task).run()).write()


class _Batch:
    """The parts of one task, and the files that are being written."""

    def __init__(self, task: Task) -> None:
        self._task = task
        self._store = open_store(task.store, quota=0, create=False) if task.store else None
        self._output = self._open_output()
        self._records: list[dict[str, Any]] = []
        self._is_withdrawn = False
        self._running = Cancellation()
        self._writing: set[asyncio.Task[None]] = set()
        self._write_slots = asyncio.Semaphore(MAX_WRITING)

    def _open_output(self) -> Output:
        if self._task.output:
            return NamedFiles(open_output(self._task.output))
        if self._store is None:
            raise ValueError("a task without an output needs a store")
        return StoredParts(self._store.backend, self._task.lifetime)

    async def run(self) -> BatchResult:
        """Computes all parts; returns early if the job is withdrawn, or the store fails."""
        end = DONE
        last_start = time.monotonic() + self._task.seconds
        try:
            async with self._watch():
                for begun, line in enumerate(self._task.lines):
                    if begun and time.monotonic() > last_start:
                        end = UNFINISHED
                        break
                    await self._compute(line)
        except Cancelled:
            end = CANCELLED
        except (StoreFull, StoreFailed) as error:
            end = _end_of(error)
        for failure in await asyncio.gather(*self._writing, return_exceptions=True):
            if isinstance(failure, StoreFull | StoreFailed):
                end = _end_of(failure)
            elif failure is not None:
                raise failure
        self._records.sort(key=lambda record: int(record["part"]))
        return BatchResult(tuple(self._records), end)

    async def _compute(self, line: Line) -> None:
        """Computes one part, and begins to write its file.

        Raises
        ------
        Cancelled, StoreFull, StoreFailed
        """
        start = time.process_time()
        try:
            await self._make(line, start)
        except (Cancelled, StoreFull, StoreFailed):
            raise
        except Exception as error:
            fields = {"error": write_error(_to_part_error(error))}
            self._record(line, start, fields, FAILED)

    async def _make(self, line: Line, start: float) -> None:
        """Makes the file of one part; raises the errors of the part and of `_compute`."""
        self._running = Cancellation(time.monotonic() + self._task.timeout)
        if self._is_withdrawn:
            raise Cancelled
        with cancelled_by(self._running):
            part: Part | None = None
            source = await self._read_source(line) if "id" not in line else None
            if source is not None:
                line["id"] = file_part_id(line["path"], *source, self._task.limits)
            elif "id" not in line:
                part = read_part(line["path"], line.get("body"), self._task.limits)
                line["id"] = part.id
            with translate_errors("looking for the file of a part"):
                found = await self._output.find(line)
            if found is not None:
                self._record(line, start, asdict(found) | {"found": True})
                return
            source = source or await self._read_source(line)
            if source is not None:
                part = read_file_part(line["path"], *source, self._task.limits)
            part = part or read_part(line["path"], line.get("body"), self._task.limits)
            file = part.plan(await self._build_finder(part)).run()
        content = bytes(file.content)
        result = describe_file(file, content, part.fmt)
        await self._write_slots.acquire()  # so that few files wait in memory
        self._writing.add(asyncio.create_task(self._write(line, start, result, content)))
        await asyncio.sleep(0)  # lets the writing begin

    async def _read_source(self, line: Line) -> tuple[Decoder, bytes] | None:
        """The file that has the surface of a part; None for a part without a file."""
        if "file" not in line:
            return None
        with translate_errors("reading the file that has the surface of a part"):
            return await self._output.read_source(line["file"])

    async def _build_finder(self, part: Part) -> FindSurface:
        """The function that finds the stored surface of a part, which is read now."""
        if not part.stored or self._store is None:
            return _find_none
        content = await self._store.get(part.stored)
        surface = restore_surface(content, self._task.limits.document)
        return lambda _: surface

    async def _write(self, line: Line, start: float, result: Result, content: bytes) -> None:
        """Writes the file of a part, and then its record."""
        try:
            with translate_errors("writing the file of a part"):
                result = await self._output.write(line, result, content)
            self._record(line, start, asdict(result))
        finally:
            self._write_slots.release()

    def _record(
        self, line: Line, start: float, fields: dict[str, Any], state: str = SUCCEEDED
    ) -> None:
        """Adds the record of a part that has ended."""
        seconds = round(time.process_time() - start, 6)
        about = {"part": line["part"], "id": line.get("id", ""), "state": state}
        self._records.append({**about, "seconds": seconds, **fields})

    @asynccontextmanager
    async def _watch(self) -> AsyncIterator[None]:
        """Looks once a second, in a thread, whether the job is withdrawn, during the block."""
        is_over = Event()
        if self._task.job:
            look = (self._task, is_over, self._withdraw)
            Thread(target=_look, args=look, name="withdrawal", daemon=True).start()
        try:
            yield
        finally:
            is_over.set()

    def _withdraw(self) -> None:
        """Stops the running part at its next checkpoint, and all parts after it."""
        self._is_withdrawn = True
        self._running.cancel()


def _look(task: Task, is_over: Event, withdraw: Callable[[], None]) -> None:
    """Calls `withdraw` when the job is withdrawn. A store that fails for a moment says nothing."""
    while not is_over.wait(LOOK_INTERVAL):
        with suppress(Exception):
            store = open_store(task.store, quota=0, create=False)
            asyncio.run(store.backend.head(cancelled_key(task.job)))
            withdraw()
            return


def _find_none(_: str) -> NoReturn:
    raise UnknownSurface(Issue("unknown_surface", "No surface is stored under this id."))


def _end_of(error: SurfaceError) -> str:
    return error.issues[0].code if error.issues else STORE_FAILED


def _to_part_error(error: Exception) -> SurfaceError:
    """The error of a part as the client sees it; an unexpected error only in the log."""
    if isinstance(error, SurfaceError):
        return error
    if isinstance(error, MemoryError):
        return TooLarge(Issue("too_much_memory", "The part took more memory than its process has."))
    _log.error("a part failed with an error", exc_info=error)
    return SurfaceError(Issue("internal_error", "The part failed; the log says why."))
