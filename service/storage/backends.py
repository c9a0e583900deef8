"""Two backends: a bucket (in memory or remote), and a folder of this machine."""

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
"""Name of the folder of files that are being written."""

ABANDONED_AFTER = 3600.0
"""Seconds after which a file in `staging/` counts as unfinished, of a process that was killed."""


@dataclass(frozen=True)
class Bucket:
    """A backend that stores an object as a whole or not at all."""

    objects: "ObjectStore"

    async def write(self, key: str, content: bytes) -> None:
        """Stores an object or replaces it; once this returns, a crash does not lose it."""
        await obstore.put_async(self.objects, key, content, use_multipart=False)

    async def sweep(self) -> None:
        """Removes unfinished files of killed processes; a bucket has none."""

    async def touch(self) -> None:
        """Lists at most the prefixes `surfaces/00` to `surfaces/ff`.

        Raises an error if the bucket does not respond.
        """
        await obstore.list_with_delimiter_async(self.objects, SURFACES)


@dataclass(frozen=True)
class Folder(Bucket):
    """A folder. Every file in its folder `surfaces/` is complete and on the disk.

    To store an object, the service writes a file in `staging/`, forces it to the disk (fsync),
    renames it, and forces the folders above it, which hold its name, to the disk. If the process is
    killed or the power fails at any moment, the object is complete or does not exist. (obstore
    alone does not call fsync: the system would decide when bytes reach the disk.)
    """

    root: Path
    touch_limiter: CapacityLimiter
    """Lets one thread at a time look at the folder: if the file system blocks, one thread hangs."""

    async def write(self, key: str, content: bytes) -> None:
        """Stores an object or replaces it; once this returns, a crash does not lose it."""
        name = f"{STAGING}/{uuid.uuid4().hex}"
        staged_path, final_path = self.root / name, self.root / key
        try:
            await obstore.put_async(self.objects, name, content, use_multipart=False)
            await to_thread.run_sync(_sync, staged_path)
            await obstore.rename_async(self.objects, name, key)
        except Exception:
            with suppress(OSError):
                await to_thread.run_sync(os.unlink, staged_path)
            raise
        await to_thread.run_sync(_sync, final_path.parent, final_path.parent.parent)

    async def sweep(self) -> None:
        """Removes unfinished files of killed processes.

        Other processes may be writing to the folder: files younger than an hour stay.
        """
        await to_thread.run_sync(_sweep, self.root / STAGING)

    async def touch(self) -> None:
        """Looks at the folder; raises `OSError` if it does not exist."""
        await to_thread.run_sync(
            os.stat, self.root / SURFACES, abandon_on_cancel=True, limiter=self.touch_limiter
        )


def make_folder(path: Path) -> None:
    """Makes a folder and its missing parents, and forces them to the disk."""
    if not path.is_dir():
        make_folder(path.parent)
        path.mkdir(exist_ok=True)
        _sync(path.parent)


def _sync(*paths: Path) -> None:
    """Forces the content of files, and the names in folders, to the disk."""
    for path in paths:
        file = os.open(path, os.O_RDONLY)
        try:
            os.fsync(file)
        except OSError as error:
            # Some network file systems do not support this for folders, and do not need it.
            if not path.is_dir() or error.errno not in (errno.EINVAL, errno.ENOTSUP):
                raise
        finally:
            os.close(file)


def _sweep(staging: Path) -> None:
    oldest_kept = time.time() - ABANDONED_AFTER
    with os.scandir(staging) as entries:
        for entry in entries:
            with suppress(FileNotFoundError):  # another process sweeps too
                if entry.stat().st_mtime < oldest_kept:
                    os.unlink(entry)
