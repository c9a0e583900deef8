"""Distributes tests to processes: all tests of a module, and all tests in `tests/web`, run in one.

A process closes its browser after the last of its current tests that use the browser. If a process
got one module of `tests/web` now and another later, it would start the browser twice, and a start
takes longer than the tests.
"""

import pytest
from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

BROWSER = "tests/web"


class Scheduling(LoadScopeScheduling):  # type: ignore[misc]
    """Distributes tests by modules; all tests in `tests/web` count as one module."""

    def _split_scope(self, nodeid: str) -> str:
        return BROWSER if nodeid.startswith(f"{BROWSER}/") else str(super()._split_scope(nodeid))


def choose_scheduling(config: pytest.Config, log: object) -> Scheduling | None:
    """The scheduling for the option `--dist loadscope`; None, xdist's own, for other options."""
    return Scheduling(config, log) if config.getoption("dist") == "loadscope" else None
