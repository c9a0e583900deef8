"""Gives batches of jobs to the engine, in turn between callers.

The caller that has used the fewest seconds is served first (`service.fair`); requests in threads
are charged to the same accounts. If a batch cannot run, because the disk is full, say, no batch
begins for 10 s; the states of all jobs name the reason until a batch has ended.
"""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, AsyncExitStack, suppress
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from service.errors import (
    DamagedObject,
    Issue,
    JobQuotaFull,
    StoreFailed,
    StoreFull,
    SurfaceError,
    UnknownSurface,
)
from service.fair.accounts import Accounts
from service.fair.queue import FairQueue
from service.jobs.attempts import failed_record, run_task
from service.jobs.batch import CANCELLED, DONE, STORE_FAILED, SUCCEEDED, Task
from service.jobs.engine import Engine, EngineUnavailable
from service.jobs.files import JobFiles
from service.jobs.keys import intake_key, results_key
from service.jobs.open_job import OpenJob
from service.jobs.parts import stored_surface
from service.jobs.records import read_lines, write_records
from service.jobs.usage import JobUsage
from service.storage.keys import key_of
from service.storage.store import SurfaceStore

RETRY_SECONDS = 10.0
"""Time after which work that could not be done is tried again."""

KILL_SECONDS = 1.5
"""Time after a cancellation after which a batch that still runs is ended with its process. Batches
end by themselves, at their next checkpoint, when they see that no caller waits for the job."""

Reserve = Callable[[int], AbstractAsyncContextManager[None]]
"""Reserves memory for a `with` block; waits until it is free."""

_log = logging.getLogger(__name__)


