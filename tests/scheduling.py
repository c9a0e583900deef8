"""Distributes tests to processes: all tests of a module run in one, those in `tests/web` in two.

A process closes its browser after the last of its current tests that use the browser. If a process
got one module of `tests/web` now and another later, it would start the browser twice, and a start
takes longer than most tests.

Modules that start programs run first, because some of them take long for few tests: otherwise the
last of them would run alone while the other processes have nothing to do any more.
"""

from collections.abc import MutableSequence
from zlib import crc32

import pytest
from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

BROWSER = "tests/web"
EARLY = (
    BROWSER,
    "tests/server",
    "tests/jobs",
    "tests/test_",
    "tests/cli",
    "tests/deploy",
    "tests/tools",
    "tests/api",
)
"""Beginnings of the paths of modules that start programs, the slowest first."""


def put_slow_modules_first(items: MutableSequence[pytest.Item]) -> None:
    """Sorts tests by the beginnings of their paths in `EARLY`; all others come last."""
    items[:] = sorted(items, key=_rank)


def _rank(item: pytest.Item) -> int:
    ranks = (rank for rank, path in enumerate(EARLY) if item.nodeid.startswith(path))
    return next(ranks, len(EARLY))


class Scheduling(LoadScopeScheduling):  # type: ignore[misc]
    """Distributes tests by modules; those in `tests/web` count as two, of similar lengths."""

    def _split_scope(self, nodeid: str) -> str:
        module = str(super()._split_scope(nodeid))
        if not module.startswith(f"{BROWSER}/"):
            return module
        return f"{BROWSER} {crc32(module.encode()) % 2}"


def choose_scheduling(config: pytest.Config, log: object) -> Scheduling | None:
    """The scheduling for the option `--dist loadscope`; None, xdist's own, for other options."""
    if config.getoption("dist") != "loadscope":
        return None
    config.option.loadscopereorder = False  # keep the order of `put_slow_modules_first`
    return Scheduling(config, log)
