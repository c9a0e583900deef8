"""Computations that several requests wait for and one task does ("single flight")."""

import asyncio
from collections.abc import Awaitable, Callable, Hashable
from functools import partial
from typing import Any, TypeVar

from service.api.workers import Callbacks, Job, Workers

Result = TypeVar("Result")


class _Flight:
    """One computation, and the number of requests that wait for it or use its result."""

    __slots__ = ("job", "key", "task", "users")

    def __init__(self, key: Hashable, job: Job) -> None:
        self.key = key
        self.job = job
        self.users = 0
        self.task: asyncio.Task[Any]


class Flights:
    """Computations under way, by what they are for.

    A task of its own computes: the request that came first may be cancelled, the others get the
    result all the same. When the last one has gone the computation is stopped, and a request that
    comes then begins anew. An error is raised in all requests that wait; the next one tries again.

    A request uses the result until the end that it names; so long the result takes memory, and
    later requests share it. There are no more flights than requests.
    """

    def __init__(self, workers: Workers) -> None:
        self._workers = workers
        self._flights: dict[Hashable, _Flight] = {}

    def __len__(self) -> int:
        return len(self._flights)

    async def join(
        self, key: Hashable, work: Callable[[Job], Awaitable[Result]], until: Callbacks
    ) -> Result:
        """The result of the computation under this key; `work` begins it if there is none.

        Parameters
        ----------
        until : list of callbacks
            The request uses the result until they are called; one more is added here.
        """
        flight = self._flights.get(key)
        if flight is None:
            flight = self._flights[key] = _Flight(key, Job(self._workers))
            flight.task = asyncio.create_task(_run(work, flight.job))
            flight.task.add_done_callback(partial(self._landed, flight))
        flight.users += 1
        until.append(partial(self._leave, flight))
        task: asyncio.Task[Result] = flight.task
        try:
            return await asyncio.shield(task)
        finally:
            del flight, task  # an error of theirs refers to this frame

    def _leave(self, flight: _Flight) -> None:
        """One request neither waits for the result nor uses it any longer."""
        flight.users -= 1
        if not flight.users:
            self._end(flight)

    def _landed(self, flight: _Flight, task: asyncio.Task[Any]) -> None:
        if task.cancelled() or task.exception() is not None:
            self._end(flight)

    def _end(self, flight: _Flight) -> None:
        """No request can join it any more."""
        if self._flights.get(flight.key) is flight:
            del self._flights[flight.key]
        flight.task.cancel()
        flight.job.close()


async def _run(work: Callable[[Job], Awaitable[Result]], job: Job) -> Result:
    return await work(job)
