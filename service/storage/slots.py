"""Slots: how many operations of a store run at once."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from anyio import CapacityLimiter


class Slots:
    """Lets `count` operations run at once; one that takes long gives its slot to another.

    So operations that hang, on a file or a connection, block the others for `patience` seconds at
    most. But `most` operations may run long: after that, further ones keep their slots.
    """

    def __init__(self, count: int, patience: float, most: int) -> None:
        self._limiter = CapacityLimiter(count)
        self._patience, self._most = patience, most
        self._long: set[object] = set()

    @asynccontextmanager
    async def hold(self) -> AsyncIterator[None]:
        """Waits for a slot, and holds it in the `with` block for at most `patience` seconds."""
        operation = object()
        await self._limiter.acquire_on_behalf_of(operation)
        timer = asyncio.get_running_loop().call_later(self._patience, self._lend, operation)
        try:
            yield
        finally:
            timer.cancel()
            if operation in self._long:
                self._long.remove(operation)
            else:
                self._limiter.release_on_behalf_of(operation)

    def _lend(self, operation: object) -> None:
        if len(self._long) < self._most:
            self._long.add(operation)
            self._limiter.release_on_behalf_of(operation)
