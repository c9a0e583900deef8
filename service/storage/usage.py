"""How many bytes are kept, and whether there is room for more."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from service.errors import Issue, StoreFull, SurfaceError

FRESH = 30.0
"""Seconds for which a count is good enough to refuse by."""

STALE = 600.0
"""Seconds after which a count is made anew, while the old one serves."""

_log = logging.getLogger(__name__)


class Usage:
    """Bytes in use under a quota.

    All objects are counted once, by a listing; after that, what this process stores and deletes is
    added and subtracted. Others may write to the same store: what they do shows at the next count,
    which is made every ten minutes, and before anything is refused. Between two counts the
    processes together may exceed the quota by what they stored in the meantime.

    Parameters
    ----------
    quota : int
        Bytes that may be in use; 0 sets no limit, and nothing is counted.
    listed : callable
        Bytes in use as the store itself lists them.
    """

    def __init__(
        self,
        quota: int,
        listed: Callable[[], Awaitable[int]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._quota = quota
        self._listed = listed
        self._clock = clock
        self._used = 0
        self._reserved = 0
        self._since = 0  # what was added since the count under way began
        self._counted_at: float | None = None
        self._counting: asyncio.Task[None] | None = None

    @property
    def known(self) -> int | None:
        """Bytes in use as far as is known; None before the first count, or without a quota."""
        return None if self._counted_at is None else self._used

    async def counted(self) -> None:
        """Counts anew, or waits for the count that is under way; without a quota, neither."""
        if self._quota:
            await asyncio.shield(self._count_anew())

    @asynccontextmanager
    async def room(self, growth: int) -> AsyncIterator[None]:
        """Keeps room for so many more bytes; if the block succeeds, they are in use.

        Raises
        ------
        StoreFull
            Before the block is entered.
        """
        await self._find(growth)
        self._reserved += growth  # no other task has run since there was room
        try:
            yield
        finally:
            self._reserved -= growth
        self.add(growth)

    def add(self, growth: int) -> None:
        """So many more bytes are in use, or fewer.

        What is deleted while a count is under way may or may not be in it: it stays in until the
        next one, which errs on the side of the quota.
        """
        self._used = max(0, self._used + growth)
        self._since += max(0, growth)

    async def _find(self, growth: int) -> None:
        if not self._quota or not growth:
            return
        if self._counted_at is None:
            await self.counted()
        if growth > self._left and growth <= self._quota and self._age > FRESH:
            await self.counted()
        if growth > self._left:
            raise no_room(self._left, growth)
        if self._age > STALE:
            self._count_anew().add_done_callback(_log_failure)

    @property
    def _left(self) -> int:
        return self._quota - self._used - self._reserved

    @property
    def _age(self) -> float:
        return float("inf") if self._counted_at is None else self._clock() - self._counted_at

    def _count_anew(self) -> asyncio.Task[None]:
        """The count that is under way; one at a time."""
        if self._counting is None or self._counting.done():
            self._counting = asyncio.create_task(self._count())
        return self._counting

    async def _count(self) -> None:
        self._since = 0
        began = self._clock()
        listed = await self._listed()
        self._used = listed + self._since
        self._counted_at = began


def no_room(left: int, growth: int) -> StoreFull:
    """The quota leaves so many bytes, and a surface takes more."""
    text = "The service may not keep so much more."
    got, needed = f"{growth} bytes", f"at most {max(0, left)} bytes"
    return StoreFull(Issue("store_full", text, got=got, needed=needed))


def _log_failure(counting: asyncio.Task[None]) -> None:
    """A count that nobody waits for has failed; why is in the log already."""
    if not counting.cancelled() and isinstance(counting.exception(), SurfaceError):
        _log.warning("surfaces in store could not be counted; the old count serves")
