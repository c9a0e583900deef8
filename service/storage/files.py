"""Folders and files of the store in a folder: made, written, forced to the disk, listed.

Most functions take a file descriptor of an open folder, `root`, and names relative to it: whatever
gets the folder's path meanwhile, they work in this very folder.
"""

import errno
import os
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath

from service.storage.backends import Entry

FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
"""Flags to open a folder."""

NEW_FILE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
"""Flags to make and open a file that does not exist."""


def has_folder(root: int, name: str) -> bool:
    """Whether an open folder has a folder of this name."""
    with suppress(FileNotFoundError):
        return stat.S_ISDIR(os.stat(name, dir_fd=root).st_mode)
    return False


def make_folder(path: Path) -> None:
    """Makes a folder and its missing parents, and forces them to the disk."""
    if not path.is_dir():
        make_folder(path.parent)
        path.mkdir(exist_ok=True)
        with open_folder(path.parent) as parent:
            sync_folder(parent, ".")


@contextmanager
def open_folder(path: Path) -> Iterator[int]:
    """A file descriptor of a folder."""
    folder = os.open(path, FOLDER)
    try:
        yield folder
    finally:
        os.close(folder)


def create_file(root: int, name: str, content: bytes, durable: bool) -> None:
    """Writes a new file in an open folder; if `durable`, to the disk."""
    file = os.open(name, NEW_FILE, 0o666, dir_fd=root)
    try:
        rest = memoryview(content)
        while rest:
            rest = rest[os.write(file, rest) :]
        if durable:
            os.fsync(file)
    finally:
        os.close(file)


def make_parents_if_missing(root: int, key: str, action: Callable[[], None]) -> None:
    """Calls `action`; if it finds a folder above `key` missing, makes these folders first."""
    try:
        action()
    except FileNotFoundError:
        for parent in reversed(PurePosixPath(key).parents[:-1]):
            with suppress(FileExistsError):
                os.mkdir(parent, dir_fd=root)
        action()


def sync_folder(root: int, name: str) -> None:
    """Forces the names in a folder to the disk."""
    with suppress(FileNotFoundError):  # another process has deleted the object and its folder
        folder = os.open(name, FOLDER, dir_fd=root)
        try:
            os.fsync(folder)
        except OSError as error:
            # Some network file systems do not support this for folders, and do not need it.
            if error.errno not in (errno.EINVAL, errno.ENOTSUP):
                raise
        finally:
            os.close(folder)


def walk(folder: Path | str, prefix: str, after: str) -> Iterator[Entry]:
    """The entries of all files below a folder, in the order of their keys."""
    try:
        with os.scandir(folder) as entries:
            # "a/" stands for the keys "a/…": "a.b" comes before them.
            found = sorted((f"{prefix}/{each.name}{'/' * each.is_dir()}", each) for each in entries)
    except FileNotFoundError:
        return
    for key, each in found:
        if key.endswith("/"):
            if key > after or after.startswith(key):
                yield from walk(each.path, key[:-1], after)
        elif key > after:
            try:
                status = each.stat()
            except FileNotFoundError:  # deleted meanwhile
                continue
            yield Entry(key, status.st_size, status.st_mtime)


def remove_old_files(folder: Path, age: float) -> None:
    """Removes the files in a folder that were written more than `age` seconds ago."""
    oldest_kept = time.time() - age
    with os.scandir(folder) as entries:
        for entry in entries:
            with suppress(FileNotFoundError):  # another process removes it too
                if entry.stat().st_mtime < oldest_kept:
                    os.unlink(entry)
