"""File descriptors: every connection takes one, and systems allow few unless they are asked."""

import logging
import sys

if sys.platform != "win32":  # which has no such limit
    import resource

OTHERS = 128
"""Descriptors for all else: the log, the store, libraries, connections about to be refused."""

INFINITE = -1
"""What the system calls a limit that is none."""

_log = logging.getLogger(__name__)


def raise_limit(connections: int) -> None:
    """Allows as many open files as the system lets us have; warns if they will not do."""
    if sys.platform == "win32":
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = connections + OTHERS
    for wanted in (hard, needed):  # macOS calls its hard limit infinite, and refuses it
        if _below(soft, wanted):
            try:
                resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            except (ValueError, OSError):
                continue
            soft = wanted
    if _below(soft, needed):
        _log.warning(
            "%d connections need %d file descriptors, and the system allows %d",
            connections,
            needed,
            soft,
        )


def _below(limit: int, other: int) -> bool:
    """Whether a limit is lower than another."""
    return limit != INFINITE and (other == INFINITE or limit < other)
