"""Calls a target with one input; raises if the target crashes, or takes too long or too much."""

import os
import resource
import time
from collections.abc import Callable
from contextlib import suppress

from service.errors import SurfaceError

SECONDS = 2.0
"""Seconds of processor time that one input may take."""

MEMORY = 100 << 20
"""Bytes that the process may grow by with one input."""

_PAGE = os.sysconf("SC_PAGESIZE")


class TooExpensive(Exception):
    """An input that takes more time or memory than allowed."""


def judge(target: Callable[[bytes], None], content: bytes, seconds: float = SECONDS) -> None:
    """Calls the target; raises its errors, except refusals, and `TooExpensive`."""
    before, start = measure_resident(), time.process_time()
    most = measure_most_resident()
    with suppress(SurfaceError):  # a refusal
        target(content)
    elapsed, grown = time.process_time() - start, measure_most_resident()
    if elapsed > seconds:
        raise TooExpensive(f"{elapsed:.1f} s for {len(content)} bytes")
    if grown > most and grown - before > MEMORY:
        raise TooExpensive(f"{(grown - before) >> 20} MiB for {len(content)} bytes")


def measure_resident() -> int:
    """Bytes of memory that this process holds now (Linux)."""
    with open("/proc/self/statm", "rb", buffering=0) as file:
        return int(file.read(64).split()[1]) * _PAGE


def measure_most_resident() -> int:
    """The most bytes of memory that this process has ever held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
