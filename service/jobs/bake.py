"""Makes a file for each part of a list, however long: the batches and engines of jobs, no service.

The list is read as it comes. The size of a batch follows from the time of the parts before it, so
that a batch takes about a second; parts that are not begun in that time go into another batch. A
file that an earlier bake has recorded is not made again if it is still in the output.
"""

import asyncio
import re
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from math import inf
from typing import Any

from service.errors import InvalidRequest, Issue, SurfaceError
from service.jobs.attempts import run_task
from service.jobs.bake_record import BakeRecord, Failure
from service.jobs.batch import (
    BATCH_BYTES,
    BATCH_PARTS,
    BATCH_SECONDS,
    DONE,
    FAILED,
    UNFINISHED,
    BatchResult,
    Task,
)
from service.jobs.engine import Engine, EngineUnavailable
from service.jobs.list_reader import ListReader, Text
from service.jobs.outputs import Line
from service.jobs.results import Result, write_error
from service.storage.backends import Backend
from service.storage.failures import translate_errors

FIRST_PARTS = 8
"""Parts of the first batches, whose time is not known yet."""

RECORD_SECONDS = 1.0
"""Time after which new files are recorded, at the earliest."""

STOP_SECONDS = 1.0
"""Time for which running batches may go on when a bake is stopped, so that few parts are lost."""

RETRY_SECONDS, MAX_UNAVAILABLE = 5.0, 120.0
"""Seconds between attempts while no process can be had, such as during a restart of the scheduler;
seconds after the last batch after which the bake gives up."""

MAX_NAME = 200
"""The most bytes of a name: with its suffix it is a name of a file on all systems."""

_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
"""Names that are devices on Windows, with every suffix."""

FILES_ELSEWHERE = "files_elsewhere"
"""Why a bake stops: files that were written are not in the output, but on the disk of a worker."""

_RESULT_FIELDS = tuple(field.name for field in fields(Result))


