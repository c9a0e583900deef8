"""What goes wrong below: logged here in full, told to the client in a word."""

import errno
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager

from obstore.exceptions import BaseError

from service.errors import Issue, StoreFailed, StoreFull

DISK_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})
"""What a file system answers that has no room, or none for this user."""

_log = logging.getLogger(__name__)


@contextmanager
def failures(doing: str) -> Iterator[None]:
    """Turns whatever a store raises into `StoreFull` or `StoreFailed`.

    Parameters
    ----------
    doing : str
        What is being done, for the log: "storing surfaces/ab/…".
    """
    try:
        yield
    except (BaseError, OSError, ValueError, TimeoutError) as error:
        # obstore appends a dump of its own structures.
        reason = str(error).partition("\n\nDebug source")[0]
        _log.error("%s failed: %s", doing, reason or type(error).__name__)
        if is_disk_full(error):
            raise disk_full() from None
        raise StoreFailed from None


def disk_full() -> StoreFull:
    """The disk has no room, whatever the quota says."""
    return StoreFull(Issue("disk_full", "The disk of the service is full."))


def is_disk_full(error: Exception) -> bool:
    """Whether an error says that the disk is full.

    obstore has no class for it: its errors end in the operating system's own number.
    """
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno in DISK_FULL
    text = str(error)
    return any(f"(os error {number})" in text for number in DISK_FULL)


def reason_of(error: OSError) -> str:
    """Why the operating system refuses, in words."""
    return error.strerror or (os.strerror(error.errno) if error.errno else str(error))
