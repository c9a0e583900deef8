"""A client repeats its request to a busy service, at most RETRIES times."""

import json
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from types import SimpleNamespace

import pytest

from service.errors import ServiceFailed
from service.remote.calls import post
from service.remote.connection import MAX_WAIT, RETRIES

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
def waits(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The seconds of each call of `sleep` by the client, which does not really sleep."""
    waits: list[float] = []
    sleep: Callable[[float], None] = waits.append
    monkeypatch.setattr("service.remote.connection.time", SimpleNamespace(sleep=sleep))
    return waits


def send(server: BusyServer, *refusals: tuple[int, dict[str, str]]) -> bytes:
    """The body of the response to a request that the server first refuses with these responses."""
    server.refusals = list(refusals)
    return post(f"http://127.0.0.1:{server.server_port}", "/v1/points", {})


def test_the_client_waits_as_the_header_retry_after_says(
    server: BusyServer, waits: list[float]
) -> None:
    """It waits at most `MAX_WAIT` seconds, and as long if the header is a date."""
    refusals = [
        (429, {"Retry-After": "2"}),
        (503, {"Retry-After": "900"}),
        (429, {"Retry-After": "Sat, 21 Nov 2026 16:00:00 GMT"}),
    ]
    assert send(server, *refusals) == b"{}"
    assert waits == [2.0, MAX_WAIT, MAX_WAIT]


def test_number_of_retries_is_limited(server: BusyServer, waits: list[float]) -> None:
    with pytest.raises(ServiceFailed, match=r"is busy: It has much to do\."):
        send(server, *[(429, {"Retry-After": "1"})] * (RETRIES + 1))
    assert (waits, server.requests) == ([1.0] * RETRIES, RETRIES + 1)


@pytest.mark.parametrize("status", [429, 503])
def test_without_retry_after_a_request_is_not_repeated(
    server: BusyServer, waits: list[float], status: int
) -> None:
    with pytest.raises(ServiceFailed):
        send(server, (status, {}))
    assert (waits, server.requests) == ([], 1)
