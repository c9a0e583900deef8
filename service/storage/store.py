"""Stores surfaces under their hashes, and checks the hash of every object it reads."""

import asyncio
import hashlib
import logging
import math
import time
from collections.abc import Callable
from contextlib import suppress
from weakref import WeakValueDictionary

import obstore
from anyio import CapacityLimiter, Lock, to_thread

from service.errors import DamagedObject, Issue, StoreFailed, SurfaceError, UnknownSurface
from service.storage.backends import Bucket
from service.storage.failures import Operations, translate_errors
from service.storage.keys import SURFACES, key_of
from service.storage.quota import Usage

MAX_CONCURRENT = 8
"""Most objects that are hashed, read or written at once: each takes memory and up to 2 threads."""

INLINE_BYTES = 1 << 18
"""Most bytes of a content that the event loop hashes itself; a thread hashes larger contents."""

DEADLINE = 1.0
"""Seconds after which a readiness check counts as failed."""

CHECK_INTERVAL = 5.0
"""Seconds for which the result of a readiness check stays valid."""

MAINTENANCE_INTERVAL = 3600.0
"""Seconds between two runs of `maintain`."""

_log = logging.getLogger(__name__)


def _reserve_nothing(_size: int) -> None:
    """Reserves no memory: the default of `SurfaceStore.get`."""


class SurfaceStore:
    """Stores contents under their SHA-256.

    Several processes may share one backend: under the same key they write the same bytes, so the
    order of their writes does not matter. Every method raises ValueError for an id that is no hash
    (`key_of`).
    """

    def __init__(self, backend: Bucket, quota: int) -> None:
        self.operations = Operations()
        self._backend = backend
        self.usage = Usage(quota, self._list_bytes)
        self._limiter = CapacityLimiter(MAX_CONCURRENT)
        # For each id that is being stored or deleted, its lock.
        self._writing: WeakValueDictionary[str, Lock] = WeakValueDictionary()
        self._ready_lock = Lock()
        self._last_check = -math.inf
        self._failing_since: float | None = None

    async def put(self, id: str, content: bytes) -> bool:
        """Stores a content; returns False if it was stored already.

        Once this returns, a crash does not lose the content. A damaged object is written again. The
        quota never refuses a content that is stored already, even if the object is damaged.

        Raises
        ------
        StoreFull
            Nothing was stored.
        StoreFailed
        ValueError
            The id is not the hash of the content.
        """
        with self.operations.count("put"):
            return await self._put(id, key_of(id), content)

    async def _put(self, id: str, key: str, content: bytes) -> bool:
        async with self._limiter:
            if await _hash(content) != id:
                raise ValueError("the id is not the hash of the content")
        async with self._lock(id):
            old_size = await self._size(key)
            if old_size == len(content):
                with suppress(DamagedObject, UnknownSurface):  # another process may delete it
                    await self._get(id, _reserve_nothing)
                    return False
            elif old_size is not None:
                _log.warning("%s is damaged, %d bytes instead of %d", key, old_size, len(content))
            # The repair of a damaged object takes no bytes of the quota, so it is never refused.
            growth = len(content) if old_size is None else 0
            async with self.usage.reserve(growth), self._limiter:
                with translate_errors(f"storing {key}"):
                    await self._backend.write(key, content)
        return True

    async def get(self, id: str, reserve: Callable[[int], None] = _reserve_nothing) -> bytes:
        """The content with this id; checks its hash.

        Parameters
        ----------
        reserve : Callable
            Reserves memory: called with the number of bytes before they are read. If it raises an
            error, nothing is read.

        Raises
        ------
        UnknownSurface
        DamagedObject, StoreFailed
            The log has the details.
        """
        with self.operations.count("get"):
            return await self._get(id, reserve)

    async def _get(self, id: str, reserve: Callable[[int], None]) -> bytes:
        key = key_of(id)
        async with self._limiter:
            content = await self._read(key, reserve)
            hash = await _hash(content)
        if hash != id:
            _log.error("%s is damaged: %d bytes of another hash", key, len(content))
            raise DamagedObject
        return content

    async def has(self, id: str) -> bool:
        """Whether an object has this id; does not read the object."""
        with self.operations.count("has"):
            return await self._size(key_of(id)) is not None

    async def delete(self, id: str) -> bool:
        """Removes the object with this id, even if it is damaged; returns whether it existed."""
        key = key_of(id)
        with self.operations.count("delete"):
            async with self._lock(id):
                size = await self._size(key)
                if size is None:
                    return False
                with translate_errors(f"deleting {key}"):
                    try:
                        async with self._limiter:
                            await obstore.delete_async(self._backend.objects, key)
                    except FileNotFoundError:
                        return False
                self.usage.add(-size)
                return True

    async def is_ready(self) -> bool:
        """Whether the store answers: a short check with a deadline, at most once in 5 s."""
        async with self._ready_lock:
            now = time.monotonic()
            if now - self._last_check > CHECK_INTERVAL:
                self._last_check = now
                try:
                    action = "checking that the store is ready"
                    with self.operations.count("ask"), translate_errors(action):
                        await asyncio.wait_for(self._backend.touch(), DEADLINE)
                    self._failing_since = None
                except StoreFailed:
                    self._failing_since = self._failing_since or now
            return self._failing_since is None

    @property
    def seconds_failing(self) -> float:
        """Seconds for which every readiness check has failed; 0 if the last one succeeded."""
        return 0.0 if self._failing_since is None else time.monotonic() - self._failing_since

    async def maintain(self) -> None:
        """Removes unfinished files and counts bytes, now and every hour, until cancelled.

        It logs errors, and continues.
        """
        while True:
            with suppress(SurfaceError):
                with translate_errors("sweeping"):
                    await self._backend.sweep()
                await self.usage.recount()
            await asyncio.sleep(MAINTENANCE_INTERVAL)

    def _lock(self, id: str) -> Lock:
        """The lock for storing or deleting this id: of equal requests, only one writes."""
        return self._writing.setdefault(id, Lock())

    async def _size(self, key: str) -> int | None:
        """Bytes of an object; None if it does not exist."""
        async with self._limiter:
            with translate_errors(f"looking for {key}"):
                try:
                    return (await obstore.head_async(self._backend.objects, key))["size"]
                except FileNotFoundError:
                    return None

    async def _read(self, key: str, reserve: Callable[[int], None]) -> bytes:
        with translate_errors(f"reading {key}"):
            try:
                response = await obstore.get_async(self._backend.objects, key)
                reserve(response.meta["size"])
                return bytes(await response.bytes_async())
            except FileNotFoundError:
                raise UnknownSurface(
                    Issue("unknown_surface", "No surface is stored under this id.")
                ) from None

    async def _list_bytes(self) -> int:
        """Bytes of all objects, by a listing."""
        total = 0
        with translate_errors("counting surfaces"):
            async for batch in obstore.list(self._backend.objects, SURFACES, chunk_size=1000):
                total += sum(item["size"] for item in batch)
        return total


async def _hash(content: bytes) -> str:
    if len(content) <= INLINE_BYTES:
        return hashlib.sha256(content).hexdigest()
    return await to_thread.run_sync(lambda: hashlib.sha256(content).hexdigest())
