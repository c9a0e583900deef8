"""Reads and writes the objects of jobs in the store; errors become those of the service."""

from collections.abc import AsyncIterator, Callable
from contextlib import suppress

from service.storage.backends import Backend, Entry, reserve_nothing
from service.storage.failures import translate_errors


class JobFiles:
    """The objects of jobs, under the keys of `service.jobs.keys`.

    Every method raises StoreFull or StoreFailed if the store does.
    """

    def __init__(self, backend: Backend) -> None:
        self._backend = backend

    async def write(self, key: str, content: bytes, *, durable: bool = False) -> None:
        """Stores an object or replaces it; `durable` as in `Backend.write`."""
        with translate_errors(f"storing {key}"):
            await self._backend.write(key, content, durable=durable)

    async def read(
        self, key: str, reserve: Callable[[int], None] = reserve_nothing
    ) -> bytes | None:
        """The content of an object, `reserve` as in `Backend.read`; None if it does not exist."""
        with translate_errors(f"reading {key}"), suppress(FileNotFoundError):
            return await self._backend.read(key, reserve)
        return None

    async def entry(self, key: str) -> Entry | None:
        """The size and the age of an object; None if it does not exist."""
        with translate_errors(f"looking for {key}"), suppress(FileNotFoundError):
            return await self._backend.head(key)
        return None

    async def has(self, key: str) -> bool:
        """Whether an object exists."""
        return await self.entry(key) is not None

    async def delete(self, key: str) -> None:
        """Removes an object, if it exists."""
        with translate_errors(f"deleting {key}"), suppress(FileNotFoundError):
            await self._backend.delete(key)

    async def entries(self, prefix: str) -> AsyncIterator[Entry]:
        """The entries of all objects whose keys begin with `prefix/`, in the order of the keys."""
        with translate_errors(f"listing {prefix}"):
            async for page in self._backend.list(prefix):
                for entry in page:
                    yield entry

    async def names(self, prefix: str) -> list[str]:
        """The last parts of the keys that begin with `prefix/`."""
        return [entry.key.rpartition("/")[2] async for entry in self.entries(prefix)]

    async def delete_all(self, prefix: str) -> None:
        """Removes all objects whose keys begin with `prefix/`."""
        keys = [entry.key async for entry in self.entries(prefix)]
        for key in keys:
            await self.delete(key)
