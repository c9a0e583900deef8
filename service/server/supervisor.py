"""Several processes that serve at one port: `surface serve --workers N`.

The parent binds the sockets, starts the workers, and replaces a worker that ends or hangs. On
SIGHUP it replaces all of them one by one: a new process serves before the old one stops accepting
connections. It passes on SIGTERM and SIGINT; a second signal ends all processes at once. It alone
notifies systemd: it is ready when all workers serve.

uvicorn's supervisor collects the signals. Its own loop is not used: it waits for the answer of each
worker and for the end of each old one, and handles no signals meanwhile.
"""

import logging
import os
import signal
import socket
import time
from multiprocessing.connection import wait

import uvicorn
from uvicorn.supervisors.multiprocess import Multiprocess

from service.server.run import notify
from service.server.sockets import bind_sockets
from service.server.worker import END_RESERVE, PING_PAUSE, Worker
from service.settings.values import Settings
from service.settings.workers import share_settings

RETRY_SECONDS = 5.0
"""Seconds from the start of a worker that ended before it served until the next attempt: what it
lacks, such as the folder of the store, may be back only after a while."""

_log = logging.getLogger(__name__)


def serve_with_workers(settings: Settings, count: int) -> bool:
    """Serves requests in `count` processes until a signal stops them; False if they do not start.

    Raises
    ------
    SystemExit
        The system refuses the address.
    """
    supervisor = Supervisor(share_settings(settings, count), bind_sockets(settings, count))
    try:
        supervisor.run()
    finally:
        supervisor.kill_all()  # after an error; else all have ended
    return not supervisor.has_failed


class Supervisor(Multiprocess):
    """The parent of the workers.

    Attributes
    ----------
    has_served : bool
        Whether all workers have served at the same time.
    has_failed : bool
        Whether a worker ended before that, so that the others were stopped.
    """

    processes: list[Worker]  # type: ignore[assignment]

    def __init__(self, settings: Settings, sockets: list[list[socket.socket]]) -> None:
        config = uvicorn.Config(
            "", workers=len(sockets), log_config=None, log_level=settings.log_level
        )
        super().__init__(config, [])
        self.has_served = self.has_failed = False
        self._settings, self._sockets = settings, sockets
        self._stop_signal = 0
        # SIGHUP: numbers of workers that have not yet been replaced, the process that takes over
        # from the first of them, and the old processes that end.
        self._to_replace: list[int] = []
        self._successor: Worker | None = None
        self._retiring: list[Worker] = []

    def run(self) -> None:
        """Serves until a signal, or until workers do not start."""
        self.processes = [self._start(number) for number in range(len(self._sockets))]
        while not self._stop_signal:
            wait([worker.process.sentinel for worker in self._all_workers()], PING_PAUSE)
            self.handle_signals()
            if not self._stop_signal:
                self._replace_dead()
                self._check_start()
                self._replace_next()
                self._end_retired()
        self._stop()

    def kill_all(self) -> None:
        """Ends all workers at once."""
        for worker in self._all_workers():
            worker.process.kill()

    def handle_int(self) -> None:
        """SIGINT: stops."""
        self._stop_signal = signal.SIGINT

    def handle_term(self) -> None:
        """SIGTERM: stops, after `SURFACE_DRAIN_DELAY`."""
        self._stop_signal = signal.SIGTERM

    def handle_hup(self) -> None:
        """SIGHUP: replaces all workers, one by one."""
        _log.info("SIGHUP: replaces the %d workers one by one", len(self.processes))
        # A process that is starting after an earlier SIGHUP has the sockets of its number.
        first = [] if self._successor is None else [self._successor.number]
        others = (number for number in range(len(self.processes)) if number not in first)
        self._to_replace = [*first, *others]

    def handle_ttin(self) -> None:
        """SIGTTIN does nothing; uvicorn would start another worker, without a socket."""

    def handle_ttou(self) -> None:
        """SIGTTOU does nothing; uvicorn would end a worker, and its socket would stay open."""

    def _start(self, number: int) -> Worker:
        worker = Worker(self.config, self._sockets[number], self._settings, number)
        worker.start()
        return worker

    def _all_workers(self) -> list[Worker]:
        """All processes that run."""
        workers = [*self.processes, *self._retiring]
        if self._successor is not None:
            workers.append(self._successor)
        return [worker for worker in workers if worker.lives]

    def _replace_dead(self) -> None:
        """Starts a new process in place of one that has ended or hangs."""
        for number, worker in enumerate(self.processes):
            if worker.answers() or (self.has_served and worker.has_just_failed(RETRY_SECONDS)):
                continue
            has_ended = not worker.lives
            worker.kill()
            worker.process.join()
            if not self.has_served:
                _log.error("The %s does not start", worker)
                self.has_failed, self._stop_signal = True, signal.SIGINT
                return
            reason = f"ended with {worker.exitcode}" if has_ended else "did not answer"
            _log.error("The %s %s; another process takes its place", worker, reason)
            if self._to_replace[:1] == [number] and self._successor is not None:
                self._take_over()
            else:
                self.processes[number] = self._start(number)

    def _check_start(self) -> None:
        """Notifies systemd when all workers serve for the first time."""
        if not self.has_served and all(worker.serves for worker in self.processes):
            self.has_served = True
            # From now on a missing store is a lost one, which later workers must not make again.
            self._settings = self._settings.model_copy(update={"store_create": False})
            notify("READY=1")
            _log.info("All %d workers serve", len(self.processes))

    def _replace_next(self) -> None:
        """Replaces the next worker after SIGHUP, when the one before has ended."""
        if not (self._to_replace and self.has_served) or self._retiring:
            return
        if self._successor is None:
            self._successor = self._start(self._to_replace[0])
        if not self._successor.answers():
            self._successor.kill()
            _log.error("The new %s does not start; the old workers stay", self._successor)
            self._successor, self._to_replace = None, []
        elif self._successor.serves:
            old_worker = self.processes[self._to_replace[0]]
            self._take_over()
            old_worker.retire()
            self._retiring.append(old_worker)

    def _take_over(self) -> None:
        """Puts the successor in the place of the worker with the same number."""
        assert self._successor is not None
        self.processes[self._to_replace.pop(0)], self._successor = self._successor, None
        if not self._to_replace:
            _log.info("All workers are replaced")

    def _end_retired(self) -> None:
        """Forgets retired processes that have ended, and kills those that take too long."""
        now = time.monotonic()
        for worker in self._retiring:
            if worker.must_end_by is not None and now > worker.must_end_by:
                _log.error("The retired %s has not ended in time, and is killed", worker)
                worker.process.kill()
        self._retiring = [worker for worker in self._retiring if worker.lives]

    def _stop(self) -> None:
        """Passes the signal on, and waits until all workers have ended; a second one kills them."""
        notify("STOPPING=1")
        # A socket that no worker has open any more must refuse connections.
        for group in self._sockets:
            for sock in group:
                sock.close()
        delay = self._settings.drain_delay if self._stop_signal == signal.SIGTERM else 0.0
        must_end_by = time.monotonic() + delay + self._settings.drain_timeout + END_RESERVE
        for worker in self._all_workers():
            worker.signal(self._stop_signal)
        self._stop_signal = 0
        while workers := self._all_workers():
            wait([worker.process.sentinel for worker in workers], PING_PAUSE)
            self.handle_signals()
            if self._stop_signal or time.monotonic() > must_end_by:
                self.kill_all()
            if self._stop_signal:
                logging.shutdown()
                os._exit(128 + self._stop_signal)
