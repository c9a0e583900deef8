"""Many clients at once, each a thread, and counts of their responses.

It uses `http.client`, which never repeats a request: other clients hide a closed connection by
sending the request again.
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

from tools.deploy.traffic import Answer, Request, Traffic
from tools.processes import HOST

TOO_LATE = 90.0
"""Seconds without a byte after which a response counts as missing."""


@dataclass
class Tally:
    """The times of requests by kind, and the failed requests."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    broken: list[str] = field(default_factory=list)
    """Requests without a complete response."""
    wrong: list[str] = field(default_factory=list)
    """Requests with a complete but wrong response."""

    @property
    def count(self) -> int:
        """Requests that have ended."""
        return sum(map(len, list(self.seconds.values()))) + len(self.broken)

    def lines(self) -> list[str]:
        """A table: kind, number, median, 99th percentile and longest time."""
        yes = f"{self.count} requests, {len(self.broken)} broken, {len(self.wrong)} wrong"
        return [yes] + [
            f"  {kind:<11} {len(times):>6}   p50 {_read_quantile(times, 0.5):>8.1f} ms"
            f"   p99 {_read_quantile(times, 0.99):>8.1f} ms   longest {max(times) * 1e3:>8.1f} ms"
            for kind, times in sorted(self.seconds.items())
        ]


@dataclass(frozen=True)
class Clients:
    """Several clients, each of which sends one request after the other."""

    number: int
    kinds: dict[str, int]
    keep: bool = True
    """Whether clients keep their connection, or open a new one for each request."""
    pause: float = 0.0
    """Seconds between a response and the next request."""


def run_under_load(
    port: int, traffic: Traffic, groups: tuple[Clients, ...], during: Callable[[Tally], None]
) -> Tally:
    """Sends requests of clients to a port of this machine while `during` runs.

    At the end it waits for the running requests.
    """
    tally = Tally()
    over = threading.Event()

    def ask_until_over(group: Clients) -> None:
        with closing(HTTPConnection(HOST, port, timeout=TOO_LATE)) as connection:
            for request in traffic.requests(group.kinds):
                if over.wait(group.pause):
                    break
                _send_one(connection, request, traffic, tally)
                if not group.keep:
                    connection.close()

    with ThreadPoolExecutor(sum(group.number for group in groups)) as pool:
        every = [group for group in groups for _ in range(group.number)]
        clients = [pool.submit(ask_until_over, group) for group in every]
        try:
            during(tally)
        finally:
            over.set()
    for client in clients:
        client.result()
    return tally


def _send_one(connection: HTTPConnection, request: Request, traffic: Traffic, tally: Tally) -> None:
    start = time.perf_counter()
    try:
        answer = _ask(connection, request)
    except (OSError, EOFError, HTTPException) as error:
        connection.close()
        tally.broken.append(f"{time.strftime('%X')} {_name(request)}: {error!r}")
        return
    tally.seconds[request.kind].append(time.perf_counter() - start)
    if problem := traffic.wrong_with(request, answer):
        tally.wrong.append(f"{time.strftime('%X')} {_name(request)}: {problem}")


def _ask(connection: HTTPConnection, request: Request) -> Answer:
    connection.request(request.method, request.target, request.body or None, request.headers)
    response = connection.getresponse()
    body = response.read()
    if response.headers["Content-Encoding"] == "gzip":
        body = gzip.decompress(body)
    return Answer(response.status, response.headers["Location"], body)


def _name(request: Request) -> str:
    return f"{request.kind}, {request.method} {request.target}"


def _read_quantile(times: list[float], share: float) -> float:
    return sorted(times)[min(int(len(times) * share), len(times) - 1)] * 1e3