class BakeStopped(Exception):
    """A bake cannot go on; it can be continued.

    Parameters
    ----------
    reason : str
        The end of a batch (`service.jobs.batch`), a reason of `EngineUnavailable`, or
        `FILES_ELSEWHERE`.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(slots=True)
class Counts:
    """Parts that have ended: made now, found from an earlier bake, and failed.

    `incomplete` are those whose CAD file has faces that could not be read; they are among the
    others.
    """

    made: int = 0
    found: int = 0
    failed: int = 0
    incomplete: int = 0

    @property
    def ended(self) -> int:
        """All of them."""
        return self.made + self.found + self.failed


@dataclass(frozen=True, slots=True)
class Entry:
    """A part of a list, or what is wrong with it.

    Attributes
    ----------
    place : str
        Where it is: `line 3`, or the name of a file.
    name : str
        The name of its file, without the suffix.
    line : dict
        Its `path`, and its `body` if it has one.
    size : int
        The bytes of its text.
    error : SurfaceError or None
    """

    place: str
    name: str
    line: Line
    size: int
    error: SurfaceError | None = None


@dataclass(frozen=True, slots=True)
class _Ready:
    """An entry that may be computed, with its number in the list."""

    number: int
    entry: Entry
    known: dict[str, Any] | None


class Bake:
    """Makes the files of one list.

    Parameters
    ----------
    engine : Engine
    output : Backend
        The folder or the bucket `task.output`.
    task : Task
        The task of every batch, without parts.
    on_change : callable
        Called with the counts when they have changed.

    Attributes
    ----------
    counts : Counts
    record : BakeRecord
        Has the failures.
    """

    def __init__(
        self, engine: Engine, output: Backend, task: Task, on_change: Callable[[Counts], None]
    ) -> None:
        self.counts = Counts()
        self.record = BakeRecord(output)
        self._engine = engine
        self._output = output
        self._task = replace(task, seconds=BATCH_SECONDS)
        self._on_change = on_change
        self._ready: deque[_Ready] = deque()
        self._number = 0
        self._batch_parts = FIRST_PARTS
        self._last_batch = -inf
        self._last_write = self._start = time.monotonic()

    async def run(self, texts: Iterable[Text], read: Callable[[int, Text], Entry | None]) -> None:
        """Makes the files of all entries of a list that have none.

        If this is cancelled, batches may go on for `STOP_SECONDS`; what they have made is recorded.

        Parameters
        ----------
        texts : iterable
            The texts of the entries, such as lines; read in a thread, as they are needed.
        read : callable
            Returns the entry of a text, or None if the text is empty; the first argument is the
            number of the text, from 1.

        Raises
        ------
        BakeStopped, StoreFull, StoreFailed
        Exception
            What reading the list has raised.
        """
        await self.record.load()
        reader = ListReader(texts)
        running: set[asyncio.Task[None]] = set()
        try:
            await self._dispatch(reader, read, running)
        finally:
            reader.close()
            if running:
                await asyncio.wait(running, timeout=STOP_SECONDS)
            for batch in running:
                batch.cancel()
            await asyncio.gather(*running, return_exceptions=True)
            await self.record.write()

    async def _dispatch(
        self,
        reader: ListReader[Text],
        read: Callable[[int, Text], Entry | None],
        running: set[asyncio.Task[None]],
    ) -> None:
        """Runs batches of the entries until all have ended."""
        reading: asyncio.Task[list[Text]] | None = None
        is_read = False
        try:
            while True:
                if reading is None and not is_read and len(self._ready) < 2 * BATCH_PARTS:
                    reading = asyncio.create_task(reader.take())
                while self._ready and len(running) < self._engine.slots:
                    running.add(asyncio.create_task(self._run_batch(list(self._cut()))))
                events: set[asyncio.Task[Any]] = {*running, *((reading,) if reading else ())}
                if not events:
                    return
                done, _ = await asyncio.wait(
                    events, timeout=RECORD_SECONDS, return_when=asyncio.FIRST_COMPLETED
                )
                for batch in done & running:
                    running.remove(batch)
                    batch.result()
                if reading in done:
                    is_read = not reading.result()
                    self._accept(reading.result(), read)
                    reading = None
                await self._write_record()
        finally:
            if reading is not None:
                reading.cancel()

    def _accept(self, texts: list[Text], read: Callable[[int, Text], Entry | None]) -> None:
        """Makes the entries of texts ready, except those with errors."""
        failed = self.counts.failed
        for text in texts:
            self._number += 1
            entry = read(self._number, text)
            if entry is None:
                continue
            error = entry.error or self._check_name(entry)
            if error is None:
                known = self.record.find_known(entry.name)
                self._ready.append(_Ready(self._number, entry, known))
            else:
                self._fail(self._number, entry, write_error(error))
        if self.counts.failed > failed:
            self._on_change(self.counts)

    def _check_name(self, entry: Entry) -> SurfaceError | None:
        message = "The file of a part is named after the part."
        if not is_file_name(entry.name):
            needed = f"a name of a file, without its suffix: at most {MAX_NAME} bytes, no point at "
            needed += 'either end, none of the characters / \\ : * ? " < > |, and no device of '
            needed += "Windows, such as NUL"
            return InvalidRequest(Issue("invalid_name", message, "/name", "another text", needed))
        before = self.record.take_name(entry.name, entry.place)
        if before is None:
            return None
        got, needed = f"the name of {before}", "names that differ, not only in capitals"
        return InvalidRequest(Issue("repeated_name", message, "/name", got, needed))

    def _fail(self, number: int, entry: Entry, error: dict[str, Any]) -> None:
        self.counts.failed += 1
        self.record.add_failure(number, Failure(entry.place, entry.name, error))

    def _cut(self) -> Iterator[_Ready]:
        """Takes the entries of the next batch."""
        size = 0
        for _ in range(min(self._batch_parts, len(self._ready))):
            if size and size + self._ready[0].entry.size > BATCH_BYTES:
                return
            size += self._ready[0].entry.size
            yield self._ready.popleft()

    async def _run_batch(self, batch: list[_Ready]) -> None:
        """Runs a batch; parts that it has not begun are ready again, before all others."""
        lines = [
            {"part": part, "name": ready.entry.name, **ready.entry.line}
            | ({} if ready.known is None else {"known": ready.known})
            for part, ready in enumerate(batch)
        ]
        result = await self._compute(replace(self._task, lines=tuple(lines)))
        rest = dict(enumerate(batch))
        for record in result.records:
            self._end(rest.pop(record["part"]), record)
        self._ready.extendleft(reversed(rest.values()))
        self._on_change(self.counts)
        if result.end not in (DONE, UNFINISHED):
            raise BakeStopped(result.end)
        self._last_batch = time.monotonic()
        self._measure(result.records)
        await self._check_output(batch, result.records)

    async def _compute(self, task: Task) -> BatchResult:
        """The result of a task; tries again while no process can be had."""
        while True:
            try:
                return await run_task(self._engine, task)
            except EngineUnavailable as error:
                if time.monotonic() > self._last_batch + MAX_UNAVAILABLE:
                    raise BakeStopped(error.reason) from None
            await asyncio.sleep(RETRY_SECONDS)

    def _end(self, ready: _Ready, record: dict[str, Any]) -> None:
        """Counts a part that has ended, and records a new file."""
        if record["state"] == FAILED:
            self._fail(ready.number, ready.entry, record["error"])
            return
        if (record["reading"] or "").partition("skipped=")[2] not in ("", "0"):
            self.counts.incomplete += 1
        if "found" in record:
            self.counts.found += 1
            return
        self.counts.made += 1
        result = {name: record[name] for name in _RESULT_FIELDS}
        self.record.add(ready.entry.name, record["id"], result)

    def _measure(self, records: tuple[dict[str, Any], ...]) -> None:
        """Chooses the parts of the next batches, and multiplies their number by at most 4."""
        seconds = sum(record["seconds"] for record in records)
        parts = int(BATCH_SECONDS * len(records) / max(seconds, 1e-6))
        self._batch_parts = max(1, min(parts, 4 * self._batch_parts, BATCH_PARTS))

    async def _check_output(self, batch: list[_Ready], records: tuple[dict[str, Any], ...]) -> None:
        """Checks that a worker on another machine has written into this output."""
        made = next((record for record in records if record["state"] != FAILED), None)
        if made is None:
            return
        key = f"{batch[made['part']].entry.name}.{made['suffix']}"
        with translate_errors("looking for a file"):
            try:
                await self._output.head(key)
            except FileNotFoundError:
                raise BakeStopped(FILES_ELSEWHERE) from None

    async def _write_record(self) -> None:
        """Writes the record, about once a second; in long bakes less often, so it has few files."""
        now = time.monotonic()
        if now > self._last_write + max(RECORD_SECONDS, (now - self._start) / 1000):
            self._last_write = now
            await self.record.write()


def is_file_name(name: str) -> bool:
    """Whether a name with a suffix is a safe name of a file, in any folder and any bucket."""
    return (
        name.isprintable()
        and 0 < len(name.encode()) <= MAX_NAME
        and not set(name) & set('/\\:*?"<>|')
        and name == name.strip(". ")
        and not _RESERVED.fullmatch(name)
    )
