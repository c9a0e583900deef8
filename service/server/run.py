"""Runs uvicorn, and stops it without losing a request.

After a SIGTERM the service is not ready any more, but still serves requests for
`SURFACE_DRAIN_DELAY`, so that a proxy can find another instance. Then it accepts no more
connections, and waits at most `SURFACE_DRAIN_TIMEOUT` for the running requests. After a SIGINT
(Ctrl-C) it does not wait for the delay. In both cases the exit code is 0. A second signal ends the
process at once; the exit code is then 128 plus the number of the signal.

`service.server.supervisor` runs several such servers, each in a process.
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
from collections.abc import Callable
from contextlib import suppress
from contextvars import Context
from functools import partial
from types import FrameType, SimpleNamespace
from typing import Any, NoReturn

import uvicorn
from starlette.types import ASGIApp

from service.api.observing.metrics import RequestCounters
from service.server.protocol import BoundedProtocol, add_failure_response
from service.server.sockets import bind_sockets, raise_file_limit
from service.settings.values import Settings

_log = logging.getLogger(__name__)


class Server(uvicorn.Server):
    """uvicorn's server; sets `ready` of the application's `state` to false before it stops.

    `was_ready` becomes true when the application is ready for requests for the first time.
    """

    def __init__(self, config: uvicorn.Config, settings: Settings, state: Any) -> None:
        super().__init__(config)
        self._settings, self._state = settings, state
        self._stop_time = 0.0
        self._is_ready: Callable[[], bool] = getattr(state, "is_ready", lambda: True)
        self.was_ready = self._is_ending = False

    def handle_exit(self, sig: int, _: FrameType | None) -> None:
        """Handles a signal. Without this method uvicorn would raise the signal again at the end."""
        if self.should_exit:
            os._exit(128 + sig)
        delay = self._settings.drain_delay if sig == signal.SIGTERM else 0.0
        self._stop_time = time.monotonic() + delay
        self._state.ready = False
        self.should_exit = True
        text = f"Stops because of {signal.Signals(sig).name}; serves requests for {delay:g} s more"
        Context().run(_log.info, text)  # in a new context: without a request's id
        notify("STOPPING=1")

    def on_ready(self) -> None:
        """Called once, when the application is ready for requests: its store has answered."""
        notify("READY=1")

    async def on_tick(self, counter: int) -> bool:
        """Checks deadlines and readiness 10 times a second; returns whether to stop."""
        if not self.was_ready and self._is_ready():
            self.was_ready = True
            self.on_ready()
        has_just_ended = self.should_exit and not self._is_ending
        self._is_ending = self.should_exit
        now = asyncio.get_running_loop().time()
        for connection in list(self.server_state.connections):
            if isinstance(connection, BoundedProtocol):
                connection.end_if_late(now)
                if has_just_ended:
                    connection.close_after_response()
        return await super().on_tick(counter) and time.monotonic() >= self._stop_time

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Waits for the running requests; requests that uvicorn cancels still get a response."""
        self._state.ready = self._state.is_retiring
        await super().shutdown(sockets)
        if self.server_state.tasks:
            await asyncio.wait(self.server_state.tasks, timeout=1.0)


def notify(state: str) -> None:
    """Sends a state, `READY=1` or `STOPPING=1`, to the supervisor, if any, as sd_notify(3) does."""
    if address := os.environ.get("NOTIFY_SOCKET"):
        with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
            sock.connect(re.sub("^@", "\0", address))  # "@" means a name outside the file system
            sock.send(state.encode())


def make_server(
    app: ASGIApp,
    settings: Settings,
    state: Any = None,
    kind: type[Server] = Server,
    **uvicorn_options: Any,
) -> Server:
    """The server of an application with this state; `uvicorn_options` replace or add options."""
    state = SimpleNamespace(ready=True) if state is None else state
    state.is_retiring = False
    counters: RequestCounters | None = getattr(state, "counters", None)
    state.count_refusal = counters.count_refusal if counters else lambda _: None
    options: dict[str, Any] = {
        "host": settings.host,
        "port": settings.port,
        "http": partial(BoundedProtocol, settings, state),
        "ws": "none",
        "timeout_keep_alive": settings.keep_alive,
        "timeout_graceful_shutdown": settings.drain_timeout,
        # Log records go through our own handlers; the application writes the access log.
        "log_config": None,
        "log_level": settings.log_level,
        "access_log": False,
        # No `Server` header; the application itself reads the headers of trusted proxies.
        "server_header": False,
        "proxy_headers": False,
    }
    app = add_failure_response(app, settings, state)
    server = kind(uvicorn.Config(app, **options | uvicorn_options), settings, state)
    state.connections = server.server_state.connections
    return server


def serve(app: ASGIApp, settings: Settings, state: Any) -> NoReturn:
    """Serves requests in this process until a signal, then ends it with exit code 0.

    Raises
    ------
    SystemExit
        The application does not start, or the system refuses the address.
    """
    server = make_server(app, settings, state)
    (sockets,) = bind_sockets(settings, 1)
    ignore_hangup()
    run_server(server, sockets, settings)


def run_server(server: Server, sockets: list[socket.socket], settings: Settings) -> NoReturn:
    """Serves requests at these sockets until a signal, then ends the process with exit code 0.

    It does not return, because Python would then wait for threads that still compute.

    Raises
    ------
    SystemExit
        The application does not start.
    """
    raise_file_limit(settings.max_connections + 128)  # 128 for the log, the store, libraries
    gc.collect()
    gc.freeze()  # objects made at the start live as long as the process
    with asyncio.Runner(loop_factory=server.config.get_loop_factory()) as runner:
        runner.run(server.serve(sockets))
        logging.shutdown()  # writes the last lines
        os._exit(0)


def ignore_hangup() -> None:
    """Makes SIGHUP have no effect: it replaces workers, and this process has none.

    Without a handler the signal would end the process.
    """
    if sys.platform != "win32":  # Windows has no such signal
        signal.signal(signal.SIGHUP, lambda *_: None)
