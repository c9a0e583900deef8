"""Distributes tests to processes: a module to one process, and all tests in the browser to one.

A process closes its browser after the browser's tests. If it got one module of these now and
another later, it would start the browser again, which takes longer than the tests.
"""

import pytest
from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

BROWSER = "tests/web"


class Scheduling(LoadScopeScheduling):  # type: ignore[misc]
    """Distributes by modules; all tests in the browser count as one module."""

    def _split_scope(self, nodeid: str) -> str:
        return BROWSER if nodeid.startswith(f"{BROWSER}/") else str(super()._split_scope(nodeid))


def choose_scheduling(config: pytest.Config, log: object) -> Scheduling | None:
    """Replaces xdist's own scheduling by modules."""
    return Scheduling(config, log) if config.getoption("dist") == "loadscope" else None
