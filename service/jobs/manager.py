"""The jobs of a service: what its routes and its lifespan call."""

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from types import TracebackType
from typing import Self

from service.errors import Issue, SurfaceError, TooManyJobs, UnknownJob
from service.fair.accounts import Accounts
from service.jobs.askers import Askers
from service.jobs.batch import Task
from service.jobs.checks import CheckedPart
from service.jobs.dispatch import Dispatcher, Reserve
from service.jobs.engine import Engine
from service.jobs.expiry import delete_expired
from service.jobs.files import JobFiles
from service.jobs.intake import PartWriter
from service.jobs.limits import part_limits
from service.jobs.open_job import OpenJob
from service.jobs.owners import BEAT_SECONDS, Owners
from service.jobs.reading import JobReader, unknown_job
from service.jobs.results import Result
from service.jobs.sources import SourceFiles
from service.jobs.state import JobState, PartResult
from service.jobs.usage import JobUsage
from service.jobs.work import Work
from service.settings.values import Settings
from service.storage.backends import Backend, reserve_nothing

WATCH_SECONDS = 0.5
"""Seconds between two looks at the state of a job that a client watches."""

SAVE_SECONDS = 1.0
"""Seconds between two looks at which open jobs have changed, or have been withdrawn elsewhere."""

MAINTENANCE_SECONDS = 3600.0
"""Seconds between two searches for what has expired."""

READERS = 8
"""The most states that a list of jobs reads at once."""

_log = logging.getLogger(__name__)


class Jobs:
    """The jobs of one instance, and those of the others in the store.

    Parameters
    ----------
    address : str
        The address of the store, which processes of the engine open themselves.
    backend : Backend
        The same store.
    settings : Settings
    engine : Engine
    accounts : Accounts
        Callers are charged for their batches here, and served in this order.
    reserve : callable
        Reserves memory for a batch.

    Attributes
    ----------
    usage : JobUsage
    sources : SourceFiles
    dispatcher : Dispatcher
    on_close : callable
        Called when all batches have ended.
    """

    def __init__(
        self,
        address: str,
        backend: Backend,
        settings: Settings,
        engine: Engine,
        *,
        accounts: Accounts,
        reserve: Reserve,
    ) -> None:
        files = self._files = JobFiles(backend)
        self._settings = settings
        self._reader = JobReader(files, settings.job_lifetime)
        self._askers = Askers(files)
        self.on_close: Callable[[], object] = lambda: None
        timeout = settings.job_part_timeout
        self.usage = JobUsage(files, settings.job_quota)
        self.sources = SourceFiles(files, self.usage, settings.job_lifetime)
        self.dispatcher = Dispatcher(
            files,
            engine,
            self.usage,
            Task((), address, part_limits(settings), timeout, lifetime=settings.job_lifetime),
            accounts=accounts,
            reserve=reserve,
        )
        self._owners = Owners(files)
        self._work = Work(files, self._reader, self._askers, self._owners, self.dispatcher)

    @property
    def open_jobs(self) -> Sequence[OpenJob]:
        """The jobs that this instance works on."""
        return tuple(self._work.open.values())

    async def run(self) -> None:
        """Works on jobs until cancelled; then ends all batches and leaves its jobs to others."""
        try:
            await asyncio.gather(
                _repeat(self._owners.beat, BEAT_SECONDS),
                _repeat(self._work.look, BEAT_SECONDS),
                _repeat(self._work.save, SAVE_SECONDS),
                _repeat(self._maintain, MAINTENANCE_SECONDS),
            )
        finally:
            await self._work.close()
            self.on_close()

    def start_intake(self, caller: str) -> "Intake":
        """Takes the parts of a job of this caller, in an `async with` block."""
        parts = PartWriter(self._files, self.usage, self._settings.max_job_parts)
        return Intake(partial(self._check_caller, caller), caller, parts, self._work)

    async def state(self, id: str) -> JobState:
        """The state of a job.

        Raises
        ------
        UnknownJob
        """
        job = self._work.open.get(id)
        if job and not job.running:  # `save` looks only at those that run
            with suppress(SurfaceError):
                await self._work.look_for_withdrawal(job)
        if job := self._work.open.get(id):
            return job.state(self.dispatcher.waiting_for)
        state = await self._reader.state(id)
        if state.has_ended and state.expires < datetime.now(UTC):
            raise unknown_job()
        return replace(state, waiting_for="wrong_engine") if id in self._work.stranded else state

    async def watch(self, id: str) -> AsyncIterator[JobState]:
        """Each change of a job's state, at most two a second; ends after the end of the job.

        Raises
        ------
        UnknownJob
        """
        state = await self.state(id)
        yield state
        while not state.has_ended:
            await asyncio.sleep(WATCH_SECONDS)
            last, state = state, await self.state(id)
            if state != last:
                yield state

    async def withdraw(self, id: str, caller: str) -> None:
        """Lets a caller wait for a job no longer; if no other caller waits for it, it ends.

        Raises
        ------
        UnknownJob
        """
        await self.state(id)
        await self._work.withdraw(id, caller)

    async def results(self, state: JobState, first: int, limit: int) -> Sequence[PartResult]:
        """The parts of the job with this state, from the index `first`, at most `limit`.

        Raises
        ------
        UnknownJob
        """
        job, manifest = self._work.open.get(state.id), await self._reader.manifest(state.id)
        if manifest is None:
            raise unknown_job()
        running = job.running if job else set()
        return await self._reader.results(manifest, state, running, first, limit)

    async def content(
        self, id: str, part: PartResult, reserve: Callable[[int], None] = reserve_nothing
    ) -> tuple[Result, memoryview]:
        """The result of a part of the job `id`, of those that `results` lists, and its bytes.

        Parameters
        ----------
        reserve : callable
            Called with the number of bytes before they are read; if it raises, nothing is read.

        Raises
        ------
        UnknownResult
            The part has not succeeded. Or its bytes are damaged or gone; then it is computed again
            when the job is asked for again.
        """
        return await self._reader.content(id, part, reserve)

    async def list(self, caller: str | None) -> Sequence[JobState]:
        """The jobs of a caller, or of all if it is None, the newest first."""
        readers = asyncio.Semaphore(READERS)

        async def read(id: str) -> JobState | None:
            async with readers:
                try:
                    return await self.state(id)
                except UnknownJob:  # it has expired
                    return None

        ids = await self._askers.jobs_of(caller)
        states = [state for state in await asyncio.gather(*map(read, ids)) if state]
        return sorted(states, key=lambda state: state.created, reverse=True)

    async def _check_caller(self, caller: str) -> None:
        """Raises an error if a caller may not have another job."""
        most = self._settings.max_jobs
        if await self._askers.count_open(caller) >= most:
            message = "You have the largest number of jobs that have not ended."
            raise TooManyJobs(Issue("too_many_jobs", message, needed=f"at most {most} jobs"))
        await self.usage.check_room(1)

    async def _maintain(self) -> None:
        await delete_expired(self._files, self._settings.job_lifetime)
        await self.usage.recount()


