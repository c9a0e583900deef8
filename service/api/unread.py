"""Bytes of responses that callers have not read yet: each caller's own share of the memory.

A response holds memory until its client has read it. A client that reads slowly would otherwise
hold memory that the work of other callers waits for.
"""

import asyncio
from collections.abc import Callable, Sequence

SHARE = 8
"""The unread responses of one caller hold at most 1/SHARE of the memory."""


class UnreadBytes:
    """The bytes of unread responses by caller, and the responses that wait for room.

    A caller has room for a response if its unread responses and this one are within its share; or
    if it has no unread response, because one response may be larger than the share.

    Parameters
    ----------
    share : int
        Bytes that the unread responses of one caller may hold.

    Attributes
    ----------
    totals : dict
        Bytes by caller, without callers that hold none.
    on_read : callable
        Called when bytes of a caller have been read.
    """

    def __init__(self, share: int, on_read: Callable[[], None]) -> None:
        self.share = share
        self.totals: dict[str, int] = {}
        self.on_read = on_read
        # For each caller and the `id` of a shared body: the clients that read it now.
        self._readers: dict[tuple[str, int], int] = {}
        self._waiting: dict[str, set[asyncio.Future[None]]] = {}

    def has_room(self, caller: str, size: int) -> bool:
        """Whether a response of `size` bytes may begin."""
        held = self.totals.get(caller, 0)
        return not held or held + max(size, 1) <= self.share

    def add(self, caller: str, growth: int) -> None:
        """Counts more bytes of a caller, or fewer if `growth` is negative."""
        held = self.totals.get(caller, 0) + growth
        if held:
            self.totals[caller] = held
        else:
            self.totals.pop(caller, None)
        if growth < 0:
            for waiting in self._waiting.pop(caller, ()):
                if not waiting.done():
                    waiting.set_result(None)
            self.on_read()

    def may_begin(self, caller: str, bodies: Sequence[bytes], size: int) -> bool:
        """Whether a shared body may be sent: the caller reads one of `bodies`, or has room."""
        return any((caller, id(body)) in self._readers for body in bodies) or self.has_room(
            caller, size
        )

    def begin(self, caller: str, body: bytes) -> None:
        """Begins to send a body that responses share: it counts once for each caller."""
        key = (caller, id(body))
        self._readers[key] = count = self._readers.get(key, 0) + 1
        if count == 1:
            self.add(caller, len(body))

    def end(self, caller: str, body: bytes) -> None:
        """Ends sending a shared body to one client."""
        key = (caller, id(body))
        count = self._readers.pop(key) - 1
        if count:
            self._readers[key] = count
        else:
            self.add(caller, -len(body))

    async def wait(self, caller: str, bodies: Sequence[bytes], size: int) -> None:
        """Waits until one of the shared bodies may be sent to a caller."""
        while not self.may_begin(caller, bodies, size):
            waiting: asyncio.Future[None] = asyncio.get_running_loop().create_future()
            others = self._waiting.setdefault(caller, set())
            others.add(waiting)
            try:
                await waiting
            finally:
                others.discard(waiting)
