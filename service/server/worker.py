"""A worker: one of several processes that serve at the same port.

Its parent, `service.server.supervisor`, asks it once in a while whether it serves, tells it to
retire, and sends it signals. The settings are passed to the process, and it makes the application
itself.
"""

import logging
import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from types import FrameType
from typing import NoReturn

import uvicorn
from uvicorn.config import STARTUP_FAILURE
from uvicorn.supervisors.multiprocess import Process

from service.errors import InvalidSettings
from service.server.logs import start_logs
from service.server.run import Server, ignore_hangup, make_server, run_server
from service.settings.values import Settings

PING, RETIRE = b"ping", b"retire"
"""Messages of the parent: a question, whether the worker serves; and a command."""

PING_PAUSE, PING_TIMEOUT = 0.25, 60.0
"""Seconds between two questions; seconds without an answer after which a worker counts as hung.
While it parses a document of 5 MB, Python's lock delays an answer by up to 1.5 s."""

RETIRE_SECONDS = 5.0
"""Seconds in which clients of a retiring worker may send a request on an open connection. The
response closes the connection; a connection without a request is closed after this time."""

END_RESERVE = 10.0
"""Seconds after `SURFACE_DRAIN_TIMEOUT` in which a process must have ended."""

_log = logging.getLogger(__name__)


class WorkerServer(Server):
    """The server of a worker: only the parent decides that it must end at once."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Handles the first signal only.

        Ctrl-C reaches the parent and the workers, and the parent then signals the workers, too.
        """
        if not self.should_exit:
            super().handle_exit(sig, frame)

    def retire(self) -> None:
        """Ends soon, because another process takes over the socket; may be called in any thread."""
        self._state.is_retiring = True

    async def on_tick(self, counter: int) -> bool:
        """Checks deadlines 10 times a second; returns whether to stop."""
        if self._state.is_retiring and not self.should_exit:
            for listener in self.servers:
                listener.close()
            self.should_exit = True
            self._stop_time = time.monotonic() + RETIRE_SECONDS
        elif self._state.is_retiring and not self.server_state.connections:
            self._stop_time = 0.0
        return await super().on_tick(counter)


class Worker(Process):
    """A worker, as its parent sees it; `target` runs in the worker.

    Attributes
    ----------
    number : int
        Its number, from 0.
    serves : bool
        Whether it served when it answered last.
    must_end_by : float or None
        After this time of the monotonic clock the parent kills a worker that retires.
    """

    def __init__(
        self,
        config: uvicorn.Config,
        sockets: list[socket.socket],
        settings: Settings,
        number: int,
    ) -> None:
        super().__init__(config, sockets)
        self.number, self._settings = number, settings
        self.serves = False
        self.must_end_by: float | None = None
        self._made_at = time.monotonic()
        self._asked_at, self._is_asked = self._made_at - PING_PAUSE, False

    def __str__(self) -> str:
        return f"worker {self.number} (process {self.pid})"

    @property
    def lives(self) -> bool:
        """Whether the process runs."""
        return self.process.is_alive()

    def start(self) -> None:
        """Starts the process, which gets no signals until `target` handles them.

        Ctrl-C in a terminal reaches it while it imports its modules, too: without a handler, Python
        would print a traceback.
        """
        resource_tracker.ensure_running()  # its own start would unblock the signals
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, _early_signals())
        try:
            super().start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)

    def has_just_failed(self, seconds: float) -> bool:
        """Whether the process has ended without having served, and was made within `seconds`."""
        is_new = time.monotonic() - self._made_at < seconds
        return is_new and not self.lives and not self.serves

    def answers(self) -> bool:
        """Whether the process runs and answers in time; asks it, and reads its answer.

        It does not wait for an answer, as uvicorn does: the parent must handle signals meanwhile.
        """
        now = time.monotonic()
        try:
            if self._is_asked and self.parent_conn.poll():
                self.serves, self._is_asked = self.parent_conn.recv(), False
            elif not self._is_asked and now - self._asked_at >= PING_PAUSE:
                self.parent_conn.send(PING)
                self._asked_at, self._is_asked = now, True
        except (OSError, EOFError):
            return False
        return self.lives and not (self._is_asked and now - self._asked_at > PING_TIMEOUT)

    def retire(self) -> None:
        """Makes the process accept no more connections, and end when its requests have ended."""
        self.must_end_by = time.monotonic() + (
            RETIRE_SECONDS + self._settings.drain_timeout + END_RESERVE
        )
        try:
            self.parent_conn.send(RETIRE)
        except OSError:
            self.process.kill()

    def signal(self, number: int) -> None:
        """Sends a signal to the process if it runs."""
        if self.lives and self.pid is not None:
            os.kill(self.pid, number)

    def target(self, sockets: list[socket.socket] | None = None) -> NoReturn:
        """Serves at these sockets; runs in the worker."""
        for number in (signal.SIGINT, signal.SIGTERM):  # until uvicorn handles them
            signal.signal(number, lambda number, _: os._exit(128 + number))
        ignore_hangup()  # from a terminal that is closed; the parent handles it
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _early_signals())
        os.environ.pop("NOTIFY_SOCKET", None)  # only the parent talks to systemd
        threading.Thread(target=self._end_with_parent, daemon=True).start()
        threading.Thread(target=self.always_pong, daemon=True).start()
        from service.api.app import create_app  # noqa: PLC0415  (the parent does not need it)

        logs = start_logs(self._settings)
        try:
            app = create_app(self._settings, logs.access.write)
            app.state.counters.count_dropped_lines = logs.count_dropped
            self._server = server = make_server(app, self._settings, app.state, WorkerServer)
            run_server(server, sockets or [], self._settings)
        except (InvalidSettings, OSError) as error:
            _log.error("%s", error)
            sys.exit(STARTUP_FAILURE)
        finally:
            logs.errors.flush()

    def pong(self) -> None:
        """Reads one message of the parent, and answers it; runs in the worker."""
        message, server = self.child_conn.recv(), self._server
        if message == PING:
            self.child_conn.send(isinstance(server, WorkerServer) and server.was_ready)
        elif isinstance(server, WorkerServer):
            server.retire()

    def _end_with_parent(self) -> None:
        """Waits for the end of the parent, then ends this process, with its running requests."""
        parent = multiprocessing.parent_process()
        assert parent is not None
        wait([parent.sentinel])
        _log.error("The parent of this worker has ended; it accepts no more connections")
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(self._settings.drain_timeout + END_RESERVE)
        os._exit(1)


def _early_signals() -> tuple[signal.Signals, ...]:
    """The signals that a worker must not get before it handles them."""
    return signal.SIGINT, signal.SIGTERM, signal.SIGHUP