class Dispatcher:
    """Runs the batches of open jobs.

    Parameters
    ----------
    task : Task
        What all tasks have in common.

    Attributes
    ----------
    on_change : callable
        Called when a batch of the job has ended, or has stopped.
    on_cancelled : callable
        Awaited when a batch has ended because no caller waits for the job, as the store says.
    surfaces : SurfaceStore or None
        The store of surfaces, if processes of the engine cannot read it.
    waiting_for : str
        Why no batch can run at the moment, as a code; empty if batches can run.
    parts : dict
        Parts that have ended since the start, by their outcome.
    seconds : float
        Seconds of a process that batches have taken since the start.
    """

    def __init__(
        self,
        files: JobFiles,
        engine: Engine,
        usage: JobUsage,
        task: Task,
        *,
        accounts: Accounts,
        reserve: Reserve,
    ) -> None:
        self.on_change: Callable[[OpenJob], None]
        self.on_cancelled: Callable[[OpenJob], Awaitable[None]]
        self.surfaces: SurfaceStore | None = None
        self.waiting_for = ""
        self.parts = {"succeeded": 0, "failed": 0}
        self.seconds = 0.0
        self._files = files
        self._engine = engine
        self._accounts = accounts
        self._reserve = reserve
        self._usage = usage
        self._task = task
        self._queue: FairQueue[OpenJob] = FairQueue(accounts)
        self._tasks: dict[tuple[OpenJob, int], asyncio.Task[None]] = {}
        self._is_paused = False
        self._is_closed = False

    @property
    def busy_count(self) -> int:
        """The number of batches that run."""
        return self._queue.busy_count

    def add(self, job: OpenJob) -> None:
        """Lets a job wait for its turn if batches are missing, unless it is cancelled."""
        if job.has_missing and not (job.is_cancelled or job.is_queued):
            job.is_queued = True
            self._queue.add(job.caller, job)
        self.start_queued()

    def take_out(self, job: OpenJob) -> None:
        """Lets a job wait no more; its batches that run, run on."""
        if job.is_queued:
            job.is_queued = False
            self._queue.remove(job.caller, job)

    def cancel(self, job: OpenJob) -> None:
        """Ends the batches of a cancelled job, by force those that do not end themselves."""
        self.take_out(job)
        for number in job.running:
            task = self._tasks[job, number]
            asyncio.get_running_loop().call_later(KILL_SECONDS, _cancel_if_cancelled, job, task)

    def start_queued(self) -> None:
        """Starts batches, in turn, while the engine has free slots."""
        while not (self._is_paused or self._is_closed) and self._start_next():
            pass

    async def close(self) -> None:
        """Ends all batches; their parts run again when another instance takes the jobs over."""
        self._is_closed = True
        for task in self._tasks.values():
            task.cancel()
        await asyncio.gather(*self._tasks.values(), return_exceptions=True)
        await self._engine.close()

    def _start_next(self) -> bool:
        if self.busy_count >= self._engine.slots:
            return False
        for caller in self._queue.in_turn():
            if not self._may_compute(caller):
                continue
            job = self._queue.first(caller)
            number = job.begin_next()
            self._queue.take_thread(caller)
            if not job.has_missing:
                self.take_out(job)
            task = asyncio.get_running_loop().create_task(self._run(job, number, caller))
            self._tasks[job, number] = task
            return True
        return False

    def _may_compute(self, caller: str) -> bool:
        """Whether the caller's compute limit leaves anything; `start_queued` asks again."""
        limit = self._accounts.limit
        return limit is None or not limit.state(caller).retry_after

    async def _run(self, job: OpenJob, number: int, caller: str) -> None:
        try:
            end = await self._run_or_fail(job, number, caller)
            if end in (DONE, CANCELLED):
                self.waiting_for = ""
            else:
                self._pause(end)
            if end == CANCELLED:
                await self.on_cancelled(job)
        except asyncio.CancelledError:
            if not job.is_cancelled:
                raise
        except (StoreFull, StoreFailed) as error:  # when the failure was to be kept
            self._pause(_REASONS[type(error)])
        finally:
            del self._tasks[job, number]
            if number in job.running:
                job.stop(number)
            self._queue.return_thread(caller)
            if not self._is_closed:
                self.add(job)
                self.on_change(job)
                self.start_queued()

    async def _run_or_fail(self, job: OpenJob, number: int, caller: str) -> str:
        """Runs a batch; after an unexpected error its parts fail, and other batches go on."""
        try:
            return await self._run_batch(job, number, caller)
        except EngineUnavailable as error:
            return error.reason
        except (StoreFull, StoreFailed, JobQuotaFull) as error:
            return _REASONS[type(error)]
        except Exception as error:
            _log.error("a batch of a job could not be run", exc_info=error)
            issue = Issue("internal_error", "The part failed; the log says why.")
            await self._fail(job, number, issue)
            return DONE

    async def _fail(self, job: OpenJob, number: int, issue: Issue) -> None:
        """Lets all parts of a batch fail with one issue."""
        batch = job.manifest.batches[number]
        parts = range(batch.first, batch.first + batch.parts)
        error = SurfaceError(issue)
        await self._keep(job, number, [failed_record({"part": part}, error) for part in parts])

    async def _run_batch(self, job: OpenJob, number: int, caller: str) -> str:
        """Runs a batch, and keeps its records; returns how it ended (`service.jobs.batch`)."""
        batch, folder = job.manifest.batches[number], job.manifest.folder
        await self._usage.check_room(1)
        content = await self._files.read(intake_key(folder, number))
        if content is None:
            _log.error("the parts of the batch %d of the job %s are gone", number, job.id)
            issue = Issue("damaged_object", "The request of the part is lost.")
            await self._fail(job, number, issue)
            return DONE
        lines = await asyncio.to_thread(read_lines, content)
        if self.surfaces is not None:
            await self._copy_surfaces(lines, self.surfaces)
        async with AsyncExitStack() as stack:
            with self._accounts.pause(caller):
                await stack.enter_async_context(self._reserve(batch.memory))
            task = replace(self._task, job=job.id, lines=tuple(lines))
            start = time.monotonic()
            try:
                result = await run_task(self._engine, task)
            finally:
                self.seconds += time.monotonic() - start
        if result.end == DONE:
            names = {line["part"]: line["name"] for line in lines if "name" in line}
            await self._keep(job, number, result.records, names)
        return result.end

    async def _copy_surfaces(self, lines: Sequence[Mapping[str, Any]], store: SurfaceStore) -> None:
        """Copies the stored surfaces that parts name to where processes of the engine find them."""
        for id in {stored_surface(line["path"]) for line in lines if "body" not in line} - {""}:
            with suppress(UnknownSurface, DamagedObject):  # the part fails with this error
                await self._files.write(key_of(id), await store.get(id))

    async def _keep(
        self,
        job: OpenJob,
        number: int,
        records: Sequence[Mapping[str, Any]],
        names: Mapping[int, str] = MappingProxyType({}),
    ) -> None:
        """Stores the records of a batch, and counts it as ended; `names` as in `write_records`."""
        content = write_records(records, names)
        await self._files.write(results_key(job.id, number), content)
        succeeded = [record for record in records if record["state"] == SUCCEEDED]
        self._usage.add(len(content) + sum(record["bytes"] for record in succeeded))
        counts = len(succeeded), len(records) - len(succeeded)
        for outcome, count in zip(self.parts, counts, strict=True):
            self.parts[outcome] += count
        job.end(number, *counts)

    def _pause(self, reason: str) -> None:
        """Starts no batch for a while."""
        self.waiting_for = reason
        if not self._is_paused:
            _log.warning("jobs wait: %s", reason)
            self._is_paused = True
            asyncio.get_running_loop().call_later(RETRY_SECONDS, self._resume)

    def _resume(self) -> None:
        self._is_paused = False
        self.start_queued()


def _cancel_if_cancelled(job: OpenJob, task: asyncio.Task[None]) -> None:
    if job.is_cancelled:  # no caller has asked for it again
        task.cancel()


_REASONS: Mapping[type[Exception], str] = {
    StoreFull: "disk_full",
    StoreFailed: STORE_FAILED,
    JobQuotaFull: "job_quota_full",
}
