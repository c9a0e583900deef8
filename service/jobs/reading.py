"""Reads jobs from the store, whichever instance works on them."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from typing import Any

from service.errors import DamagedObject, Issue, UnknownJob, UnknownResult
from service.jobs.files import JobFiles
from service.jobs.keys import (
    cancelled_key,
    intake_key,
    manifest_key,
    part_key,
    results_key,
    state_key,
)
from service.jobs.manifest import Manifest, decode_manifest
from service.jobs.records import read_lines, read_record
from service.jobs.results import Result, read_object
from service.jobs.state import JobState, PartResult, StateName, decode_state
from service.storage.keys import is_id


class JobReader:
    """Reads manifests, states and results.

    Parameters
    ----------
    lifetime : float
        Seconds for which the results of a job are kept after its end.
    """

    def __init__(self, files: JobFiles, lifetime: float) -> None:
        self._files = files
        self.lifetime = lifetime

    async def manifest(self, id: str) -> Manifest | None:
        """The manifest of a job; None if there is none, or the results have expired."""
        content = await self._files.read(manifest_key(id))
        return None if content is None else await asyncio.to_thread(decode_manifest, content)

    async def state(self, id: str) -> JobState:
        """The state of a job, as its owner last stored it.

        Raises
        ------
        UnknownJob
        """
        if not is_id(id):
            raise unknown_job()
        content = await self._files.read(state_key(id))
        state = None if content is None else decode_state(content)
        if state is None:
            manifest = await self.manifest(id)
            if manifest is None:
                raise unknown_job()
            state = queued_state(manifest, self.lifetime)
        if not state.has_ended and await self._files.has(cancelled_key(id)):
            return replace(state, state="cancelled", seconds_left=None)
        return state

    async def results(
        self, manifest: Manifest, state: JobState, running: set[int], first: int, limit: int
    ) -> list[PartResult]:
        """The parts from `first`, at most `limit`; `running` are the batches that run."""
        results: list[PartResult] = []
        if first >= manifest.total:
            return results
        begin, end = manifest.batch_of(first), manifest.batch_of(first + limit - 1)
        for number in range(begin, end + 1):
            pending: StateName = "running" if number in running else "queued"
            if state.state == "cancelled":
                pending = "cancelled"
            results += await self._batch(manifest, number, pending)
        offset = first - manifest.batches[begin].first
        return results[offset : offset + limit]

    async def content(
        self, id: str, part: PartResult, reserve: Callable[[int], None]
    ) -> tuple[Result, memoryview]:
        """The result of a part of the job `id`, and its bytes; `reserve` as in `Backend.read`.

        Raises
        ------
        UnknownResult
            The part has not succeeded. Or its bytes are damaged or gone; then it is computed again
            when the job is asked for again.
        """
        file_of(part)
        stored = await self._files.read(part_key(part.id), reserve)
        try:
            if stored is None:
                raise DamagedObject
            return await asyncio.to_thread(read_object, stored)
        except DamagedObject:
            await self._files.delete(part_key(part.id))
            if (manifest := await self.manifest(id)) is not None:
                await self._files.delete(results_key(id, manifest.batch_of(part.part)))
            message = "The file is damaged or gone. Post the job again: then it is computed again."
            raise unknown_result(message) from None

    async def records(self, manifest: Manifest, number: int) -> list[dict[str, Any]] | None:
        """The records of a batch, in the order of the parts.

        None if the batch has not ended, or if a power failure has damaged its records.
        """
        content = await self._files.read(results_key(manifest.id, number))
        try:
            records = read_lines(content or b"")
        except ValueError:
            return None
        if len(records) != manifest.batches[number].parts:
            return None
        return sorted(records, key=lambda record: int(record["part"]))

    async def _batch(self, manifest: Manifest, number: int, pending: StateName) -> list[PartResult]:
        """The parts of a batch; `pending` is their state if it has not ended."""
        records = await self.records(manifest, number)
        if records is not None:
            return [read_record(record) for record in records]
        content = await self._files.read(intake_key(manifest.folder, number))
        if content is None:  # lost: they fail when the batch runs
            first, count, _ = manifest.batches[number]
            return [PartResult(part, "", "", pending) for part in range(first, first + count)]
        parts = await asyncio.to_thread(read_lines, content)
        return [
            PartResult(part["part"], part["id"], part.get("name", ""), pending) for part in parts
        ]


def unknown_job() -> UnknownJob:
    """The error for an id that no job has."""
    return UnknownJob(
        Issue("unknown_job", "No job has this id, or its results have expired.", "/id")
    )


def unknown_result(message: str) -> UnknownResult:
    """The error for a part without a result."""
    return UnknownResult(Issue("unknown_result", message, "/part"))


def file_of(part: PartResult) -> Result:
    """The properties of the file of a part.

    Raises
    ------
    UnknownResult
        The part has not succeeded.
    """
    if part.error is not None:
        raise unknown_result("This part has failed; the list of results says why.")
    if part.result is None:
        raise unknown_result("This part has no result yet.")
    return part.result


def queued_state(manifest: Manifest, lifetime: float) -> JobState:
    """The state of a job that no instance has begun."""
    return JobState(
        id=manifest.id,
        state="queued",
        engine=manifest.engine,
        total=manifest.total,
        queued=manifest.total,
        running=0,
        succeeded=0,
        failed=0,
        created=manifest.created,
        started=None,
        ended=None,
        expires=manifest.created + timedelta(seconds=lifetime),
    )
