"""Fixtures for all tests: a service on a port of its own; and the rules of a test run."""

import os
from collections.abc import Generator, Iterator
from typing import TypeVar

import hypothesis
import pytest

from tests.scheduling import Scheduling, choose_scheduling

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)

# No test uses TLS, but each client of httpx would read all certificates of the system.
os.environ["SSL_CERT_DIR"] = os.path.dirname(__file__)

# The same few examples in every run; a slow example is not a failure.
# `make test-properties` uses many more, random examples.
hypothesis.settings.register_profile("surface", derandomize=True, deadline=None, max_examples=6)
hypothesis.settings.register_profile("deep", deadline=None, max_examples=300)
hypothesis.settings.load_profile("surface")


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    """URL of the running service, for the length of the test run."""
    # Imported here, because the process that distributes the tests does not need it.
    from tests.live import run_service  # noqa: PLC0415

    with run_service() as url:
        yield url


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    """The backend that runs coroutine tests marked with `anyio`."""
    return "asyncio"


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Scheduling | None:
    return choose_scheduling(config, log)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One more process than processors, because tests wait for browsers and servers."""
    return len(os.sched_getaffinity(0)) + 1


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return _fail_skipped((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _fail_skipped((yield))


def _fail_skipped(report: Report) -> Report:
    """With TESTS_REQUIRE_TOOLS=1 a skipped test is a failed one."""
    expected = hasattr(report, "wasxfail")
    if report.skipped and not expected and os.environ.get("TESTS_REQUIRE_TOOLS") == "1":
        report.outcome = "failed"
        report.longrepr = f"skipped where nothing may be skipped: {report.longrepr}"
    return report
