"""Work that many wait for and one task does."""

import asyncio
from collections.abc import Awaitable, Callable, Hashable
from typing import Any, TypeVar

Result = TypeVar("Result")


class Flights:
    """Work under way, by what it is for.

    A task of its own does the work: whoever asked first may go away, the others get the result
    all the same. What fails, fails for everyone who waits, and the next one tries again.
    """

    def __init__(self) -> None:
        self._tasks: dict[Hashable, asyncio.Task[Any]] = {}

    def __len__(self) -> int:
        return len(self._tasks)

    async def join(self, key: Hashable, work: Callable[[], Awaitable[Result]]) -> Result:
        """The result of the work under this key; `work` is called if there is none under way."""
        task: asyncio.Task[Result] | None = self._tasks.get(key)
        if task is None:
            task = asyncio.get_running_loop().create_task(_awaited(work))
            self._tasks[key] = task
            task.add_done_callback(lambda done: self._landed(key, done))
        return await asyncio.shield(task)

    def _landed(self, key: Hashable, task: asyncio.Task[Any]) -> None:
        del self._tasks[key]
        if not task.cancelled():
            task.exception()  # seen, even where nobody waits for it any more


async def _awaited(work: Callable[[], Awaitable[Result]]) -> Result:
    return await work()
