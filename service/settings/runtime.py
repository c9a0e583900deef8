"""Set-up of the process: BLAS threads, the heap, the garbage collector, and the memory limit."""

import ctypes
import gc
import math
import os
import platform
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import numpy as np  # noqa: F401  (its BLAS must be loaded before it can be set up)
from threadpoolctl import threadpool_limits

from service.bases.cache import MESH_PLANS

MIN_MEMORY = 1 << 24
"""Bytes of memory: with less, the service could hardly compute any mesh."""

MAX_PLAN_BYTES = 512 << 20
"""The most bytes of all plans and prepared parts. A quarter of it, the most for one plan, has room
for the faces of one patch of 4,500,000 vertices, the most that a mesh has by default."""

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
    """Lets plans and prepared parts take 1/16 of `memory` bytes, and at most `MAX_PLAN_BYTES`."""
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


def half_of_memory(root: Path = Path("/")) -> int:
    """Half of the bytes of memory that this process may use, and at least `MIN_MEMORY`.

    It may use the memory of the machine, within the limits of its control groups. `root` is another
    folder only in tests.

    References
    ----------
    cgroups(7); Linux, Documentation/admin-guide/cgroup-v2.rst, memory.max; cgroup-v1/memory.rst,
    memory.limit_in_bytes.
    """
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    for version, group in _groups("memory", root):
        text = _read(group / ("memory.max" if version == 2 else "memory.limit_in_bytes"))
        if text.isdigit():  # a group without a limit has "max"
            limits.append(int(text))
    return max(MIN_MEMORY, min(limits) // 2)


def count_processors(root: Path = Path("/")) -> int:
    """The number of processors that this process may use.

    These are the processors of its affinity mask, within the quotas of its control groups; part of
    a processor counts as one. `root` is another folder only in tests.

    References
    ----------
    sched_setaffinity(2); Linux, Documentation/admin-guide/cgroup-v2.rst, cpu.max;
    Documentation/scheduler/sched-bwc.rst, cpu.cfs_quota_us.
    """
    if hasattr(os, "sched_getaffinity"):
        count = len(os.sched_getaffinity(0))
    else:
        count = os.cpu_count() or 1
    for version, group in _groups("cpu", root):
        # Both are in microseconds: the group may compute for `quota` in each `period`.
        if version == 2:
            quota, _, period = _read(group / "cpu.max").partition(" ")
        else:
            quota, period = (_read(group / f"cpu.cfs_{name}_us") for name in ("quota", "period"))
        if quota.isdigit() and period.isdigit():  # a group without a quota has "max" or -1
            count = min(count, max(1, math.ceil(int(quota) / int(period))))
    return count


def _groups(controller: str, root: Path) -> Iterator[tuple[int, Path]]:
    """The folders of the control groups of this process and of their parents, for a controller.

    Each comes with the version of control groups, 1 or 2.
    """
    for line in _read(root / "proc/self/cgroup").splitlines():  # empty if this is not Linux
        _, controllers, path = line.split(":", 2)
        folder = root / "sys/fs/cgroup"
        if controllers and controller not in controllers.split(","):
            continue
        version = 1 if controllers else 2
        # In a container the path may exist only on the host; the limit is then in the top folder.
        group_path = PurePosixPath(path.lstrip("/"))
        for group in (group_path, *group_path.parents):
            yield version, (folder / controller if controllers else folder) / group


def _read(file: Path) -> str:
    """The text of a file of the system; empty if it cannot be read."""
    try:
        return file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeError):
        return ""
