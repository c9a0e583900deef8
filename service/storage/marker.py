"""The marker of a store in a folder: the file `.surface-store`, by which the service knows it.

If a disk is not mounted, its folder is empty. Without a marker, the service could not distinguish
it from a new store, and would store surfaces on the disk below.
"""

import errno
import json
import os
import uuid
from contextlib import suppress

from service.storage.files import NEW_FILE, sync_folder

MARKER = ".surface-store"
"""The file's name. Its content is `{"store": 1, "id": "<uuid>"}`."""

FORMAT = 1
"""The version of the store's layout, `store` in the marker."""


class LostFolder(OSError):
    """The folder of the store is not there: removed, not mounted, or that of another store."""


class WrongMarker(OSError):
    """The marker is damaged, or that of a later version of the service."""


def read_marker(root: int) -> str | None:
    """The id of the store in an open folder; None if the folder has no marker.

    Parameters
    ----------
    root : int
        A file descriptor of the folder.

    Raises
    ------
    WrongMarker
    OSError
    """
    try:
        file = os.open(MARKER, os.O_RDONLY | os.O_CLOEXEC, dir_fd=root)
    except FileNotFoundError:
        return None
    try:
        content = os.read(file, 1000)
    finally:
        os.close(file)
    try:
        marker = json.loads(content)
        if marker["store"] == FORMAT:
            return str(uuid.UUID(marker["id"]))
    except (ValueError, TypeError, KeyError, AttributeError):
        pass
    raise WrongMarker(errno.EINVAL, f"{MARKER} is damaged, or of a later version of the service")


def write_marker(root: int) -> str:
    """Marks an open folder as a store, on the disk; returns the id of the store.

    If another process marks the folder at the same time, both get the same id.

    Raises
    ------
    WrongMarker
    OSError
    """
    id = str(uuid.uuid4())
    # The content is complete before the file has its name, so no process reads half of it.
    name = f"{MARKER}.{id}"
    try:
        file = os.open(name, NEW_FILE, 0o666, dir_fd=root)
        try:
            os.write(file, json.dumps({"store": FORMAT, "id": id}).encode("ascii"))
            os.fsync(file)
        finally:
            os.close(file)
        _name_exclusively(root, name)
        sync_folder(root, ".")
    finally:
        with suppress(FileNotFoundError):
            os.unlink(name, dir_fd=root)
    return read_marker(root) or id


def _name_exclusively(root: int, name: str) -> None:
    """Gives a file the name of the marker, unless there is a marker."""
    try:
        os.link(name, MARKER, src_dir_fd=root, dst_dir_fd=root)
    except FileExistsError:
        pass
    except OSError as error:
        # Some file systems have no links. There, two processes that mark a new store in the same
        # instant may get different ids; one of them then finds its store lost, and says so.
        if error.errno not in (errno.EPERM, errno.ENOTSUP, errno.ENOSYS):
            raise
        if read_marker(root) is None:
            os.rename(name, MARKER, src_dir_fd=root, dst_dir_fd=root)
