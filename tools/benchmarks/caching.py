"""What is kept, sent again: against a FastAPI endpoint that answers the very same bytes.

One uvicorn server in a process of its own, as `surface serve` runs it; the rivals take turns on the
same connections. The client asks on all connections, then reads them in turn, so that the server
never waits for it: a read is one system call, since every answer's length is known.

Both log every request: the service as it does, the rival as uvicorn does, its records without what
no line shows.
"""

import logging
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from urllib.parse import quote

import httpx
from fastapi import FastAPI, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.app import create_app
from service.encoders.registry import BY_NAME
from service.engine.mesh import ENGINE
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.server.logs import start_logs
from service.server.run import serve
from service.settings.values import Settings
from service.surface.examples import find

ADDRESS = f"/v1/surfaces/utah-teapot/mesh.glb?engine={ENGINE}"
ECHO = "/echo"
CONNECTIONS, ROUNDS, SECONDS = 4, 9, 0.4
NEEDED = {"a hit": 1.5, "304": 2.0}
"""How many times the rival's requests a second."""


def beside_echo(app: ASGIApp) -> ASGIApp:
    """The service, and beside it, not behind it, a plain FastAPI application with one endpoint."""
    content = render(find("utah-teapot").surface(), MeshOptions(), BY_NAME["glb"])
    plain = FastAPI(openapi_url=None)

    @plain.get(ECHO)
    async def echo() -> Response:
        return Response(content, media_type="model/gltf-binary")

    told = _access_log()

    async def both(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] != ECHO:
            await app(scope, receive, send)
            return

        async def logged(message: Message) -> None:
            if message["type"] == "http.response.start":
                (host, at), version = scope["client"], scope["http_version"]
                line = (host, at, scope["method"], quote(scope["path"]), version, message["status"])
                told.info('%s:%d - "%s %s HTTP/%s" %d', *line)
            await send(message)

        await plain(scope, receive, logged)

    return both


def _access_log() -> logging.Logger:
    """What uvicorn writes of requests, in the quickest way that `logging` has."""
    logging.logThreads = logging.logProcesses = logging.logMultiprocessing = False
    logging._srcfile = None
    handler = logging.StreamHandler(sys.stdout)
    handler.setFormatter(logging.Formatter("%(levelname)s:     %(message)s"))
    logger = logging.getLogger("rival")
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    logger.propagate = False
    return logger


@contextmanager
def serving() -> Iterator[tuple[int, int]]:
    """Port and process of such a server; what it logs of every request goes nowhere."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "tools.benchmarks.caching", str(port)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        try:
            for _ in range(200):
                time.sleep(0.1)
                try:
                    httpx.get(f"http://127.0.0.1:{port}/health").raise_for_status()
                    break
                except httpx.TransportError:
                    continue
            yield port, process.pid
        finally:
            process.terminate()


class Rival:
    """One request, again and again on some connections."""

    def __init__(self, connections: list[socket.socket], path: str, *headers: str) -> None:
        self._connections = connections
        lines = (f"GET {path} HTTP/1.1", "Host: localhost", *headers, "", "")
        self._request = "\r\n".join(lines).encode()
        connections[0].sendall(self._request)
        head = b""
        while b"\r\n\r\n" not in head:
            head += connections[0].recv(1)
        lengths = [line for line in head.lower().split(b"\r\n") if b"content-length:" in line]
        body = int(lengths[0].partition(b":")[2]) if lengths and b" 304 " not in head else 0
        connections[0].recv(body, socket.MSG_WAITALL)
        self.status = int(head.split(b" ")[1])
        self._answer = memoryview(bytearray(len(head) + body))

    def burst(self, seconds: float) -> float:
        """Requests a second."""
        done, start = 0, time.perf_counter()
        for connection in self._connections:
            connection.sendall(self._request)
        end = start + seconds
        while time.perf_counter() < end:
            for connection in self._connections:
                self._read(connection)
                connection.sendall(self._request)
                done += 1
        for connection in self._connections:
            self._read(connection)
            done += 1
        return done / (time.perf_counter() - start)

    def _read(self, connection: socket.socket) -> None:
        length = connection.recv_into(self._answer, len(self._answer), socket.MSG_WAITALL)
        status = f"HTTP/1.1 {self.status}".encode()
        if length != len(self._answer) or self._answer[: len(status)] != status:
            raise RuntimeError("an answer of another length or status than the first")


def busy(process: int) -> float:
    """Seconds of CPU that the first thread of a process has had."""
    return int(Path(f"/proc/{process}/schedstat").read_text().split()[0]) / 1e9


def measured(rivals: Mapping[str, Rival], process: int) -> dict[str, list[tuple[float, float]]]:
    """Requests a second, and µs of the server's CPU a request, round by round, in turns."""
    rates: dict[str, list[tuple[float, float]]] = {name: [] for name in rivals}
    for rival in rivals.values():
        rival.burst(SECONDS / 2)
    for _ in range(ROUNDS):
        for name, rival in rivals.items():
            before, start = busy(process), time.perf_counter()
            rate = rival.burst(SECONDS)
            count = rate * (time.perf_counter() - start)
            rates[name].append((rate, (busy(process) - before) / count * 1e6))
    return rates


def report() -> bool:
    """Prints the table of medians; whether both are as much faster as is needed.

    "Times" is the median of the rounds' own quotients: the machine's moods change from round to
    round, hardly within one.
    """
    with serving() as (port, process), ExitStack() as stack:
        for _ in range(2):
            answer = httpx.get(f"http://127.0.0.1:{port}{ADDRESS}", headers=_PLAIN)
        assert answer.headers["server-timing"] == "cache;desc=hit"
        tag = answer.headers["etag"]
        connections = [
            stack.enter_context(socket.create_connection(("127.0.0.1", port)))
            for _ in range(CONNECTIONS)
        ]
        rivals = {
            "FastAPI, the same bytes": Rival(connections, ECHO),
            "a hit": Rival(connections, ADDRESS),
            "304": Rival(connections, ADDRESS, f"If-None-Match: {tag}"),
        }
        statuses = [rival.status for rival in rivals.values()]
        assert statuses == [200, 200, 304]
        rates = measured(rivals, process)
    echo = rates["FastAPI, the same bytes"]
    print(f"One uvicorn server, {len(answer.content)} bytes of GLB, {CONNECTIONS} connections")
    print(f"{'answer':26}{'requests/s':>12}{'times':>8}{'µs of CPU':>12}{'times':>8}")
    faster: dict[str, float] = {}
    for name, rounds in rates.items():
        pairs = list(zip(rounds, echo, strict=True))
        faster[name] = median(own[0] / other[0] for own, other in pairs)
        cheaper = median(other[1] / own[1] for own, other in pairs)
        rate, spent = (median(column) for column in zip(*rounds, strict=True))
        print(f"{name:26}{rate:12.0f}{faster[name]:8.2f}{spent:12.0f}{cheaper:8.2f}")
    return all(faster[name] >= least for name, least in NEEDED.items())


_PLAIN = {"Accept-Encoding": "identity"}

if __name__ == "__main__":
    if len(sys.argv) > 1:
        settings = Settings(port=int(sys.argv[1]))
        requests, others = start_logs(settings)
        app = create_app(settings, requests.write)
        serve(beside_echo(app), settings, app.state)
    else:
        sys.exit(0 if report() else 1)
