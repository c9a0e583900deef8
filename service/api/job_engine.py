"""The jobs of an application: their store, their engine, and their share of the memory."""

import asyncio
import logging
import shutil
import tempfile
import weakref
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, nullcontext

from service.api.threads import Threads
from service.jobs.dispatch import Reserve
from service.jobs.engine import Engine
from service.jobs.engines import open_cluster
from service.jobs.manager import Jobs
from service.jobs.pool import ProcessEngine
from service.settings.values import Settings
from service.settings.workers import IN_MEMORY
from service.storage.address import open_store
from service.storage.store import SurfaceStore

MEMORY_PAUSE = 0.05
"""Seconds between two looks whether there is room for a batch."""

NICENESS = 10
"""How much lower than that of requests the priority of job processes is, so that requests keep
their processors."""

_log = logging.getLogger(__name__)


def build_jobs(settings: Settings, store: SurfaceStore, threads: Threads) -> Jobs | None:
    """The jobs, in the store of the surfaces; None if the settings switch jobs off.

    Job processes cannot read the memory of this one: if the store is `memory://`, jobs are kept in
    a temporary folder, which is removed at the end.
    """
    if not settings.jobs:
        return None
    folder = ""
    if settings.store.startswith(IN_MEMORY):
        try:
            folder = tempfile.mkdtemp(prefix="surface-jobs-")
        except OSError as error:
            _log.warning("there are no jobs: no temporary folder can be made (%s)", error)
            return None
    backend = open_store(folder, 0).backend if folder else store.backend
    engine, reserve = open_engine(settings, JobMemory(threads))
    jobs = Jobs(
        folder or settings.store,
        backend,
        settings,
        engine,
        accounts=threads.accounts,
        reserve=reserve,
    )
    if folder:
        jobs.dispatcher.surfaces = store
        jobs.on_close = weakref.finalize(jobs, shutil.rmtree, folder, ignore_errors=True)
    return jobs


def open_engine(settings: Settings, memory: "JobMemory") -> tuple[Engine, Reserve]:
    """The engine, and how batches reserve memory: on a cluster they take none of this machine."""
    if settings.dask:
        return open_cluster(settings), lambda _: nullcontext()
    return ProcessEngine(settings.job_process_count, memory.capacity, NICENESS), memory.reserve


class JobMemory:
    """The memory in which batches work: at most half of that of all requests.

    Batches get it in the order in which they ask for it, and leave the memory free that a request
    claims (`Threads`): so neither large batches nor large requests wait for ever.

    Attributes
    ----------
    capacity : int
        Most bytes of all batches together.
    """

    def __init__(self, threads: Threads) -> None:
        self.capacity = threads.capacity // 2
        self._threads = threads
        self._used = 0
        self._turn = asyncio.Lock()

    @asynccontextmanager
    async def reserve(self, amount: int) -> AsyncIterator[None]:
        """Holds `amount` bytes for the `with` block, at most all; waits until they are free."""
        amount = min(amount, self.capacity)
        async with self._turn:
            while not self._has_room(amount):
                await asyncio.sleep(MEMORY_PAUSE)
            self._hold(amount)
        try:
            yield
        finally:
            self._hold(-amount)

    def _has_room(self, amount: int) -> bool:
        threads = self._threads
        is_free = self._used + amount <= self.capacity and threads.has_room(amount)
        return is_free and threads.may_pass(amount)

    def _hold(self, amount: int) -> None:
        self._used += amount
        self._threads.passed_bytes += amount
        self._threads.hold(amount)
