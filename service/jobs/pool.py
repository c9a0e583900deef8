"""The engine of this machine: processes that compute batches beside the requests.

Each slot has a process of its own, a `ProcessPoolExecutor` with one worker: a process that dies
costs its own batch and no other. Processes start with the first batch, and end after a minute
without work.
"""

import asyncio
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress

from service.jobs.batch import run_batch
from service.jobs.engine import EngineLost, EngineUnavailable
from service.jobs.preparation import prepare

IDLE_SECONDS = 60.0
"""Time after which a process without work ends."""


class ProcessEngine:
    """Runs tasks in processes that end when this process does.

    Parameters
    ----------
    processes : int
        The most processes.
    memory : int
        The bytes of memory by which each process bounds its caches, as the service does.
    niceness : int
        How much lower than that of this process their priority is (nice(2)).
    """

    def __init__(self, processes: int, memory: int, niceness: int = 0) -> None:
        self.slots = processes
        self._free = [_Process(memory, niceness) for _ in range(processes)]
        self._all = tuple(self._free)
        self._turns = asyncio.Semaphore(processes)

    @property
    def processes(self) -> list[int]:
        """The ids of the processes that exist now."""
        return [process.pid for process in self._all if process.pid]

    async def run(self, task: bytes) -> bytes:
        """Runs a task in a free process, or waits for one (`Engine.run`)."""
        async with self._turns:
            process = self._free.pop()  # the one that has run last
            try:
                return await process.run(run_batch, task)
            finally:
                self._free.append(process)

    async def close(self) -> None:
        """Ends all processes at once."""
        await asyncio.gather(*(process.kill() for process in self._all))


class _Process:
    """The process of one slot; `pid` is 0 while there is none."""

    def __init__(self, memory: int, niceness: int) -> None:
        self.pid = 0
        self._preparation = memory, niceness
        self._pool: ProcessPoolExecutor | None = None
        self._idle: asyncio.TimerHandle | None = None

    async def run(self, work: Callable[[bytes], bytes], task: bytes) -> bytes:
        if self._idle is not None:
            self._idle.cancel()
        try:
            pool = self._pool or await self._start()
            result = await asyncio.wrap_future(pool.submit(work, task))
        except BrokenProcessPool:
            await self.kill()
            raise EngineLost from None
        except asyncio.CancelledError:
            await asyncio.shield(self.kill())
            raise
        self._idle = asyncio.get_running_loop().call_later(IDLE_SECONDS, self._end)
        return result

    async def _start(self) -> ProcessPoolExecutor:
        """Starts the process: in a thread, because it takes a moment until the process answers."""
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(1, context, prepare, self._preparation)
        self._pool = pool
        try:
            self.pid = await asyncio.to_thread(_start_process, pool)
        except (OSError, BrokenProcessPool):
            await self.kill()
            raise EngineUnavailable("job_process") from None
        return pool

    def _end(self) -> None:
        """Lets the process end by itself."""
        if self._pool is not None:
            self._pool.shutdown(wait=False)
        self._pool, self.pid = None, 0

    async def kill(self) -> None:
        """Ends the process, whatever it does, and waits until it has ended."""
        pool, pid = self._pool, self.pid
        self._pool, self.pid = None, 0
        if pool is not None:
            if pid:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            await asyncio.to_thread(pool.shutdown)


def _start_process(pool: ProcessPoolExecutor) -> int:
    """Starts the process of a pool; returns its id.

    Ctrl-C in a terminal reaches every process, also one that has not run `prepare` yet. So this
    thread blocks the signal meanwhile, and the process inherits that.
    """
    if sys.platform == "win32":
        return pool.submit(os.getpid).result()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    try:
        return pool.submit(os.getpid).result()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
