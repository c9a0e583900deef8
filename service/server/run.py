"""How the service runs and ends: uvicorn by its settings, and every request answered.

SIGTERM makes readiness fail; the service goes on answering for `SURFACE_DRAIN_DELAY`, so that a
proxy can find another instance. Then it accepts no more connections and waits for the requests
under way, for `SURFACE_DRAIN_TIMEOUT`. SIGINT (Ctrl-C) has no such delay. Either way the exit code
is 0. A second signal ends the process at once, with 128 and the signal's number.
"""

import asyncio
import gc
import logging
import os
import re
import signal
import socket
import sys
import time
from contextlib import suppress
from contextvars import Context
from functools import partial
from types import FrameType, SimpleNamespace
from typing import Any, NoReturn

import uvicorn
from starlette.types import ASGIApp

from service.server.protocol import BoundedProtocol, with_last_answer
from service.settings.values import Settings

if sys.platform != "win32":  # where the number of open files has no such limit
    import resource

_log = logging.getLogger(__name__)


class Server(uvicorn.Server):
    """uvicorn's server; `ready` of the application's `state` is false once it is to end."""

    def __init__(self, config: uvicorn.Config, settings: Settings, state: Any) -> None:
        super().__init__(config)
        self._settings, self._state = settings, state
        self._ends_at = 0.0

    def handle_exit(self, sig: int, _: FrameType | None) -> None:
        """Takes a signal; uvicorn would end the process by it, once all is answered."""
        if self.should_exit:
            os._exit(128 + sig)
        delay = self._settings.drain_delay if sig == signal.SIGTERM else 0.0
        self._ends_at = time.monotonic() + delay
        self._state.ready = False
        self.should_exit = True
        text = f"Told to stop by {signal.Signals(sig).name}; answers for another {delay:g} s"
        Context().run(_log.info, text)  # whose line names no request that the signal interrupts
        notify("STOPPING=1")

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts the application and accepts connections."""
        await super().startup(sockets)
        notify("READY=1")

    async def on_tick(self, counter: int) -> bool:
        """Looks at deadlines ten times a second; returns whether it is time to end."""
        now = asyncio.get_running_loop().time()
        for connection in list(self.server_state.connections):
            if isinstance(connection, BoundedProtocol):
                connection.end_if_late(now)
        return await super().on_tick(counter) and time.monotonic() >= self._ends_at

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Waits for the requests under way; those that uvicorn cancels have time for an answer."""
        self._state.ready = False
        await super().shutdown(sockets)
        if self.server_state.tasks:
            await asyncio.wait(self.server_state.tasks, timeout=1.0)


def notify(state: str) -> None:
    """Tells the supervisor, if there is one, as sd_notify(3) does: `READY=1`, `STOPPING=1`."""
    if address := os.environ.get("NOTIFY_SOCKET"):
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
            sock.connect(re.sub("^@", "\0", address))  # a name outside of the file system
            sock.send(state.encode())


def make_server(app: ASGIApp, settings: Settings, state: Any = None, **other: Any) -> Server:
    """The server of an application with this state; `other` are uvicorn's settings."""
    state = SimpleNamespace(ready=True) if state is None else state
    state.refused = state.observed.refused if hasattr(state, "observed") else lambda _: None
    options: dict[str, Any] = {
        "host": settings.host,
        "port": settings.port,
        "http": partial(BoundedProtocol, settings, state),
        "ws": "none",
        "timeout_keep_alive": settings.keep_alive,
        "timeout_graceful_shutdown": settings.drain_timeout,
        # Records take the way of all others; the application writes the lines about requests.
        "log_config": None,
        "log_level": settings.log_level,
        "access_log": False,
        # No client need know what serves; the application knows which proxies to believe.
        "server_header": False,
        "proxy_headers": False,
    }
    app = with_last_answer(app, settings, state)
    server = Server(uvicorn.Config(app, **options | other), settings, state)
    state.connections = server.server_state.connections
    return server


def serve(app: ASGIApp, settings: Settings, state: Any) -> NoReturn:
    """Answers until the process is told to stop, then ends the process with exit code 0.

    Python itself would wait for threads that still compute.

    Raises
    ------
    SystemExit
        Where the application does not start, or the system does not allow the address.
    """
    server = make_server(app, settings, state)
    sock = server.config.bind_socket()
    # Accepted connections inherit these: the system ends those whose client has vanished, or does
    # not read (Linux; tcp(7)).
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if sys.platform == "linux":
        milliseconds = max(1, round(settings.send_timeout * 1000))
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, milliseconds)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 15)
    raise_file_limit(settings.max_connections + 128)  # of the log, the store, libraries
    gc.collect()
    gc.freeze()  # objects that are there at the start stay
    with asyncio.Runner(loop_factory=server.config.get_loop_factory()) as runner:
        runner.run(server.serve([sock]))
        logging.shutdown()  # which writes the last lines
        os._exit(0)


def raise_file_limit(needed: int) -> None:
    """Allows this many open files; warns if the system does not."""
    if sys.platform != "win32":
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        most = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
        if soft != resource.RLIM_INFINITY and soft < most:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        if most < needed:
            _log.warning("%d open files are needed, and the system allows %d", needed, most)
