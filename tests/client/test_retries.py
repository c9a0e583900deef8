"""A client repeats its request to a busy service, as `Retry-After` says, until its deadline."""

import json
import threading
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from service.cli.main import main
from service.client import Client, ServiceError, Signed
from service.client.connection import DirectTransport
from tests.clock import Clock

BUSY = {"code": "busy", "detail": "It has much to do.", "errors": []}
"""The members that the client reads of a problem document, for a refusal of any status."""


class BusyServer(HTTPServer):
    """Responds to the first requests with `refusals` (status and headers), then with success.

    Counts the requests.
    """

    refusals: list[tuple[int, dict[str, str]]]
    requests = 0


class Handler(BaseHTTPRequestHandler):
    """Responds to one request as its server's `refusals` say."""

    server: BusyServer

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        self.server.requests += 1
        status, headers = self.server.refusals.pop(0) if self.server.refusals else (200, {})
        subtype, content = ("json", {}) if status == 200 else ("problem+json", BUSY)
        body = json.dumps(content).encode()
        self.send_response(status)
        headers |= {"Content-Type": f"application/{subtype}", "Content-Length": str(len(body))}
        for header, value in headers.items():
            self.send_header(header, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Writes no log to the terminal."""


@pytest.fixture
def server() -> Iterator[BusyServer]:
    with BusyServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> list[float]:
    """The seconds of each wait of the client, which does not really sleep: only the clock runs."""
    waits: list[float] = []

    async def sleep(_: object, seconds: float) -> None:
        waits.append(seconds)
        clock.now += seconds

    monkeypatch.setattr(DirectTransport, "sleep", sleep)
    return waits


def ask(server: BusyServer, *refusals: tuple[int, dict[str, str]], timeout: float = 100) -> Signed:
    """The answer to a call that the server first refuses with these responses."""
    server.refusals = list(refusals)
    with Client(f"http://127.0.0.1:{server.server_port}", timeout=timeout) as client:
        return client.sign("/v1/surfaces/sphere", seconds=60)


def test_the_client_waits_as_the_header_retry_after_says(
    server: BusyServer, waits: list[float]
) -> None:
    moment = format_datetime(datetime.now(UTC) + timedelta(seconds=50), usegmt=True)
    refusals = [(429, {"Retry-After": "2"}), (503, {"Retry-After": moment})]
    assert ask(server, *refusals).to_dict() == {}
    assert waits == [2.0, pytest.approx(50, abs=2)]


def test_retries_end_before_the_deadline(server: BusyServer, waits: list[float]) -> None:
    with pytest.raises(ServiceError) as error:
        ask(server, *[(429, {"Retry-After": "4"})] * 9, timeout=10)
    assert (error.value.status, error.value.code, str(error.value)) == (
        429, "busy", "It has much to do.",
    )  # fmt: skip
    assert (waits, server.requests) == ([4.0, 4.0], 3)


def test_a_wait_beyond_the_deadline_is_not_begun(server: BusyServer, waits: list[float]) -> None:
    with pytest.raises(ServiceError):
        ask(server, (503, {"Retry-After": "900"}))
    assert (waits, server.requests) == ([], 1)


def test_a_command_waits_for_a_limited_time(
    server: BusyServer, waits: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    server.refusals = [(429, {"Retry-After": "40"})] * 9
    url = f"http://127.0.0.1:{server.server_port}"
    command = ["store", "sphere", "--url", url]
    assert main(command) == 3
    assert waits == [40.0, 40.0]
    assert "is busy: It has much to do." in capsys.readouterr().err


@pytest.mark.parametrize("status", [429, 503])
@pytest.mark.parametrize("headers", [{}, {"Retry-After": "soon"}])
def test_without_a_time_a_request_is_not_repeated(
    server: BusyServer, waits: list[float], status: int, headers: dict[str, str]
) -> None:
    with pytest.raises(ServiceError):
        ask(server, (status, headers))
    assert (waits, server.requests) == ([], 1)
