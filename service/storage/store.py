"""Surfaces under their hashes: stored whole, checked whenever they are read."""

import asyncio
import hashlib
import logging
import time
from collections.abc import Callable
from contextlib import suppress
from weakref import WeakValueDictionary

import obstore
from anyio import CapacityLimiter, Lock, to_thread

from service.errors import DamagedObject, Issue, StoreFailed, SurfaceError, UnknownSurface
from service.storage.failures import failures
from service.storage.keys import SURFACES, is_id, key_of
from service.storage.operations import Operations
from service.storage.places import Bucket
from service.storage.usage import Usage

AT_ONCE = 8
"""Objects hashed, read or written at the same time: each takes memory, and up to two threads."""

INLINE = 1 << 18
"""Bytes that the event loop has the time to hash."""

DEADLINE = 1.0
"""Seconds within which a store answers that is well."""

REMEMBERED = 5.0
"""Seconds for which it is known whether the store is well: whoever asks, it is asked no oftener."""

ROUND = 3600.0
"""Seconds between two rounds of sweeping and counting."""

_log = logging.getLogger(__name__)


def _nothing(_size: int) -> None:
    """Whoever reads has room for everything."""


class SurfaceStore:
    """Contents by the SHA-256 that is their name.

    Several processes may share one place: what they write under one name is the same, so that it
    does not matter whose comes last.
    """

    def __init__(self, place: Bucket, quota: int) -> None:
        self.operations = Operations()
        self.quota = quota
        self._place = place
        self._usage = Usage(quota, self._listed)
        self._limiter = CapacityLimiter(AT_ONCE)
        self._writing: WeakValueDictionary[str, Lock] = WeakValueDictionary()
        self._asking = Lock()
        self._asked: tuple[float, bool] | None = None
        self._failing_since: float | None = None

    @property
    def used(self) -> int | None:
        """Bytes in use as far as is known; None where nothing is counted."""
        return self._usage.known

    async def put(self, id: str, content: bytes) -> bool:
        """Stores a content, and returns whether it was not there; it lasts once this returns.

        A damaged object is written anew. What is there already needs no room, damaged or not.

        Raises
        ------
        StoreFull
            Nothing was stored.
        StoreFailed
        ValueError
            The id is not the hash of the content.
        """
        with self.operations.told("put"):
            return await self._put(id, content)

    async def _put(self, id: str, content: bytes) -> bool:
        key = key_of(id)
        async with self._limiter:
            if await _hash(content) != id:
                raise ValueError("the id is not the hash of the content")
        async with self._turn(id):
            before = await self._size(key)
            if before == len(content):
                with suppress(DamagedObject, UnknownSurface):  # another process may delete it
                    await self._get(id, _nothing)
                    return False
            elif before is not None:
                _log.warning("%s is damaged, %d bytes instead of %d", key, before, len(content))
            # Whether the count knows of a damage, nobody can tell; mending is never refused.
            growth = len(content) if before is None else 0
            async with self._usage.room(growth), self._limiter:
                with failures(f"storing {key}"):
                    await self._place.write(key, content)
        return True

    async def get(self, id: str, announced: Callable[[int], None] = _nothing) -> bytes:
        """The content that was stored under this id, never another.

        Parameters
        ----------
        announced : Callable
            Called with the number of bytes before they are read; what it raises is raised here.

        Raises
        ------
        UnknownSurface
        DamagedObject, StoreFailed
            The log says more.
        """
        if not is_id(id):
            raise _unknown()
        with self.operations.told("get"):
            return await self._get(id, announced)

    async def _get(self, id: str, announced: Callable[[int], None]) -> bytes:
        key = key_of(id)
        async with self._limiter:
            content = await self._read(key, announced)
            hash = await _hash(content)
        if hash != id:
            _log.error("%s is damaged: %d bytes of another hash", key, len(content))
            raise DamagedObject
        return content

    async def has(self, id: str) -> bool:
        """Whether there is something under this id; it is not read."""
        if not is_id(id):
            return False
        with self.operations.told("has"):
            return await self._size(key_of(id)) is not None

    async def delete(self, id: str) -> bool:
        """Removes what is stored under this id, whole or damaged; whether there was anything."""
        if not is_id(id):
            return False
        with self.operations.told("delete"):
            return await self._delete(id)

    async def _delete(self, id: str) -> bool:
        key = key_of(id)
        async with self._turn(id):
            size = await self._size(key)
            if size is None:
                return False
            async with self._limiter:
                with failures(f"deleting {key}"):
                    try:
                        await obstore.delete_async(self._place.objects, key)
                    except FileNotFoundError:
                        return False
            self._usage.add(-size)
        return True

    async def answers(self) -> bool:
        """Whether the store is well: a cheap question with a deadline, asked every 5 s at most."""
        async with self._asking:
            if self._asked is None or time.monotonic() - self._asked[0] > REMEMBERED:
                self._asked = (time.monotonic(), await self._answers())
                if self._asked[1]:
                    self._failing_since = None
                elif self._failing_since is None:
                    self._failing_since = self._asked[0]
            return self._asked[1]

    @property
    def failing(self) -> float:
        """Seconds for which the store has answered nobody who asked; 0 where it is well."""
        return 0.0 if self._failing_since is None else time.monotonic() - self._failing_since

    async def tend(self) -> None:
        """Counts what there is and removes what killed processes left, now and every hour.

        Runs beside the requests until it is cancelled; a failure is in the log, and no end.
        """
        while True:
            with suppress(SurfaceError):
                with failures("sweeping"):
                    await self._place.sweep()
                await self._usage.counted()
            await asyncio.sleep(ROUND)

    def _turn(self, id: str) -> Lock:
        """The lock of those who store or delete this id: of many who store the same, one writes."""
        return self._writing.setdefault(id, Lock())

    async def _answers(self) -> bool:
        try:
            with self.operations.told("ask"), failures("asking whether the store answers"):
                await asyncio.wait_for(self._place.touch(), DEADLINE)
        except StoreFailed:
            return False
        return True

    async def _size(self, key: str) -> int | None:
        """Bytes of an object; None if there is none."""
        async with self._limiter:
            with failures(f"looking for {key}"):
                try:
                    return (await obstore.head_async(self._place.objects, key))["size"]
                except FileNotFoundError:
                    return None

    async def _read(self, key: str, announced: Callable[[int], None]) -> bytes:
        with failures(f"reading {key}"):
            try:
                found = await obstore.get_async(self._place.objects, key)
                announced(found.meta["size"])
                return bytes(await found.bytes_async())
            except FileNotFoundError:
                raise _unknown() from None

    async def _listed(self) -> int:
        """Bytes of all objects."""
        total = 0
        with failures("counting surfaces"):
            async for some in obstore.list(self._place.objects, SURFACES, chunk_size=1000):
                total += sum(each["size"] for each in some)
        return total


async def _hash(content: bytes) -> str:
    if len(content) <= INLINE:
        return hashlib.sha256(content).hexdigest()
    return await to_thread.run_sync(lambda: hashlib.sha256(content).hexdigest())


def _unknown() -> UnknownSurface:
    return UnknownSurface(Issue("unknown_surface", "No surface is kept under this id."))
