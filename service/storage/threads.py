"""Threads that open, read and write the files of a store, some of which may hang."""

import asyncio
import errno
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

MAX_THREADS = 40
"""Most files that are opened, read or written at once."""

LEFT_SECONDS = 1.0
"""Seconds in which work whose request was cancelled may still end, until it counts as hanging."""

Result = TypeVar("Result")


@dataclass(slots=True)
class _Left:
    """Work on one file that has not ended, although its requests have.

    `hangs_from`: the time of the monotonic clock from which it counts as hanging. `threads`: how
    many threads have such work.
    """

    hangs_from: float
    threads: int = 0
    ended: asyncio.Event = field(default_factory=asyncio.Event)


class FileThreads:
    """Runs work on files in threads.

    A file hangs if, for example, it is on a network file system whose server is gone. No program
    can end a thread that waits for it. So until that thread ends, further work on this file fails
    at once: each file that hangs takes one thread, however often clients ask for it.

    If a request is only cancelled, for example because its client has disconnected, its work mostly
    ends in a moment: further work on this file waits for it, for `LEFT_SECONDS` at most.
    """

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(MAX_THREADS, "store")
        self._left: dict[str, _Left] = {}

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
            although its deadline has passed, or its request was cancelled a while ago.
        ValueError
            The key could name a file outside the folder.
        """
        if any(part in ("", ".", "..") for part in key.split("/")):
            raise ValueError("a key has names that are joined by `/`")
        while left := self._left.get(key):
            try:
                await asyncio.wait_for(left.ended.wait(), left.hangs_from - time.monotonic())
            except TimeoutError:
                text = "an earlier operation on this file has not ended"
                raise TimeoutError(errno.ETIMEDOUT, text) from None
        thread = self._threads.submit(work, key, *arguments)
        patience = LEFT_SECONDS
        try:
            return await asyncio.wait_for(asyncio.wrap_future(thread), deadline)
        except TimeoutError:
            patience = 0.0
            raise
        finally:
            if not thread.done():
                left = self._left.setdefault(key, _Left(time.monotonic() + patience))
                left.threads += 1
                thread.add_done_callback(partial(self._end, asyncio.get_running_loop(), key))

    def _end(self, loop: asyncio.AbstractEventLoop, key: str, _: Future[object]) -> None:
        """Called by the thread when its work has ended after all."""
        with suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(self._forget, key)

    def _forget(self, key: str) -> None:
        left = self._left[key]
        left.threads -= 1
        if not left.threads:
            del self._left[key]
            left.ended.set()
