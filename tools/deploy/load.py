"""Sends requests of many clients at once, each in a thread, and counts the responses.

The clients use `http.client`, which never repeats a request. Other libraries send a request again
if the connection was closed, so that the tests would not notice the closed connection.
"""

import gzip
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field
from http.client import HTTPConnection, HTTPException

from tools.deploy.traffic import Request, Response, Traffic
from tools.processes import HOST

TIMEOUT = 90.0
"""Seconds without a byte after which a request counts as failed."""


@dataclass
class Tally:
    """The times of complete requests by kind, and the failed requests."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    incomplete_responses: list[str] = field(default_factory=list)
    """Requests without a complete response."""
    wrong_responses: list[str] = field(default_factory=list)
    """Requests with a complete but wrong response."""

    @property
    def count(self) -> int:
        """Number of requests that have ended, with or without a complete response."""
        return sum(map(len, list(self.seconds.values()))) + len(self.incomplete_responses)

    def format_lines(self) -> list[str]:
        """The lines of a table: number, median, 99th percentile and longest time of each kind."""
        summary = (
            f"{self.count} requests, {len(self.incomplete_responses)} broken, "
            f"{len(self.wrong_responses)} wrong"
        )
        return [summary] + [
            f"  {kind:<11} {len(times):>6}   p50 {_read_quantile(times, 0.5):>8.1f} ms"
            f"   p99 {_read_quantile(times, 0.99):>8.1f} ms   longest {max(times) * 1e3:>8.1f} ms"
            for kind, times in sorted(self.seconds.items())
        ]


@dataclass(frozen=True)
class Clients:
    """A group of clients, each of which sends one request after the other.

    `kinds` are the kinds of requests with their weights, as for `Traffic.requests`.
    """

    number: int
    """Number of clients."""
    kinds: dict[str, int]
    keeps_connection: bool = True
    """Whether clients keep their connection, or open a new one for each request."""
    pause: float = 0.0
    """Seconds between a response and the next request."""


def run_under_load(
    port: int, traffic: Traffic, groups: tuple[Clients, ...], action: Callable[[Tally], None]
) -> Tally:
    """Sends the requests of all clients to a port of this machine while `action` runs.

    Then it waits for the running requests, and returns the results. The argument of `action` is the
    tally of the results so far.
    """
    tally = Tally()
    is_over = threading.Event()

    def send_until_over(group: Clients) -> None:
        with closing(HTTPConnection(HOST, port, timeout=TIMEOUT)) as connection:
            for request in traffic.requests(group.kinds):
                if is_over.wait(group.pause):
                    break
                _send_one(connection, request, traffic, tally)
                if not group.keeps_connection:
                    connection.close()

    with ThreadPoolExecutor(sum(group.number for group in groups)) as pool:
        clients = [
            pool.submit(send_until_over, group) for group in groups for _ in range(group.number)
        ]
        try:
            action(tally)
        finally:
            is_over.set()
    for client in clients:
        client.result()
    return tally


def _send_one(connection: HTTPConnection, request: Request, traffic: Traffic, tally: Tally) -> None:
    """Sends one request, checks the response, and adds the result to the tally."""
    start = time.perf_counter()
    try:
        response = _send(connection, request)
    except (OSError, EOFError, HTTPException) as error:
        connection.close()
        tally.incomplete_responses.append(f"{time.strftime('%X')} {_describe(request)}: {error!r}")
        return
    tally.seconds[request.kind].append(time.perf_counter() - start)
    if fault := traffic.find_fault(request, response):
        tally.wrong_responses.append(f"{time.strftime('%X')} {_describe(request)}: {fault}")


def _send(connection: HTTPConnection, request: Request) -> Response:
    """Sends one request; returns the response with its decoded body."""
    connection.request(request.method, request.target, request.body or None, request.headers)
    answer = connection.getresponse()
    body = answer.read()
    if answer.headers["Content-Encoding"] == "gzip":
        body = gzip.decompress(body)
    return Response(answer.status, answer.headers["Location"], body)


def _describe(request: Request) -> str:
    """Kind, method and target of a request."""
    return f"{request.kind}, {request.method} {request.target}"


def _read_quantile(times: list[float], share: float) -> float:
    """A quantile of times in seconds, as milliseconds."""
    return sorted(times)[min(int(len(times) * share), len(times) - 1)] * 1e3
