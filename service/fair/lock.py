"""A lock of asyncio whose waiting callers take turns."""

import asyncio
from contextlib import suppress

from service.fair.accounts import Accounts
from service.fair.queue import FairQueue


class FairLock:
    """A lock that the waiting caller gets next that has used the fewest thread seconds.

    Its holder is charged for a thread while it holds the lock.
    """

    def __init__(self, accounts: Accounts) -> None:
        self._queue: FairQueue[asyncio.Future[None]] = FairQueue(accounts)

    def locked(self) -> bool:
        """Whether the lock is held."""
        return self._queue.busy_count > 0

    async def acquire(self, caller: str) -> None:
        """Waits in turn until the lock is free, and takes it."""
        if not self.locked():
            self._queue.take_thread(caller)
            return
        grant: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._queue.add(caller, grant)
        try:
            await grant
        except asyncio.CancelledError:
            if grant.cancelled():
                with suppress(ValueError):  # no longer queued
                    self._queue.remove(caller, grant)
            else:  # the lock was granted just before the cancellation
                self.release(caller)
            raise

    def release(self, caller: str) -> None:
        """Gives the lock to the next caller."""
        self._queue.return_thread(caller)
        while self._queue.waiting and not self.locked():
            next_caller = self._queue.in_turn()[0]
            grant = self._queue.first(next_caller)
            if not grant.done():
                self._queue.take_thread(next_caller)
                grant.set_result(None)
            self._queue.remove(next_caller, grant)
