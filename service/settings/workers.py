"""How many workers serve, and which part of the memory and of the processors each of them has."""

import sys

from service.errors import InvalidSettings
from service.settings.runtime import MIN_MEMORY, count_processors
from service.settings.values import Settings

MAX_AUTOMATIC, AUTOMATIC_BYTES = 4, 1 << 30
"""With `workers=0`: the most workers, and the least bytes of the machine's memory for each."""

PROCESS_BYTES = 150_000_000
"""Bytes of memory that a worker takes beside those of its requests."""

IN_MEMORY = "memory:"
"""The first letters of the address of a store that only its own process can read."""


def count_workers(settings: Settings) -> int:
    """The number of workers.

    Raises
    ------
    InvalidSettings
        Several workers cannot run on this system, with this store, with this memory, or with so few
        ports for their metrics.
    """
    is_in_memory = settings.store.startswith(IN_MEMORY)
    ports = (1 << 16) - settings.metrics_port  # the ports from that number on
    if settings.workers == 0:
        if is_in_memory or sys.platform != "linux":
            return 1
        most = 2 * settings.memory_bytes // AUTOMATIC_BYTES
        return max(1, min(count_processors(), MAX_AUTOMATIC, most, ports))
    if settings.workers == 1:
        return 1
    most = max(1, 2 * settings.memory_bytes // (2 * MIN_MEMORY + PROCESS_BYTES))
    needed = ""
    if sys.platform != "linux":
        needed = "1 on this system: several workers need Linux"
    elif is_in_memory:
        needed = f"1 with SURFACE_STORE={settings.store}: each worker would have another store"
    elif settings.workers > most:
        needed = f"at most {most} with SURFACE_MEMORY_BYTES={settings.memory_bytes}"
    elif settings.workers > ports:
        needed = f"fewer with SURFACE_METRICS_PORT={settings.metrics_port}"
    if needed:
        raise InvalidSettings(f"SURFACE_WORKERS: got {settings.workers}, needed {needed}.")
    return settings.workers


def share_settings(settings: Settings, count: int) -> Settings:
    """The settings of each of `count` workers: its part of the memory and of the processors.

    `memory_bytes` is half of the memory M of the machine. So each worker has
    (M - PROCESS_BYTES · count) / 2 / count bytes for requests; a single worker has `memory_bytes`.
    """
    if count == 1:
        return settings
    return settings.model_copy(
        update={
            "memory_bytes": settings.memory_bytes // count - PROCESS_BYTES // 2,
            "threads": settings.threads or max(1, count_processors() // count),
            "job_processes": max(1, settings.job_process_count // count),
        }
    )
