"""Draining: how the server ends after a signal, with its running requests and exit codes."""

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

MAX_WAIT = 60.0  # seconds; a test that waits longer fails


class SlowApp:
    """An application that responds to `/` at once, and to `/slow` after `may_end` is set."""

    def __init__(self) -> None:
        self.has_begun = threading.Event()
        self.may_end = threading.Event()
        routes = [Route("/", self.respond_quickly), Route("/slow", self.respond_slowly)]
        self.app = Starlette(routes=routes)

    async def respond_quickly(self, _: Request) -> Response:
        return PlainTextResponse("quick")

    async def respond_slowly(self, _: Request) -> Response:
        self.has_begun.set()
        await asyncio.to_thread(self.may_end.wait, MAX_WAIT)
        return PlainTextResponse("slow")


@contextmanager
def run_server(
    slow_app: SlowApp, settings: Settings, state: object
) -> Iterator[tuple[Server, str]]:
    """A server that runs in a thread until the block ends, and its URL."""
    server = make_server(slow_app.app, settings, state)
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    try:
        yield server, f"http://127.0.0.1:{port}"
    finally:
        slow_app.may_end.set()
        server.should_exit = True
        thread.join(MAX_WAIT)
    assert not thread.is_alive()


def is_refused(url: str) -> bool:
    """True, after a short pause for loops that wait, if no process listens at this URL's port."""
    try:
        socket.create_connection(("127.0.0.1", int(httpx.URL(url).port or 0))).close()
    except OSError:
        sleep(0.02)
        return True
    return False


def test_responses_during_the_drain_delay_close_their_connection() -> None:
    slow_app, state = SlowApp(), SimpleNamespace(ready=True)
    with (
        run_server(slow_app, Settings(drain_delay=MAX_WAIT), state) as (server, url),
        httpx.Client(base_url=url) as client,
    ):
        assert "connection" not in client.get("/").headers
        assert state.ready
        server.handle_exit(signal.SIGTERM, None)
        assert not state.ready
        for response in (client.get("/"), client.get("/"), httpx.get(url)):
            assert (response.text, response.headers["connection"]) == ("quick", "close")
        server._stop_time = 0.0  # the delay is over


def test_running_requests_get_responses_after_the_listener_is_closed() -> None:
    slow_app, responses = SlowApp(), []
    with run_server(slow_app, Settings(drain_timeout=MAX_WAIT), None) as (server, url):
        thread = threading.Thread(target=lambda: responses.append(httpx.get(f"{url}/slow")))
        thread.start()
        assert slow_app.has_begun.wait(MAX_WAIT)
        with httpx.Client(base_url=url) as idle_client:
            idle_client.get("/")
            server.handle_exit(signal.SIGINT, None)
            while not is_refused(url):
                pass
            # The server has closed the idle connection, too.
            with pytest.raises(httpx.TransportError):
                idle_client.get("/")
        assert responses == []
        slow_app.may_end.set()
        thread.join(MAX_WAIT)
    assert [(response.text, response.headers["connection"]) for response in responses] == [
        ("slow", "close")
    ]


def test_the_end_does_not_wait_for_incomplete_requests_and_refused_clients() -> None:
    slow_app = SlowApp()
    with run_server(slow_app, Settings(drain_timeout=MAX_WAIT), None) as (server, url):
        address = ("127.0.0.1", int(url.rsplit(":", 1)[1]))
        with (
            socket.create_connection(address) as incomplete_client,
            socket.create_connection(address) as refused_client,
        ):
            incomplete_client.sendall(b"GET / HT")
            refused_client.sendall(b"nonsense")
            assert refused_client.recv(12) == b"HTTP/1.1 400"
            server.handle_exit(signal.SIGINT, None)
            with suppress(ConnectionResetError):
                assert incomplete_client.recv(1) == b""


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
    """A process that runs PROGRAM with this drain delay in seconds, and its port.

    `/stuck` does not respond, and its thread runs longer than any test waits.
    """
    port = free_port()
    command = [sys.executable, "-c", PROGRAM, str(port), str(delay)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
        try:
            while is_refused(f"http://127.0.0.1:{port}/"):
                assert process.poll() is None
            yield process, port
        finally:
            process.kill()


@pytest.mark.slow
def test_work_without_end_is_cancelled_and_the_exit_code_is_0() -> None:
    with (
        start_process(0) as (process, port),
        socket.create_connection(("127.0.0.1", port)) as client,
    ):
        client.sendall(b"GET /stuck HTTP/1.1\r\nHost: x\r\n\r\n")
        assert process.stdout is not None
        output = b""
        while b"stuck\n" not in output:
            output += process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        assert process.wait(MAX_WAIT) == 0
        log = process.stdout.read().decode()
        response = client.recv(4000)
    assert response.startswith(b"HTTP/1.1 503 ")
    assert b'"code":"draining"' in response
    assert b"\r\nretry-after: 1\r\n" in response
    assert "Cancel 1 running task(s)" in log
    assert "Traceback" not in log
    assert "Exception" not in log


@pytest.mark.slow
def test_a_second_signal_ends_the_process_at_once_but_hangup_does_nothing() -> None:
    with start_process(600) as (process, port):
        process.send_signal(signal.SIGHUP)
        process.send_signal(signal.SIGTERM)
        # `verify=False` saves the time of reading certificates. The first response that closes its
        # connection shows that the process has received the signal.
        with httpx.Client(verify=False) as client:
            while client.get(f"http://127.0.0.1:{port}/").headers.get("connection") != "close":
                pass
        process.send_signal(signal.SIGINT)
        assert process.wait(MAX_WAIT) == 128 + signal.SIGINT
