"""What every test may use: the service running on a port of its own, and the rules of a run."""

import os
import threading
import time
from collections.abc import Generator, Iterator
from typing import TypeVar

import hypothesis
import pytest
import uvicorn

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)

# The same examples on every run and every machine; how long one takes is no property of it.
hypothesis.settings.register_profile("surface", derandomize=True, deadline=None)
hypothesis.settings.load_profile("surface")


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    """URL of the service, as uvicorn serves it, for the length of the test run."""
    config = uvicorn.Config(
        "service.api.app:create_app", factory=True, host="127.0.0.1", port=0, log_config=None
    )
    service = uvicorn.Server(config)
    thread = threading.Thread(target=service.run, name="server", daemon=True)
    thread.start()
    while not service.started:
        if not thread.is_alive():
            pytest.fail("the service did not start")
        time.sleep(0.01)
    port = service.servers[0].sockets[0].getsockname()[1]
    yield f"http://127.0.0.1:{port}"
    service.should_exit = True
    thread.join(timeout=10)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return _without_skips((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _without_skips((yield))


def _without_skips(report: Report) -> Report:
    """Where all tools are said to be installed, a skipped test is a failed one."""
    expected = hasattr(report, "wasxfail")
    if report.skipped and not expected and os.environ.get("SURFACE_TESTS_REQUIRE_TOOLS") == "1":
        report.outcome = "failed"
        report.longrepr = f"skipped where nothing may be skipped: {report.longrepr}"
    return report
