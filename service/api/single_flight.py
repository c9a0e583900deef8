"""Single flight: equal requests at the same time wait for the result of one computation."""

import asyncio
from collections.abc import Awaitable, Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from service.api.computation import Callbacks, Computation
from service.api.threads import Threads

Result = TypeVar("Result")


@dataclass(eq=False, slots=True)
class _Flight:
    """One computation, and the number of requests that wait for or use its result."""

    key: Hashable
    computation: Computation
    task: asyncio.Task[Any]
    users: int = 0


class SingleFlight:
    """Running computations by key.

    Each computation ("flight") runs in a task of its own: if the first request is cancelled, the
    other requests still get the result. When no request waits any more, the computation is
    cancelled. If it fails, all waiting requests get its error, and the next request starts another.

    The result stays in memory until the last request no longer uses it; until then, later requests
    share it. So the number of flights is at most the number of requests.
    """

    def __init__(self, threads: Threads) -> None:
        self._threads = threads
        self._flights: dict[Hashable, _Flight] = {}

    def __len__(self) -> int:
        return len(self._flights)

    async def join(
        self,
        key: Hashable,
        work: Callable[[Computation], Awaitable[Result]],
        asker: Computation,
        callbacks: Callbacks,
    ) -> Result:
        """The result of the computation with this key; starts `work` if none is running.

        Parameters
        ----------
        asker : Computation
            The computation that asks. The caller of the first one is charged for the work.
        callbacks : list of callables
            `join` appends one. The caller calls them when it no longer uses the result that `join`
            returned.
        """
        flight = self._flights.get(key)
        if flight is None:
            caller = asker.caller
            computation = Computation(self._threads, find_caller=lambda: caller, is_shared=True)
            flight = self._flights[key] = _Flight(
                key, computation, asyncio.create_task(_run(work, computation))
            )
            flight.task.add_done_callback(partial(self._end_if_failed, flight))
        flight.users += 1
        callbacks.append(partial(self._leave, flight))
        task: asyncio.Task[Result] = flight.task
        try:
            return await asyncio.shield(task)
        finally:
            del flight, task  # the traceback of an error refers to this frame, and so to the result

    def _leave(self, flight: _Flight) -> None:
        """Counts one user less; ends the flight if it was the last user."""
        flight.users -= 1
        if not flight.users:
            self._end(flight)

    def _end_if_failed(self, flight: _Flight, task: asyncio.Task[Any]) -> None:
        """Removes a flight whose computation failed, so that the next request starts another."""
        if task.cancelled() or task.exception() is not None:
            self._end(flight)

    def _end(self, flight: _Flight) -> None:
        """Removes a flight, and cancels its computation."""
        if self._flights.get(flight.key) is flight:
            del self._flights[flight.key]
        flight.task.cancel()
        flight.computation.close()


async def _run(
    work: Callable[[Computation], Awaitable[Result]], computation: Computation
) -> Result:
    """Makes a coroutine, which a task needs, of any awaitable."""
    return await work(computation)
