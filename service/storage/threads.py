"""Threads that open, read and write the files of a store, some of which may hang."""

import asyncio
import errno
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import TypeVar

MAX_THREADS = 40
"""Most files that are opened, read or written at once."""

Result = TypeVar("Result")


class FileThreads:
    """Runs work on files in threads.

    A file hangs if, for example, it is on a network file system whose server is gone. No program
    can end a thread that waits for it. So until that thread ends, further work on this file fails
    at once: each file that hangs takes one thread, however often clients ask for it.
    """

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(MAX_THREADS, "store")
        self._hanging: Counter[str] = Counter()

    async def run(
        self,
        key: str,
        work: Callable[..., Result],
        *arguments: object,
        deadline: float | None = None,
    ) -> Result:
        """The result of `work(key, *arguments)`.

        Raises
        ------
        TimeoutError
            The work takes more than `deadline` seconds; or earlier work on this key still runs,
            although its deadline has passed or its request has ended.
        ValueError
            The key could name a file outside the folder.
        """
        if any(part in ("", ".", "..") for part in key.split("/")):
            raise ValueError("a key has names that are joined by `/`")
        if self._hanging[key]:
            raise TimeoutError(errno.ETIMEDOUT, "an earlier operation on this file has not ended")
        thread = self._threads.submit(work, key, *arguments)
        try:
            return await asyncio.wait_for(asyncio.wrap_future(thread), deadline)
        finally:
            if not thread.done():
                self._hanging[key] += 1
                end = partial(self._end_hanging, asyncio.get_running_loop(), key)
                thread.add_done_callback(end)

    def _end_hanging(self, loop: asyncio.AbstractEventLoop, key: str, _: Future[object]) -> None:
        """Called by the thread when its work has ended after all."""
        with suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(self._hanging.subtract, (key,))
