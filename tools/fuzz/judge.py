"""Calls a target with one input; raises if the target fails, or takes too much time or memory."""

import os
import resource
import time
from collections.abc import Callable
from contextlib import suppress

from service.errors import SurfaceError

SECONDS = 2.0
"""Seconds of processor time that one input may take."""

MEMORY = 100 << 20
"""Bytes by which the memory of the process may grow during one input."""

_PAGE = os.sysconf("SC_PAGESIZE")


class TooExpensive(Exception):
    """The target takes more time or memory for an input than allowed."""


def judge(target: Callable[[bytes], None], content: bytes, seconds: float = SECONDS) -> None:
    """Calls the target with an input.

    Raises
    ------
    TooExpensive
        The target takes more CPU seconds than `seconds`, or more memory than `MEMORY`.
    Exception
        Any exception of the target, except a `SurfaceError`, with which the service refuses input.
    """
    bytes_before, start = measure_resident(), time.process_time()
    peak_before = measure_peak()
    with suppress(SurfaceError):
        target(content)
    elapsed, peak = time.process_time() - start, measure_peak()
    if elapsed > seconds:
        raise TooExpensive(f"{elapsed:.1f} s for {len(content)} bytes")
    # Otherwise the peak is one of an earlier input.
    if peak > peak_before and peak - bytes_before > MEMORY:
        raise TooExpensive(f"{(peak - bytes_before) >> 20} MiB for {len(content)} bytes")


def measure_resident() -> int:
    """Bytes of memory that this process uses now (on Linux)."""
    with open("/proc/self/statm", "rb", buffering=0) as file:
        return int(file.read(64).split()[1]) * _PAGE


def measure_peak() -> int:
    """The largest number of bytes of memory that this process has used since its start."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
