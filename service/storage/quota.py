"""The quota of a store: counts its bytes, and refuses objects that do not fit."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from service.errors import Issue, StoreFull, SurfaceError

FRESH_SECONDS = 30.0
"""The age of a count up to which the store may refuse an object; otherwise it counts again
first."""

STALE_SECONDS = 600.0
"""The age of a count after which a new count starts in the background; until it ends, the old count
is used."""

_log = logging.getLogger(__name__)


class Usage:
    """Counts the bytes in use under a quota.

    A listing counts the bytes of all objects; after that, this process adds what it stores and
    subtracts what it deletes. The next count shows what other processes have changed. It starts by
    `recount`; when an object is stored and the count is older than `STALE_SECONDS`; or before a
    refusal, if the count is older than `FRESH_SECONDS`. Between two counts, all processes together
    may exceed the quota by the bytes that they store in this time.

    Parameters
    ----------
    quota : int
        Most bytes that may be in use; 0 sets no limit, and switches counting off.
    list_bytes : callable
        Returns the bytes in use, by a listing of the store.
    """

    def __init__(self, quota: int, list_bytes: Callable[[], Awaitable[int]]) -> None:
        self.quota = quota
        self._list_bytes = list_bytes
        self._used = 0
        self._reserved = 0
        self._added = 0  # bytes added since the last count began
        self._counted_at: float | None = None
        self._counting: asyncio.Task[None] | None = None

    @property
    def used(self) -> int | None:
        """Bytes in use, as last counted; None before the first count, or without a quota."""
        return None if self._counted_at is None else self._used

    def is_within(self, bytes: int) -> bool:
        """Whether fewer than `bytes` bytes of the quota are free, as last counted."""
        return self._counted_at is not None and self._free_bytes < bytes

    async def recount(self) -> None:
        """Counts again, or waits for the running count; does nothing without a quota."""
        if self.quota:
            await asyncio.shield(self._start_count())

    @asynccontextmanager
    async def reserve(self, growth: int) -> AsyncIterator[None]:
        """Reserves `growth` bytes; if the `with` block succeeds, they count as used.

        Raises
        ------
        StoreFull
            The quota has too few free bytes; the block does not begin.
        """
        await self.check_room(growth)
        self._reserved += growth  # since the check for room, no other task has run
        try:
            yield
        finally:
            self._reserved -= growth
        self.add(growth)

    def add(self, growth: int) -> None:
        """Adds `growth` bytes to those in use; `growth` is negative after a deletion.

        A count that runs during a deletion may still include the deleted object. So until the next
        count the total may be too high, but it is never too low.
        """
        self._used = max(0, self._used + growth)
        self._added += max(0, growth)

    async def check_room(self, growth: int) -> None:
        """Raises `StoreFull` if the quota has less than `growth` bytes left."""
        if not self.quota or not growth:
            return
        if self._counted_at is None:
            await self.recount()
        if growth > self._free_bytes and growth <= self.quota and self._age > FRESH_SECONDS:
            await self.recount()
        if growth > self._free_bytes:
            raise quota_exceeded(self._free_bytes, growth)
        if self._age > STALE_SECONDS:
            self._start_count().add_done_callback(_log_failure)

    @property
    def _free_bytes(self) -> int:
        return self.quota - self._used - self._reserved

    @property
    def _age(self) -> float:
        return float("inf") if self._counted_at is None else time.monotonic() - self._counted_at

    def _start_count(self) -> asyncio.Task[None]:
        """The running count, or a new one if no count is running."""
        if self._counting is None or self._counting.done():
            self._counting = asyncio.create_task(self._count())
        return self._counting

    async def _count(self) -> None:
        self._added = 0
        start = time.monotonic()
        self._used = await self._list_bytes() + self._added
        self._counted_at = start


def quota_exceeded(free_bytes: int, growth: int) -> StoreFull:
    """The error for a surface of `growth` bytes if the quota has only `free_bytes` bytes left."""
    return StoreFull(
        Issue(
            "store_full",
            "The surface does not fit into the quota of the store.",
            got=f"{growth} bytes",
            needed=f"at most {max(0, free_bytes)} bytes",
        )
    )


def _log_failure(counting: asyncio.Task[None]) -> None:
    """Logs that a background count failed; `translate_errors` has logged why."""
    if not counting.cancelled() and isinstance(counting.exception(), SurfaceError):
        _log.warning("the bytes in the store could not be counted; the last count is still used")
