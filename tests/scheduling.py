"""Which process gets which tests, where there are several: all of a module, and all of the browser.

The browser is closed whenever a process leaves its tests. If it were given one module of them now
and another later, it would start it as many times, which takes longer than the tests.
"""

import pytest
from xdist.scheduler import LoadScopeScheduling  # type: ignore[import-untyped]

BROWSER = "tests/web"


class Scheduling(LoadScopeScheduling):  # type: ignore[misc]
    """By modules, but that the tests in the browser are one."""

    def _split_scope(self, nodeid: str) -> str:
        return BROWSER if nodeid.startswith(f"{BROWSER}/") else str(super()._split_scope(nodeid))


def scheduling(config: pytest.Config, log: object) -> Scheduling | None:
    """Replaces xdist's own scheduling by modules."""
    return Scheduling(config, log) if config.getoption("dist") == "loadscope" else None
