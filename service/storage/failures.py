"""Errors of obstore and the system: the log gets the full text, the client a short text."""

import errno
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager

from obstore.exceptions import BaseError

from service.errors import Issue, StoreFailed, StoreFull

DISK_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})
"""Error numbers of a full disk, and of an exceeded disk quota of the user."""

_log = logging.getLogger(__name__)


@contextmanager
def translate_errors(action: str) -> Iterator[None]:
    """Logs any error of a store in the `with` block; raises `StoreFull` or `StoreFailed` for it.

    Parameters
    ----------
    action : str
        The operation, for the log, such as "storing surfaces/ab/…".
    """
    try:
        yield
    except (BaseError, OSError, ValueError, TimeoutError) as error:
        # obstore appends a description of its internal objects to the text.
        reason = str(error).partition("\n\nDebug source")[0]
        _log.error("%s failed: %s", action, reason or type(error).__name__)
        if is_disk_full(error):
            raise disk_full() from None
        raise StoreFailed from None


def disk_full() -> StoreFull:
    """The error of a full disk; the quota may still have room."""
    return StoreFull(Issue("disk_full", "The disk of the service is full."))


def is_disk_full(error: Exception) -> bool:
    """Whether an error says that the disk is full.

    obstore has no class for this error: its messages end with the operating system's error number.
    """
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno in DISK_FULL
    text = str(error)
    return any(f"(os error {number})" in text for number in DISK_FULL)


def reason_of(error: OSError) -> str:
    """The operating system's reason, in words."""
    return error.strerror or (os.strerror(error.errno) if error.errno else str(error))
