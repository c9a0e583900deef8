"""Fixtures for all tests, for example the URL of a running service; and hooks of pytest.

The hooks choose which process runs which test, and make skipped tests fail in `.ci/run`.
"""

import gc
import os
import time
import tracemalloc
from collections.abc import Generator, Iterator
from typing import TypeVar

import hypothesis
import pytest

from tests.clock import Clock, stop_clock
from tests.scheduling import Scheduling, choose_scheduling, put_slow_modules_first

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)

# No test uses TLS, but each client of httpx would read all certificates of the system.
os.environ["SSL_CERT_DIR"] = os.path.dirname(__file__)

# Every run tests each property on the same six examples, and no example has a time limit.
# `make test-properties` uses 300 random examples.
hypothesis.settings.register_profile("surface", derandomize=True, deadline=None, max_examples=6)
hypothesis.settings.register_profile("deep", deadline=None, max_examples=300)
hypothesis.settings.load_profile("surface")

_stop_tracing = tracemalloc.stop


def _stop_tracing_when_quiet() -> None:
    """Stops `tracemalloc` when threads of services in this process have ended their allocations.

    Python 3.11 crashes if it stops while another thread, which waits for Python's lock in an
    allocation, has yet to record it.
    """
    time.sleep(0.01)  # the other threads get the lock
    _stop_tracing()


tracemalloc.stop = _stop_tracing_when_quiet


def _sync_nothing(fd: object) -> None:
    """In place of `os.fsync`, which takes 5 ms: no file of a test need survive a power failure.

    Services that tests start as processes do sync.
    """


os.fsync = _sync_nothing


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    """The URL of one service that runs until the last test of this process ends."""
    # The process that only distributes the tests calls no fixture, so it need not import FastAPI.
    from tools.live import run_service  # noqa: PLC0415

    with run_service() as url:
        yield url


@pytest.fixture
def clock() -> Iterator[Clock]:
    """A clock that the test sets, in place of `time.monotonic`."""
    with stop_clock() as clock:
        yield clock


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    """The backend that runs coroutine tests marked with `anyio`."""
    return "asyncio"


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collects tests without looking for reference cycles, which would take a third of the time.

    The modules, which all stay, are then left out whenever a test looks for cycles.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    put_slow_modules_first(items)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Scheduling | None:
    return choose_scheduling(config, log)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """The number of test processes: one more than processors, because tests wait for browsers and
    servers."""
    return len(os.sched_getaffinity(0)) + 1


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return _fail_skipped((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _fail_skipped((yield))


def _fail_skipped(report: Report) -> Report:
    """The report; with TESTS_REQUIRE_TOOLS=1 a skipped test is reported as failed.

    pytest also reports a test marked `xfail` as skipped; its report stays.
    """
    is_expected_failure = hasattr(report, "wasxfail")
    if report.skipped and not is_expected_failure and os.environ.get("TESTS_REQUIRE_TOOLS") == "1":
        report.outcome = "failed"
        report.longrepr = f"skipped, but TESTS_REQUIRE_TOOLS=1 forbids it: {report.longrepr}"
    return report
