"""Memory that large requests leave behind is handed back to the system soon after they are over."""

import asyncio
from collections.abc import Callable

from anyio import CapacityLimiter, to_thread

from service.settings.process import give_back

LARGE = 4 << 20
"""Bytes of a request that is worth it."""

PAUSE = 0.25
"""Seconds from the end of such a request: others may end in the meantime."""


class Thrift:
    """Has it done once for all that end together, in a thread: it takes milliseconds.

    Parameters
    ----------
    work : Callable
        What hands the memory back.
    """

    def __init__(self, work: Callable[[], None] = give_back) -> None:
        self._work = work
        self._limiter = CapacityLimiter(1)
        self._task: asyncio.Task[None] | None = None

    def ended(self, most: int) -> None:
        """A request is over that had so many bytes."""
        if most >= LARGE and self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._later())

    async def _later(self) -> None:
        await asyncio.sleep(PAUSE)
        self._task = None  # what ends from now on may come too late for this one
        await to_thread.run_sync(self._work, limiter=self._limiter)
