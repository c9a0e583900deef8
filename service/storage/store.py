"""Stores surfaces under their hashes, and checks the hash of every object it reads."""

import asyncio
import hashlib
import logging
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn
from weakref import WeakValueDictionary

from anyio import Lock, to_thread

from service.errors import DamagedObject, Issue, SurfaceError, UnknownSurface
from service.storage.backends import PAGE, Backend, Entry, reserve_nothing
from service.storage.failures import Operations, translate_errors
from service.storage.keys import SURFACES, find_id, key_of
from service.storage.quota import Usage
from service.storage.slots import Slots
from service.storage.watch import Watch, Writes

MAX_CONCURRENT = 8
"""Most objects that are hashed, read or written at once: each takes memory and up to 2 threads."""

INLINE_BYTES = 1 << 18
"""Most bytes of a content that the event loop hashes itself; a thread hashes larger contents."""

PATIENCE = 1.0
"""Seconds after which an operation counts as long, and no longer as one of `MAX_CONCURRENT`: files
and connections that hang must not block the others."""

MAX_LONG = 24
"""Most long operations; fewer than the threads for files, so that the others have some."""

FULL_BYTES = 1 << 12
"""A store with less room in its quota counts as full: small surfaces have up to 4 kB."""

MAINTENANCE_INTERVAL = 3600.0
"""Seconds between two runs of `maintain`."""

_log = logging.getLogger(__name__)


class SurfaceStore:
    """Stores contents under their SHA-256.

    Several processes may share one backend: under the same key they write the same bytes, so the
    order of their writes does not matter. Every method raises ValueError for an id that is no hash
    (`key_of`).
    """

    def __init__(self, backend: Backend, quota: int) -> None:
        self.operations = Operations()
        self.backend = backend
        self.usage = Usage(quota, self._list_bytes)
        self._watch = Watch(backend, self.operations)
        self._slots = Slots(MAX_CONCURRENT, PATIENCE, MAX_LONG)
        # For each id that is being stored or deleted, its lock.
        self._writing: WeakValueDictionary[str, Lock] = WeakValueDictionary()

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
        async with self._slots.hold():
            if await _hash(content) != id:
                raise ValueError("the id is not the hash of the content")
        async with self._lock(id):
            old_size = await self._size(key)
            if old_size == len(content):
                with suppress(DamagedObject, UnknownSurface):  # another process may delete it
                    await self._get(id, reserve_nothing)
                    return False
            elif old_size is not None:
                _log.warning("%s is damaged, %d bytes instead of %d", key, old_size, len(content))
            # The repair of a damaged object takes no bytes of the quota, so it is never refused.
            growth = len(content) if old_size is None else 0
            async with self.usage.reserve(growth), self._slots.hold():
                with translate_errors(f"storing {key}"), self._watch.note_write():
                    await self.backend.write(key, content)
        return True

    async def get(self, id: str, reserve: Callable[[int], None] = reserve_nothing) -> bytes:
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
        async with self._slots.hold():
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

    async def list(self, after: str = "", limit: int = PAGE) -> list[Entry]:
        """At most `limit` stored surfaces, in the order of their ids; does not read them.

        Objects whose keys are those of no surface are left out.

        Parameters
        ----------
        after : str
            Only ids greater than this one.
        """
        entries: list[Entry] = []
        with self.operations.count("list"), translate_errors("listing surfaces"):
            async for page in self.backend.list(SURFACES, key_of(after) if after else ""):
                entries += [entry for entry in page if find_id(entry.key)]
                if len(entries) >= limit:
                    break
        return entries[:limit]

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
                        async with self._slots.hold():
                            await self.backend.delete(key)
                    except FileNotFoundError:
                        return False
                self.usage.add(-size)
                return True

    async def is_ready(self) -> bool:
        """Whether the store answers: a short check with a deadline, at most once in 5 s."""
        return await self._watch.check()

    @property
    def is_answering(self) -> bool:
        """Whether the store answered the last check."""
        return not self._watch.failures

    @property
    def has_failed(self) -> bool:
        """Whether the store has never answered, or two checks in a row have failed."""
        return self._watch.has_failed

    @property
    def writes(self) -> Writes:
        """Whether surfaces can be stored, and if not, why."""
        writes = self._watch.writes
        return "full" if writes == "ready" and self.usage.is_within(FULL_BYTES) else writes

    async def watch(self) -> NoReturn:
        """Checks every 5 s whether the store answers, and every minute whether it can be written.

        It runs until cancelled.
        """
        await self._watch.run()

    async def maintain(self) -> NoReturn:
        """Removes unfinished files and counts bytes, now and every hour, until cancelled.

        It logs errors, and continues.
        """
        while True:
            with suppress(SurfaceError):
                with translate_errors("sweeping"):
                    await self.backend.sweep()
                await self.usage.recount()
            await asyncio.sleep(MAINTENANCE_INTERVAL)

    def _lock(self, id: str) -> Lock:
        """The lock for storing or deleting this id: of equal requests, only one writes."""
        return self._writing.setdefault(id, Lock())

    async def _size(self, key: str) -> int | None:
        """Bytes of an object; None if it does not exist."""
        async with self._slots.hold():
            with translate_errors(f"looking for {key}"):
                try:
                    return (await self.backend.head(key)).size
                except FileNotFoundError:
                    return None

    async def _read(self, key: str, reserve: Callable[[int], None]) -> bytes:
        with translate_errors(f"reading {key}"):
            try:
                return await self.backend.read(key, reserve)
            except FileNotFoundError:
                raise UnknownSurface(
                    Issue("unknown_surface", "No surface is stored under this id.")
                ) from None

    async def _list_bytes(self) -> int:
        """Bytes of all objects, by a listing."""
        total = 0
        with translate_errors("counting surfaces"):
            async for entries in self.backend.list(SURFACES):
                total += sum(entry.size for entry in entries)
        return total


async def _hash(content: bytes) -> str:
    if len(content) <= INLINE_BYTES:
        return hashlib.sha256(content).hexdigest()
    return await to_thread.run_sync(lambda: hashlib.sha256(content).hexdigest())
