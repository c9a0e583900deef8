"""Work that many wait for and one task does."""

import asyncio
from collections.abc import Awaitable, Callable, Hashable
from functools import partial
from typing import Any, TypeVar

from service.api.admission.admission import Admission
from service.api.admission.visits import Visit, visiting

Result = TypeVar("Result")


class _Flight:
    """One piece of work, and those who wait for it or use its result."""

    __slots__ = ("key", "task", "users", "visit")

    def __init__(self, key: Hashable, visit: Visit) -> None:
        self.key = key
        self.visit = visit
        self.users = 0
        self.task: asyncio.Task[Any]


class Flights:
    """Work under way, by what it is for.

    A task of its own does the work: whoever asked first may go away, the others get the result
    all the same. When the last one has gone the work is stopped, and what comes then begins anew.
    What fails, fails for everyone who waits, and the next one tries again.

    Whoever asked uses the result until its own visit ends, or its work is done; so long it takes
    memory, and is shared with those who come later. There are no more flights than requests.
    """

    def __init__(self, admission: Admission) -> None:
        self._admission = admission
        self._flights: dict[Hashable, _Flight] = {}

    def __len__(self) -> int:
        return len(self._flights)

    async def join(
        self,
        key: Hashable,
        work: Callable[[], Awaitable[Result]],
        *,
        sent: bool = False,
    ) -> Result:
        """The result of the work under this key; `work` is called if there is none under way.

        It is used as long as something is computed from it; if it is `sent`, until it is there.
        """
        flight = self._flights.get(key)
        if flight is None:
            flight = self._flights[key] = _Flight(key, Visit(self._admission))
            flight.task = asyncio.create_task(_flown(flight.visit, work))
            flight.task.add_done_callback(partial(self._landed, flight))
        flight.users += 1
        visit = visiting()
        (visit.until_end if sent else visit.while_working)(partial(self._leave, flight))
        task: asyncio.Task[Result] = flight.task
        try:
            return await asyncio.shield(task)
        finally:
            del flight, task  # an error of theirs has this frame

    def _leave(self, flight: _Flight) -> None:
        """One who waited for the result, or used it, does so no longer."""
        flight.users -= 1
        if not flight.users:
            self._end(flight)

    def _landed(self, flight: _Flight, task: asyncio.Task[Any]) -> None:
        if task.cancelled() or task.exception() is not None:
            self._end(flight)

    def _end(self, flight: _Flight) -> None:
        """Nobody can join it any more."""
        if self._flights.get(flight.key) is flight:
            del self._flights[flight.key]
        flight.task.cancel()
        flight.visit.close()


async def _flown(visit: Visit, work: Callable[[], Awaitable[Result]]) -> Result:
    with visit.current():
        return await work()
