"""So much of something, bytes or threads, that is lent and given back."""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from service.api.admission.busy import Busy


class Tenant(Protocol):
    """What lives in the room that nobody else needs."""

    @property
    def fixed(self) -> int:
        """What it cannot give up right now."""
        ...

    def resize(self, room: int) -> None:
        """Keeps from now on to so much, `fixed` aside."""
        ...


@dataclass(eq=False, slots=True)
class _Waiting:
    amount: int
    granted: asyncio.Future[None]


class Pool:
    """An amount of something, lent in the order in which it was asked for.

    Whoever asks for little waits behind one who asks for much: so the latter gets it some day. An
    ask for more than there is at all counts as one for the whole.

    Parameters
    ----------
    capacity : int
    max_waiting : int or None
        How many may wait.
    tenant : Tenant or None
        What gives way where room is needed.

    Attributes
    ----------
    used : int
        What is lent.
    refused : int
        How often somebody was refused.
    seconds : float
        How long all together have waited.
    lodgers : dict
        Whom to tell when somebody has to wait, and how; as keys, in the order in which they came.
    """

    def __init__(
        self, capacity: int, max_waiting: int | None = None, tenant: Tenant | None = None
    ) -> None:
        self.capacity = capacity
        self.used = 0
        self.refused = 0
        self.seconds = 0.0
        self.lodgers: dict[Callable[[], None], None] = {}
        self._max_waiting = max_waiting
        self._tenant = tenant
        self._queue: deque[_Waiting] = deque()
        self._take(0)

    @property
    def waiting(self) -> int:
        """How many wait."""
        return len(self._queue)

    async def lent(self, amount: int) -> "Lease":
        """So much, when it is there and all who asked before have theirs.

        Raises
        ------
        Busy
            If too many wait already.
        """
        lease = Lease(self)
        await lease.grown(amount)
        return lease

    def settle(self) -> None:
        """Gives to those who wait longest what there is for them."""
        while self._queue:
            first = self._queue[0]
            if not first.granted.done():
                if not self.has(first.amount):
                    return
                self._take(first.amount)
                first.granted.set_result(None)
            self._queue.popleft()

    def has(self, amount: int) -> bool:
        """Whether so much could be lent right now."""
        fixed = 0 if self._tenant is None else self._tenant.fixed
        return self.used + fixed + amount <= self.capacity

    def _take(self, amount: int) -> None:
        self.used += amount
        if self._tenant is not None:
            self._tenant.resize(self.capacity - self.used)

    def _give(self, amount: int) -> None:
        self._take(-amount)
        self.settle()

    def _taken(self, amount: int, leaving: int) -> bool:
        """Whether so much was there."""
        if self._queue or not self.has(amount + leaving):
            return False
        self._take(amount)
        return True

    async def _granted(self, amount: int) -> None:
        """Returns once so much was taken."""
        if self._taken(amount, 0):
            return
        if self._max_waiting is not None and self.waiting >= self._max_waiting:
            self.refused += 1
            raise Busy
        waiting = _Waiting(amount, asyncio.get_running_loop().create_future())
        self._queue.append(waiting)
        for tell in self.lodgers:
            tell()
        since = time.monotonic()
        try:
            await waiting.granted
        except asyncio.CancelledError:
            if waiting.granted.cancelled():
                if waiting in self._queue:
                    self._queue.remove(waiting)
                self.settle()  # the next one may fit
            else:
                self._give(amount)
            raise
        finally:
            self.seconds += time.monotonic() - since


class Lease:
    """What somebody has of a pool, until it is given back; nothing to begin with.

    Attributes
    ----------
    pool : Pool
    amount : int
    """

    __slots__ = ("amount", "pool")

    def __init__(self, pool: Pool) -> None:
        self.pool = pool
        self.amount = 0

    def grow(self, by: int, *, leaving: int = 0) -> bool:
        """Takes more right now, if nobody waits and at least `leaving` stays; whether it did."""
        if not by:
            return True
        if not self.pool._taken(by, leaving):
            return False
        self.amount += by
        return True

    async def grown(self, to: int) -> None:
        """Takes or gives back until it is so much; waits where `Pool.lent` does.

        Who waits keeps what there is; so of all who have some of a pool only one may wait for more.
        """
        to = min(to, self.pool.capacity)
        if to > self.amount:
            by = to - self.amount
            await self.pool._granted(by)
            self.amount += by
        else:
            self.shrink(to)

    def shrink(self, to: int) -> None:
        """Gives back all but so much, if there is more."""
        if to < self.amount:
            back, self.amount = self.amount - to, to
            self.pool._give(back)

    def release(self) -> None:
        """Gives all back."""
        self.shrink(0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self.release()
