"""The end of the service: signals, running requests, exit codes."""

import asyncio
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from time import sleep
from types import SimpleNamespace

import httpx
import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from service.server.run import Server, make_server
from service.settings.values import Settings
from tools.processes import free_port

LONG = 60.0


class Slow:
    """An application that responds to `/` at once, and to `/slow` when the test allows it."""

    def __init__(self) -> None:
        self.begun = threading.Event()
        self.may_end = threading.Event()
        self.app = Starlette(routes=[Route("/", self.quick), Route("/slow", self.slow)])

    async def quick(self, _: Request) -> Response:
        return PlainTextResponse("quick")

    async def slow(self, _: Request) -> Response:
        self.begun.set()
        await asyncio.to_thread(self.may_end.wait, LONG)
        return PlainTextResponse("slow")


@contextmanager
def run_server(slow: Slow, settings: Settings, state: object) -> Iterator[tuple[Server, str]]:
    """A server in a thread, and its address."""
    server = make_server(slow.app, settings, state)
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    try:
        yield server, f"http://127.0.0.1:{port}"
    finally:
        slow.may_end.set()
        server.should_exit = True
        thread.join(LONG)
    assert not thread.is_alive()


def is_refused(url: str) -> bool:
    """Whether no process listens there."""
    try:
        socket.create_connection(("127.0.0.1", int(httpx.URL(url).port or 0))).close()
    except OSError:
        sleep(0.02)
        return True
    return False


def test_requests_during_the_delay_get_the_last_response_of_their_connection() -> None:
    slow, state = Slow(), SimpleNamespace(ready=True)
    with (
        run_server(slow, Settings(drain_delay=LONG), state) as (server, url),
        httpx.Client(base_url=url) as kept,
    ):
        assert "connection" not in kept.get("/").headers
        assert state.ready
        server.handle_exit(signal.SIGTERM, None)
        assert not state.ready
        for response in (kept.get("/"), kept.get("/"), httpx.get(url)):
            assert (response.text, response.headers["connection"]) == ("quick", "close")
        server._stop_time = 0.0  # the delay is over


def test_running_requests_are_answered_after_the_listener_is_closed() -> None:
    slow, answers = Slow(), []
    with run_server(slow, Settings(drain_timeout=LONG), None) as (server, url):
        asking = threading.Thread(target=lambda: answers.append(httpx.get(f"{url}/slow")))
        asking.start()
        assert slow.begun.wait(LONG)
        with httpx.Client(base_url=url) as idle:
            idle.get("/")
            server.handle_exit(signal.SIGINT, None)
            while not is_refused(url):
                pass
            # The idle connection is closed, too.
            assert is_refused(url)
            with pytest.raises(httpx.TransportError):
                idle.get("/")
        assert answers == []
        slow.may_end.set()
        asking.join(LONG)
    assert [(response.text, response.headers["connection"]) for response in answers] == [
        ("slow", "close")
    ]


def test_half_a_request_and_a_client_that_was_refused_are_not_waited_for() -> None:
    slow = Slow()
    with run_server(slow, Settings(drain_timeout=LONG), None) as (server, url):
        address = ("127.0.0.1", int(url.rsplit(":", 1)[1]))
        with socket.create_connection(address) as half, socket.create_connection(address) as other:
            half.sendall(b"GET / HT")
            other.sendall(b"nonsense")
            assert other.recv(12) == b"HTTP/1.1 400"
            server.handle_exit(signal.SIGINT, None)
            with suppress(ConnectionResetError):
                assert half.recv(1) == b""


PROGRAM = """
import asyncio, sys, threading, time
from types import SimpleNamespace
from service.server.logs import start_logs
from service.server.run import serve
from service.settings.values import Settings

async def app(scope, receive, send):
    if scope["type"] == "lifespan":
        await receive()
        return await send({"type": "lifespan.startup.complete"})
    if scope["path"] == "/stuck":
        threading.Thread(target=time.sleep, args=(600,)).start()
        print("stuck", flush=True)
        await asyncio.sleep(600)
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b""})

settings = Settings(host="127.0.0.1", port=int(sys.argv[1]), drain_delay=float(sys.argv[2]),
                    drain_timeout=0.05)
logs = start_logs(settings)
serve(app, settings, SimpleNamespace(ready=True))
"""


@contextmanager
def start_process(delay: float) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """A process that serves an application with one URL that never responds."""
    port = free_port()
    command = [sys.executable, "-c", PROGRAM, str(port), str(delay)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as started:
        try:
            while is_refused(f"http://127.0.0.1:{port}/"):
                assert started.poll() is None
            yield started, port
        finally:
            started.kill()


def test_endless_work_is_cut_off_and_the_exit_code_is_0() -> None:
    with (
        start_process(0) as (started, port),
        socket.create_connection(("127.0.0.1", port)) as asking,
    ):
        asking.sendall(b"GET /stuck HTTP/1.1\r\nHost: x\r\n\r\n")
        assert started.stdout is not None
        seen = b""
        while b"stuck\n" not in seen:
            seen += started.stdout.readline()
        started.send_signal(signal.SIGTERM)
        assert started.wait(LONG) == 0
        log = started.stdout.read().decode()
        response = asking.recv(4000)
    assert response.startswith(b"HTTP/1.1 503 ")
    assert b'"code":"draining"' in response
    assert b"\r\nretry-after: 1\r\n" in response
    assert "Cancel 1 running task(s)" in log
    assert "Traceback" not in log
    assert "Exception" not in log


def test_a_second_signal_ends_the_process_at_once() -> None:
    with start_process(600) as (started, port):
        started.send_signal(signal.SIGTERM)
        with httpx.Client(verify=False) as client:
            while client.get(f"http://127.0.0.1:{port}/").headers.get("connection") != "close":
                pass
        started.send_signal(signal.SIGINT)
        assert started.wait(LONG) == 128 + signal.SIGINT
