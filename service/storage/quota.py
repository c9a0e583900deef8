"""The quota of a store: counts its bytes, and refuses objects that do not fit."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from service.errors import Issue, StoreFull, SurfaceError

FRESH = 30.0
"""Seconds for which a count is recent enough to refuse an object."""

STALE = 600.0
"""Seconds after which a new count starts in the background; until it ends the old one is used."""

_log = logging.getLogger(__name__)


class Usage:
    """Counts the bytes in use under a quota.

    A listing counts all objects once; after that, this process adds what it stores and subtracts
    what it deletes. Changes by other processes appear at the next count: every 10 minutes, and
    before a refusal. Between two counts all processes together may exceed the quota by what they
    stored meanwhile.

    Parameters
    ----------
    quota : int
        Most bytes that may be in use; 0 sets no limit, and switches counting off.
    list_bytes : callable
        Returns the bytes in use, by a listing of the store.
    """

    def __init__(
        self,
        quota: int,
        list_bytes: Callable[[], Awaitable[int]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._quota = quota
        self._list_bytes = list_bytes
        self._clock = clock
        self._used = 0
        self._reserved = 0
        self._since = 0  # bytes added since the current count began
        self._counted_at: float | None = None
        self._counting: asyncio.Task[None] | None = None

    @property
    def used(self) -> int | None:
        """Bytes in use, as last counted; None before the first count, or without a quota."""
        return None if self._counted_at is None else self._used

    async def recount(self) -> None:
        """Counts again, or waits for the count that is running; does nothing without a quota."""
        if self._quota:
            await asyncio.shield(self._count_anew())

    @asynccontextmanager
    async def reserve(self, growth: int) -> AsyncIterator[None]:
        """Reserves `growth` bytes; if the `with` block succeeds, they count as used.

        Raises
        ------
        StoreFull
            Before the block is entered.
        """
        await self._check_room(growth)
        self._reserved += growth  # no other task has run since there was room
        try:
            yield
        finally:
            self._reserved -= growth
        self.add(growth)

    def add(self, growth: int) -> None:
        """Adds `growth` bytes to those in use; `growth` is negative after a deletion.

        A running count may or may not include an object that is deleted meanwhile: its bytes may
        count until the next count, so the total may be too high, but not too low.
        """
        self._used = max(0, self._used + growth)
        self._since += max(0, growth)

    async def _check_room(self, growth: int) -> None:
        if not self._quota or not growth:
            return
        if self._counted_at is None:
            await self.recount()
        if growth > self._left and growth <= self._quota and self._age > FRESH:
            await self.recount()
        if growth > self._left:
            raise quota_exceeded(self._left, growth)
        if self._age > STALE:
            self._count_anew().add_done_callback(_log_failure)

    @property
    def _left(self) -> int:
        return self._quota - self._used - self._reserved

    @property
    def _age(self) -> float:
        return float("inf") if self._counted_at is None else self._clock() - self._counted_at

    def _count_anew(self) -> asyncio.Task[None]:
        """The running count; one at a time."""
        if self._counting is None or self._counting.done():
            self._counting = asyncio.create_task(self._count())
        return self._counting

    async def _count(self) -> None:
        self._since = 0
        began = self._clock()
        listed = await self._list_bytes()
        self._used = listed + self._since
        self._counted_at = began


def quota_exceeded(left: int, growth: int) -> StoreFull:
    """The error if the quota has `left` free bytes, and a surface takes `growth` bytes."""
    text = "The surface does not fit into the quota of the store."
    got, needed = f"{growth} bytes", f"at most {max(0, left)} bytes"
    return StoreFull(Issue("store_full", text, got=got, needed=needed))


def _log_failure(counting: asyncio.Task[None]) -> None:
    """Logs that a background count failed; `translate_errors` has logged why."""
    if not counting.cancelled() and isinstance(counting.exception(), SurfaceError):
        _log.warning("the bytes in the store could not be counted; the last count is still used")
