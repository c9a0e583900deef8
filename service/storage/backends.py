"""Where objects are kept under keys: a bucket or memory, by obstore; `folder.py` has the folder.

The store of surfaces and the jobs share one backend: each uses keys with prefixes of its own.
"""

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import obstore

from service.storage.keys import SURFACES

if TYPE_CHECKING:
    from obstore.store import ObjectStore

PAGE = 1000
"""Most entries of a listing in one list."""


class Entry(NamedTuple):
    """One object in a listing."""

    key: str
    size: int
    """Bytes of the content."""
    modified: float
    """When it was written last, in seconds since 1970 (UTC)."""


def reserve_nothing(_size: int) -> None:
    """Reserves no memory: the default of `Backend.read`."""


class Backend(Protocol):
    """Keeps contents under keys, names joined by `/`; an object is there as a whole or not at all.

    All methods raise errors of obstore or of the system; `translate_errors` makes them errors of
    the service. A failure of the backend itself is never a `FileNotFoundError`: that means that the
    backend works, and has no object under this key.
    """

    async def write(self, key: str, content: bytes, *, durable: bool = True) -> None:
        """Stores an object, or replaces it.

        Parameters
        ----------
        durable : bool
            If True, a crash of the machine loses nothing once this returns. If False, it may lose
            the object; a crash of this process alone does not.
        """

    async def read(self, key: str, reserve: Callable[[int], None] = reserve_nothing) -> bytes:
        """The content of an object.

        Parameters
        ----------
        reserve : callable
            Called with the number of bytes before they are read. If it raises, nothing is read.

        Raises
        ------
        FileNotFoundError
        """

    async def head(self, key: str) -> Entry:
        """The entry of an object; does not read it.

        Raises
        ------
        FileNotFoundError
        """

    async def delete(self, key: str) -> None:
        """Removes an object.

        Raises
        ------
        FileNotFoundError
            There is none; a bucket may also report success.
        """

    def list(self, prefix: str, after: str = "") -> AsyncIterator[list[Entry]]:
        """All objects whose keys begin with `prefix/`, in the order of their keys.

        Parameters
        ----------
        after : str
            Only keys greater than this one.

        Returns
        -------
        AsyncIterator
            Lists of at most `PAGE` entries.
        """

    async def check(self) -> None:
        """Raises an error if the backend does not respond, or is not the one that was opened."""

    async def sweep(self) -> None:
        """Removes unfinished files of killed processes."""


@dataclass(frozen=True)
class Bucket:
    """A bucket, or the memory of this process."""

    objects: "ObjectStore"

    async def write(self, key: str, content: bytes, *, durable: bool = True) -> None:  # noqa: ARG002
        """Stores an object, or replaces it; a bucket confirms only what is durable."""
        await obstore.put_async(self.objects, key, content, use_multipart=False)

    async def read(self, key: str, reserve: Callable[[int], None] = reserve_nothing) -> bytes:
        """The content of an object."""
        response = await obstore.get_async(self.objects, key)
        reserve(response.meta["size"])
        return bytes(await response.bytes_async())

    async def head(self, key: str) -> Entry:
        """The entry of an object; does not read it."""
        return _entry(await obstore.head_async(self.objects, key))

    async def delete(self, key: str) -> None:
        """Removes an object."""
        await obstore.delete_async(self.objects, key)

    async def list(self, prefix: str, after: str = "") -> AsyncIterator[list[Entry]]:
        """All objects whose keys begin with `prefix/`, in the order of their keys."""
        listing = obstore.list(self.objects, prefix, offset=after or None, chunk_size=PAGE)
        async for batch in listing:
            yield [_entry(meta) for meta in batch]

    async def check(self) -> None:
        """Lists at most the prefixes `surfaces/00` to `surfaces/ff`."""
        await obstore.list_with_delimiter_async(self.objects, SURFACES)

    async def sweep(self) -> None:
        """Does nothing: a bucket has no unfinished files."""


def _entry(meta: "obstore.ObjectMeta") -> Entry:
    return Entry(meta["path"], meta["size"], meta["last_modified"].timestamp())
