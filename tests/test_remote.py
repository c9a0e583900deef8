"""A service elsewhere that is busy: it is asked again, for a while."""

import json
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from types import SimpleNamespace

import pytest

from service.errors import ServiceFailed
from service.remote import MAX_WAIT, RETRIES, remote_document

BUSY = {"status": 429, "code": "busy", "detail": "It has much to do.", "errors": []}


class Served(HTTPServer):
    """Refuses some requests with these headers, and answers what comes then."""

    refusals: list[tuple[int, dict[str, str]]]
    asked = 0


class Answering(BaseHTTPRequestHandler):
    """One request."""

    server: Served

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        self.server.asked += 1
        status, headers = self.server.refusals.pop(0) if self.server.refusals else (200, {})
        kind, content = ("json", {}) if status == 200 else ("problem+json", BUSY)
        body = json.dumps(content).encode()
        self.send_response(status)
        sent = {"Content-Type": f"application/{kind}", "Content-Length": str(len(body))}
        for header, value in (sent | headers).items():
            self.send_header(header, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Keeps quiet."""


@pytest.fixture
def server() -> Iterator[Served]:
    with Served(("127.0.0.1", 0), Answering) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The seconds that would be waited."""
    found: list[float] = []
    wait: Callable[[float], None] = found.append
    monkeypatch.setattr("service.remote.time", SimpleNamespace(sleep=wait))
    return found


def asked(server: Served, *refusals: tuple[int, dict[str, str]]) -> bytes:
    server.refusals = list(refusals)
    return remote_document(f"http://127.0.0.1:{server.server_port}", "/v1/points", {})


def test_busy_service_is_asked_again_when_it_says(server: Served, waits: list[float]) -> None:
    later = [(429, {"Retry-After": "2"}), (503, {"Retry-After": "900"})]
    assert asked(server, *later, (429, {"Retry-After": "Sat, 21 Nov 2026 16:00:00 GMT"})) == b"{}"
    assert waits == [2.0, MAX_WAIT, MAX_WAIT]


def test_service_that_stays_busy_is_left(server: Served, waits: list[float]) -> None:
    with pytest.raises(ServiceFailed, match=r"is busy: It has much to do\."):
        asked(server, *[(429, {"Retry-After": "1"})] * (RETRIES + 1))
    assert (waits, server.asked) == ([1.0] * RETRIES, RETRIES + 1)


@pytest.mark.parametrize("status", [429, 503])
def test_service_that_says_no_time_is_not_asked_again(
    server: Served, waits: list[float], status: int
) -> None:
    with pytest.raises(ServiceFailed):
        asked(server, (status, {}))
    assert (waits, server.asked) == ([], 1)
