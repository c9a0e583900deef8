"""The process: what it is told before it computes anything, and how much memory it may take."""

import ctypes
import gc
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

import numpy as np  # noqa: F401  (its BLAS must be loaded before it can be told anything)
from threadpoolctl import threadpool_limits

from service.bases.cache import MESH_PLANS

LEAST = 1 << 24
"""Bytes below which the service answers hardly anything."""

PLANS = 256 << 20
"""Bytes at most of the plans of meshes: enough for a dozen of a million vertices."""

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Numbers of the parameters in glibc's `malloc.h`."""

OWN_PAGES, KEPT = 1 << 22, 1 << 26
"""Bytes from which a block of memory has pages of its own, which it gives back when it is freed;
and bytes that are free and stay at the end of the heap."""


def pin_blas() -> None:
    """Keeps BLAS on one thread for the rest of the process.

    The matrices of a surface are small: more threads only wait for each other, and under load
    the slowest requests take twenty times as long.
    """
    threadpool_limits(limits=1, user_api="blas")


def share_heap() -> None:
    """Makes all threads use one heap, and lets it keep up to `KEPT` bytes that are free at its end.

    With a heap for each thread, as glibc has it, 333 MB were resident after a few large meshes
    where now 282 are. If every large block had pages of its own, the system would zero them for
    each mesh anew, which takes up to twice as long as the mesh. Without glibc nothing is done.

    References
    ----------
    mallopt(3): the first two adjust themselves unless they are set.
    """
    if platform.libc_ver()[0] == "glibc":
        libc = ctypes.CDLL(None)
        libc.mallopt(M_MMAP_THRESHOLD, OWN_PAGES)
        libc.mallopt(M_TRIM_THRESHOLD, KEPT)
        libc.mallopt(M_ARENA_MAX, 1)


def bound_plans(memory: int) -> None:
    """Lets plans of meshes take 1/16 of this memory in bytes, and at most `PLANS`."""
    MESH_PLANS.capacity = min(memory // 16, PLANS)


def give_back() -> None:
    """Hands whole pages that nothing lies on back to the system: of blocks below `OWN_PAGES`.

    References
    ----------
    malloc_trim(3).
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)


def collect_rarely() -> None:
    """Makes Python look seldom for objects that refer to each other and to which nothing else does.

    It does so at every 700 objects more: a document of 3 MB takes 2.5 times as long to parse.
    """
    gc.set_threshold(50_000, 20, 100)


@contextmanager
def collection_paused() -> Iterator[None]:
    """Python does not look for them: a document that is parsed has none."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def half_of_memory(root: Path = Path("/")) -> int:
    """Half of the memory of the machine, or of the control group of this process, in bytes.

    References
    ----------
    cgroups(7); Linux, Documentation/admin-guide/cgroup-v2.rst, memory.max; cgroup-v1/memory.rst,
    memory.limit_in_bytes.
    """
    machine = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(LEAST, min([machine, *_limits(root)]) // 2)


def _limits(root: Path) -> Iterator[int]:
    """Limits of the control groups of this process, and of those that these are in."""
    try:
        lines = (root / "proc/self/cgroup").read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeError):
        return  # no Linux
    groups = root / "sys/fs/cgroup"
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if not controllers:
            place, name = groups, "memory.max"
        elif "memory" in controllers.split(","):
            place, name = groups / "memory", "memory.limit_in_bytes"
        else:
            continue
        # Within a container the path may be the host's, and the limit lie at the top.
        own = PurePosixPath(path.lstrip("/"))
        for group in (own, *own.parents):
            try:
                text = (place / group / name).read_text(encoding="ascii")
            except (OSError, UnicodeError):
                continue
            if text.strip().isdigit():  # else "max": no limit
                yield int(text)
