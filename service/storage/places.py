"""Two kinds of places: a bucket, in memory or far away, and a folder of this machine."""

import errno
import os
import time
import uuid
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import obstore
from anyio import CapacityLimiter, to_thread

from service.storage.keys import SURFACES

if TYPE_CHECKING:
    from obstore.store import ObjectStore

STAGING = "staging"
"""Folder of what is being written."""

ABANDONED = 3600.0
"""Seconds after which nobody is writing a file any more."""


@dataclass(frozen=True)
class Bucket:
    """A place that stores an object as a whole or not at all."""

    objects: "ObjectStore"

    async def write(self, key: str, content: bytes) -> None:
        """Stores an object, instead of one that may be there; it lasts once this returns."""
        await obstore.put_async(self.objects, key, content, use_multipart=False)

    async def sweep(self) -> None:
        """Removes what killed processes left behind: here, nothing."""

    async def touch(self) -> None:
        """Returns if the place answers: one listing of at most 256 prefixes."""
        await obstore.list_with_delimiter_async(self.objects, SURFACES)


@dataclass(frozen=True)
class Folder(Bucket):
    """A folder. Whatever is visible in it under `surfaces/` is whole and on the disk.

    An object is written to a file in `staging/`, forced to the disk, and renamed; then the folders
    that name it are forced to the disk too. Whenever the process is killed or the power fails, the
    name is not there or leads to all of the content. obstore writes no file that lasts: it leaves
    to the system when bytes reach the disk.
    """

    root: Path
    asking: CapacityLimiter
    """One thread at a time asks whether the folder answers, should it hang in the kernel."""

    async def write(self, key: str, content: bytes) -> None:
        """Stores an object, instead of one that may be there; it lasts once this returns."""
        name = f"{STAGING}/{uuid.uuid4().hex}"
        staged, final = self.root / name, self.root / key
        try:
            await obstore.put_async(self.objects, name, content, use_multipart=False)
            await to_thread.run_sync(_sync, staged)
            await obstore.rename_async(self.objects, name, key)
        except Exception:
            await to_thread.run_sync(_remove, staged)
            raise
        await to_thread.run_sync(_sync, final.parent, final.parent.parent)

    async def sweep(self) -> None:
        """Removes files that killed processes left half written.

        Others may be writing to the same folder: only files that are an hour old go.
        """
        await to_thread.run_sync(_sweep, self.root / STAGING)

    async def touch(self) -> None:
        """Returns if the folder is there."""
        await to_thread.run_sync(
            os.stat, self.root / SURFACES, abandon_on_cancel=True, limiter=self.asking
        )


def make_folder(path: Path) -> None:
    """Makes a folder, and those it lies in, where there is none; their names last."""
    if not path.is_dir():
        make_folder(path.parent)
        path.mkdir(exist_ok=True)
        _sync(path.parent)


def _sync(*paths: Path) -> None:
    """Forces files, or the names in folders, to the disk."""
    for path in paths:
        file = os.open(path, os.O_RDONLY)
        try:
            os.fsync(file)
        except OSError as error:
            # Some file systems of other machines cannot do this for folders, and need not.
            if not path.is_dir() or error.errno not in (errno.EINVAL, errno.ENOTSUP):
                raise
        finally:
            os.close(file)


def _remove(file: Path) -> None:
    with suppress(OSError):
        file.unlink(missing_ok=True)


def _sweep(staging: Path) -> None:
    oldest = time.time() - ABANDONED
    with os.scandir(staging) as entries:
        for entry in entries:
            with suppress(FileNotFoundError):  # another process sweeps too
                if entry.stat().st_mtime < oldest:
                    os.unlink(entry)
