"""A backend that keeps objects as files in a folder of this machine."""

import errno
import os
import stat
import uuid
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import islice
from pathlib import Path, PurePosixPath

from service.storage.backends import PAGE, Entry, reserve_nothing
from service.storage.files import (
    FOLDER,
    create_file,
    has_folder,
    make_parents_if_missing,
    remove_old_files,
    sync_folder,
    walk,
)
from service.storage.keys import SURFACES
from service.storage.marker import MARKER, LostFolder, read_marker, write_marker
from service.storage.threads import FileThreads

STAGING = "staging"
"""Name of the folder of files that are being written."""

ABANDONED_AFTER = 3600.0
"""Seconds after which a file in `staging/` counts as unfinished, of a process that was killed."""

READ_DEADLINE = 20.0
"""Seconds after which reading a file, or looking for it, counts as failed."""


class Folder:
    """A folder with the marker of a store (`marker.py`).

    To store an object, the service writes a file in `staging/`, forces it to the disk (fsync),
    renames it, and forces the folders above it, which hold its name, to the disk. If the process is
    killed or the power fails at any moment, the object is complete or does not exist.

    Before every write, and whenever an object is not found, the service looks at the marker. If it
    is missing, or has another id, the operation raises `LostFolder`. Writing opens the folder once
    and then names files relative to it: whatever is mounted or renamed meanwhile, an object is
    written to the store itself or not at all, and the folder is never made again.

    Parameters
    ----------
    root : Path
    id : str, optional
        The id in the marker. None: a store of version 0.1.0 that is read-only; it gets its marker
        before the first write.
    """

    def __init__(self, root: Path, id: str | None) -> None:
        self.root = root
        self._id = id
        self._run = FileThreads().run
        self._synced: set[str] = set()  # first folders whose names are on the disk

    async def write(self, key: str, content: bytes, *, durable: bool = True) -> None:
        """Stores an object, or replaces it."""
        await self._run(key, self._write, content, durable)

    async def read(self, key: str, reserve: Callable[[int], None] = reserve_nothing) -> bytes:
        """The content of an object."""
        reserve((await self.head(key)).size)
        return await self._run(key, self._read, deadline=READ_DEADLINE)

    async def head(self, key: str) -> Entry:
        """The entry of an object; does not read it."""
        return await self._run(key, self._head, deadline=READ_DEADLINE)

    async def delete(self, key: str) -> None:
        """Removes an object, and folders above it that are then empty, except the first."""
        await self._run(key, self._delete)

    async def list(self, prefix: str, after: str = "") -> AsyncIterator[list[Entry]]:
        """All objects whose keys begin with `prefix/`, in the order of their keys."""
        entries = walk(self.root / prefix, prefix, after)
        while page := await self._run(prefix, lambda _: list(islice(entries, PAGE))):
            yield page
        await self.check()  # the folder of a lost store is empty, or does not exist

    async def check(self) -> None:
        """Looks at the marker and at the folder of surfaces."""
        # Under a key of its own, so that a listing which was cancelled does not make it fail.
        await self._run(MARKER, lambda _: self._check(SURFACES), deadline=READ_DEADLINE)

    async def sweep(self) -> None:
        """Removes unfinished files of killed processes.

        Other processes may be writing to the folder: files younger than an hour stay.
        """
        await self._run(STAGING, lambda _: remove_old_files(self.root / STAGING, ABANDONED_AFTER))

    def _write(self, key: str, content: bytes, durable: bool) -> None:
        name = f"{STAGING}/{uuid.uuid4().hex}"
        with self._open_root(writes=True) as root:
            try:
                create = partial(create_file, root, name, content, durable)
                make_parents_if_missing(root, name, create)
                move = partial(os.rename, name, key, src_dir_fd=root, dst_dir_fd=root)
                make_parents_if_missing(root, key, move)
            except BaseException:
                with suppress(OSError):
                    os.unlink(name, dir_fd=root)
                raise
            if durable:
                self._sync_folders(root, key)

    def _sync_folders(self, root: int, key: str) -> None:
        """Forces the names of the folders above a file, and its own, to the disk."""
        *parents, top = map(str, PurePosixPath(key).parents)
        for parent in parents:
            sync_folder(root, parent)
        # The name of a first folder, such as `surfaces`, is never removed.
        if not parents or parents[-1] not in self._synced:
            sync_folder(root, top)
            self._synced.update(parents[-1:])

    def _read(self, key: str) -> bytes:
        with self._check_if_missing():
            return (self.root / key).read_bytes()

    def _head(self, key: str) -> Entry:
        with self._check_if_missing():
            status = os.stat(self.root / key)
            if stat.S_ISDIR(status.st_mode):
                raise FileNotFoundError(errno.ENOENT, "this is a folder")
            return Entry(key, status.st_size, status.st_mtime)

    def _delete(self, key: str) -> None:
        with self._open_root(writes=True) as root:
            os.unlink(key, dir_fd=root)
            with suppress(OSError):  # not empty
                for parent in PurePosixPath(key).parents[:-2]:
                    os.rmdir(parent, dir_fd=root)

    def _check(self, key: str) -> None:
        with self._open_root() as root:
            os.stat(key, dir_fd=root)

    @contextmanager
    def _check_if_missing(self) -> Iterator[None]:
        """If the block finds no file, checks whether the store itself is missing."""
        try:
            yield
        except FileNotFoundError:
            with self._open_root():
                raise

    @contextmanager
    def _open_root(self, writes: bool = False) -> Iterator[int]:
        """A file descriptor of the folder, with the marker of this store.

        Raises
        ------
        LostFolder
        """
        try:
            root = os.open(self.root, FOLDER)
        except (FileNotFoundError, NotADirectoryError):
            raise LostFolder(errno.ENXIO, f"there is no folder {self.root}") from None
        try:
            self._check_id(root, writes)
            yield root
        finally:
            os.close(root)

    def _check_id(self, root: int, writes: bool) -> None:
        id = read_marker(root)
        if self._id is None:  # a store of version 0.1.0, which was read-only when it was opened
            if id is None and not has_folder(root, SURFACES):
                raise LostFolder(errno.ENXIO, f"{self.root} is not a store")
            self._id = write_marker(root) if id is None and writes else id
        elif id is None:
            raise LostFolder(errno.ENXIO, f"{self.root} is not a store: it has no {MARKER}")
        elif id != self._id:
            raise LostFolder(errno.ENXIO, f"{self.root} is another store, by its {MARKER}")
