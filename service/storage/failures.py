"""Errors of obstore and the system, and the outcomes of a store's operations.

The log gets the full text of an error, the client a short text.
"""

import errno
import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from obstore.exceptions import BaseError, PermissionDeniedError, UnauthenticatedError

from service.errors import DamagedObject, Issue, StoreFailed, StoreFull

DISK_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})
"""Error numbers of a full disk, and of an exceeded disk quota of the user."""

READ_ONLY = frozenset({errno.EROFS, errno.EACCES, errno.EPERM})
"""Error numbers of a read-only file system, and of files that this user may not write."""

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


def is_read_only(error: Exception) -> bool:
    """Whether the error of a write says that this process may not write to the store."""
    if isinstance(error, OSError):
        return error.errno in READ_ONLY
    return isinstance(error, PermissionDeniedError | UnauthenticatedError)


def reason_of(error: OSError) -> str:
    """The operating system's reason, in words."""
    return error.strerror or (os.strerror(error.errno) if error.errno else str(error))


@dataclass(slots=True)
class Total:
    """The number of operations of one kind with one outcome, and the sum of their seconds."""

    count: int = 0
    seconds: float = 0.0


class Operations:
    """Totals by kind and outcome: `done`, `refused` (the store is full) or `failed`."""

    def __init__(self) -> None:
        self.totals: dict[tuple[str, str], Total] = {}

    @contextmanager
    def count(self, kind: str) -> Iterator[None]:
        """Counts the operation in the `with` block; only failures of the store count as failed."""
        start, outcome = time.perf_counter(), "done"
        try:
            yield
        except StoreFull:
            outcome = "refused"
            raise
        except (StoreFailed, DamagedObject):
            outcome = "failed"
            raise
        finally:
            total = self.totals.setdefault((kind, outcome), Total())
            total.count += 1
            total.seconds += time.perf_counter() - start
