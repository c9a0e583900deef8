"""Set-up of the process: BLAS threads, the heap, the garbage collector, and the memory limit."""

import ctypes
import gc
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

import numpy as np  # noqa: F401  (its BLAS must be loaded before it can be set up)
from threadpoolctl import threadpool_limits

from service.bases.cache import MESH_PLANS

MIN_MEMORY = 1 << 24
"""Bytes of memory: with less, the service could hardly compute any mesh."""

MAX_PLAN_BYTES = 256 << 20
"""The most bytes of all mesh plans, enough for 12 plans of 1,000,000 vertices."""

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Numbers of the parameters of `mallopt`, from glibc's `malloc.h`."""

MMAP_BYTES, FREE_BYTES = 1 << 22, 1 << 26
"""Bytes. A block of `MMAP_BYTES` or more has pages of its own, which go back to the system when the
block is freed. The heap may keep `FREE_BYTES` free bytes at its end."""


def pin_blas() -> None:
    """Keeps BLAS on one thread for the rest of the process.

    The matrices of a surface are small. Several threads would mostly wait for each other, and under
    load the slowest requests would take 20 times as long.
    """
    threadpool_limits(limits=1, user_api="blas")


def share_heap() -> None:
    """Makes all threads use one heap, and lets it keep `FREE_BYTES` free bytes at its end.

    With glibc's default, a heap for each thread, 333 MB stayed resident after a few large meshes;
    with one heap, 282 MB. If every large block had pages of its own, the system would zero them
    for each mesh, which takes up to twice as long as the mesh. Does nothing without glibc.

    References
    ----------
    mallopt(3): glibc adjusts both thresholds itself unless a program sets them.
    """
    if platform.libc_ver()[0] == "glibc":
        libc = ctypes.CDLL(None)
        libc.mallopt(M_MMAP_THRESHOLD, MMAP_BYTES)
        libc.mallopt(M_TRIM_THRESHOLD, FREE_BYTES)
        libc.mallopt(M_ARENA_MAX, 1)


def limit_plans(memory: int) -> None:
    """Lets mesh plans take 1/16 of `memory` bytes, and at most `MAX_PLAN_BYTES`."""
    MESH_PLANS.capacity = min(memory // 16, MAX_PLAN_BYTES)


def trim_heap() -> None:
    """Gives whole free pages of the heap back to the system.

    The heap has the blocks below `MMAP_BYTES`; larger blocks go back at once.

    References
    ----------
    malloc_trim(3).
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)


def collect_rarely() -> None:
    """Makes Python look for reference cycles less often.

    By default Python 3.11 looks after every 700 new objects; to parse a document of 3 MB then takes
    2.5 times as long.
    """
    # Looks at generation 0 after 50,000 new objects, at 1 and 2 after 20 and 100 collections of the
    # generation before.
    gc.set_threshold(50_000, 20, 100)


@contextmanager
def pause_collection() -> Iterator[None]:
    """Switches the garbage collector off in the `with` block.

    For parsing a document, which makes no reference cycles.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def half_of_memory(root: Path = Path("/")) -> int:
    """Half of the bytes of memory that this process may use, and at least `MIN_MEMORY`.

    It may use the memory of the machine, within the limits of its control groups. `root` is another
    folder only in tests.

    References
    ----------
    cgroups(7); Linux, Documentation/admin-guide/cgroup-v2.rst, memory.max; cgroup-v1/memory.rst,
    memory.limit_in_bytes.
    """
    machine = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(MIN_MEMORY, min([machine, *_limits(root)]) // 2)


def _limits(root: Path) -> Iterator[int]:
    """Memory limits, in bytes, of the control groups of this process and of their parents."""
    try:
        lines = (root / "proc/self/cgroup").read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeError):
        return  # not Linux
    groups = root / "sys/fs/cgroup"
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if not controllers:  # version 2 of control groups
            folder, name = groups, "memory.max"
        elif "memory" in controllers.split(","):
            folder, name = groups / "memory", "memory.limit_in_bytes"
        else:
            continue
        # In a container the path may exist only on the host; the limit is then in the top folder.
        group_path = PurePosixPath(path.lstrip("/"))
        for group in (group_path, *group_path.parents):
            try:
                text = (folder / group / name).read_text(encoding="ascii")
            except (OSError, UnicodeError):
                continue
            if text.strip().isdigit():  # a group without a limit has "max"
                yield int(text)