class Intake:
    """Takes the parts of a job: an `async with` block that removes them unless it has finished."""

    def __init__(
        self, check: Callable[[], Awaitable[None]], caller: str, parts: PartWriter, work: Work
    ) -> None:
        self._check = check
        self._caller = caller
        self._parts = parts
        self._work = work
        self._accepting: asyncio.Task[tuple[JobState, bool]] | None = None

    async def __aenter__(self) -> Self:
        await self._check()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        with suppress(SurfaceError):  # this block, or `finish`, raises its own error
            if self._accepting is not None:
                await asyncio.shield(self._accepting)
                return
        with suppress(SurfaceError):
            await asyncio.shield(self._parts.delete())

    async def add(self, checked: Sequence[CheckedPart]) -> None:
        """Adds parts behind those that were added before.

        Raises
        ------
        TooLarge, JobQuotaFull, StoreFull, StoreFailed
        """
        await self._parts.add(checked)

    async def finish(self) -> tuple[JobState, bool]:
        """Accepts the job: from now on nothing loses it. Returns whether it is new.

        If this is cancelled, the job is accepted all the same.

        Raises
        ------
        TooManyJobs, JobQuotaFull, StoreFull, StoreFailed
        """
        id = await self._parts.finish()
        self._accepting = asyncio.create_task(self._accept(id))
        return await asyncio.shield(self._accepting)

    async def _accept(self, id: str) -> tuple[JobState, bool]:
        async with self._work.lock(self._caller):  # several intakes may have begun at once
            await self._check()
            return await self._work.accept(id, self._caller, self._parts)


async def _repeat(action: Callable[[], Awaitable[None]], pause: float) -> None:
    """Does something again and again; errors do not end it."""
    while True:
        try:
            await action()
        except SurfaceError:
            pass  # `translate_errors` has logged it
        except Exception:
            _log.exception("jobs go on after an error")
        await asyncio.sleep(pause)
