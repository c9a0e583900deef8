"""How much memory the process may take: that of the machine, or of its container."""

import os
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

LEAST = 1 << 24
"""Bytes below which the service answers hardly anything."""


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
