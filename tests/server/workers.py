"""A service with two workers, and the notifications that systemd would get from it."""

import os
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from tools.processes import PATIENCE, Server, free_ports, service_server

COUNT = 2


class Notified:
    """A socket that stands in for systemd."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "notify"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(self.path))
        self._socket.settimeout(PATIENCE)

    def close(self) -> None:
        self._socket.close()

    def read(self) -> str:
        """The next state that the service sends."""
        return self._socket.recv(100).decode()

    def has_more(self) -> bool:
        """Whether the service has sent a state that was not read."""
        self._socket.settimeout(0)
        try:
            return bool(self._socket.recv(100))
        except BlockingIOError:
            return False
        finally:
            self._socket.settimeout(PATIENCE)


class Workers:
    """A service with two workers, and what a test sees of it."""

    def __init__(self, folder: Path, **settings: str) -> None:
        folder.mkdir(exist_ok=True)
        self.systemd = Notified(folder)
        self.metrics_port = free_ports(COUNT)
        self.server: Server = service_server(
            folder,
            {
                "NOTIFY_SOCKET": str(self.systemd.path),
                "SURFACE_STORE": str(folder / "store"),
                "SURFACE_WORKERS": str(COUNT),
                "SURFACE_METRICS_PORT": str(self.metrics_port),
                "SURFACE_ACCESS_LOG": "false",
                **settings,
            },
        )

    @property
    def log(self) -> str:
        return self.server.log.read_text(encoding="utf-8")

    def ask_worker(self, number: int, path: str) -> httpx.Response:
        """The response of one worker, at its port for metrics."""
        return httpx.get(f"http://127.0.0.1:{self.metrics_port + number}{path}", timeout=PATIENCE)


def wait_until(condition: Callable[[], object]) -> None:
    """Waits until a condition is true; fails after `PATIENCE` seconds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@contextmanager
def start_workers(folder: Path, **settings: str) -> Iterator[Workers]:
    """Two workers that serve; they are killed after the block."""
    workers = Workers(folder, **settings)
    workers.server.start()
    pids: list[int] = []
    try:
        assert workers.systemd.read() == "READY=1", workers.log
        pids = workers.server.worker_pids()
        yield workers
    finally:
        if workers.server.is_alive:
            pids = workers.server.worker_pids()
            workers.server.kill()
        for pid in filter(is_running, pids):
            os.kill(pid, signal.SIGKILL)
        workers.systemd.close()


def is_running(pid: int) -> bool:
    """Whether a process runs that is not a zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
