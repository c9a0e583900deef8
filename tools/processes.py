"""Starts servers as processes, and measures the memory and the open files of a process.

It works on Linux only, because it reads the memory of a process from /proc.
"""

import os
import random
import re
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing, suppress
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from types import TracebackType
from typing import Self

import httpx

from tools.programs import find_program

ROOT = Path(__file__).parents[1]
HOST = "127.0.0.1"
PATIENCE = 120.0
"""Seconds within which a process must start, or end."""


def free_port() -> int:
    """A port on which no process listens."""
    with socket.socket() as listener:
        listener.bind((HOST, 0))
        return int(listener.getsockname()[1])


def free_ports(count: int) -> int:
    """The first of `count` successive ports on which no process listens.

    They are below those that the system gives to connections and to `free_port`.
    """
    while True:
        first = random.randrange(10_000, 32_000)
        with ExitStack() as stack, suppress(OSError):
            for port in range(first, first + count):
                stack.enter_context(socket.create_server((HOST, port)))
            return first


def resident_memory(pid: int | str = "self") -> int:
    """Bytes of memory that a process uses now."""
    return _read_status(pid, "VmRSS")


def peak_memory(pid: int | str = "self") -> int:
    """The most bytes that a process used since its start or since `reset_peak`."""
    return _read_status(pid, "VmHWM")


def reset_peak(pid: int | str = "self") -> None:
    """Resets `peak_memory` to the memory that the process uses now (proc_pid_clear_refs(5))."""
    Path(f"/proc/{pid}/clear_refs").write_text("5", encoding="ascii")


def own_memory(pid: int) -> int:
    """Bytes of memory that a process uses, its part of shared memory included (PSS, proc(5))."""
    rollup = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii")
    return sum(int(kilobytes) for kilobytes in re.findall(r"^Pss:\s+(\d+)", rollup, re.M)) * 1024


def list_family(pid: int) -> list[int]:
    """A process, the processes that it has started, and so on."""
    children: list[int] = []
    for thread in Path(f"/proc/{pid}/task").iterdir():
        children += map(int, (thread / "children").read_text(encoding="ascii").split())
    return [pid, *(each for child in children for each in list_family(child))]


def _read_status(pid: int | str, name: str) -> int:
    """The bytes of a field of /proc/PID/status."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    match = re.search(rf"^{name}:\s+(\d+) kB", status, re.MULTILINE)
    if match is None:
        raise RuntimeError(f"process {pid} has ended")
    return int(match[1]) * 1024


class Server:
    """A program that listens on a port and writes to a log. It can be started again after it ended.

    As a context manager it starts the program, waits until the program responds, and ends it.

    Parameters
    ----------
    log : Path
        The program's output is appended to this file.
    command : sequence
    port : int
    environment : mapping
        All environment variables of the program.
    probe : str, optional
        A path that responds with 200 once the program is ready. By default the program is ready
        once it accepts a connection.
    folder : Path, optional
        The working folder of the program; by default this checkout.
    """

    def __init__(
        self,
        log: Path,
        command: Sequence[str | Path],
        port: int,
        environment: Mapping[str, str],
        *,
        probe: str = "",
        folder: Path = ROOT,
    ) -> None:
        self.log = log
        self.port = port
        self.url = f"http://{HOST}:{port}"
        self._command = command
        self._environment = environment
        self._probe = probe
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        self.start()
        try:
            self.wait_until_ready()
        except BaseException:
            self.kill()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        has_ended = not self.is_alive
        self.stop()
        if has_ended and error is None:
            raise RuntimeError(f"the program ended by itself; its log is {self.log}")

    def start(self, changes: Mapping[str, str] | None = None) -> None:
        """Starts the program; `wait_until_ready` waits until it responds.

        `changes` replace environment variables for this start.
        """
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(
                self._command,
                cwd=self._folder,
                env={**self._environment, **(changes or {})},
                stdout=log,
                stderr=log,
            )

    @property
    def process(self) -> "subprocess.Popen[bytes]":
        """The process that was started last."""
        assert self._process is not None
        return self._process

    @property
    def pid(self) -> int:
        return self.process.pid

    @property
    def is_alive(self) -> bool:
        """Whether the program is running."""
        return self._process is not None and self._process.poll() is None

    def wait_until_ready(self) -> None:
        """Returns once the program responds.

        Raises
        ------
        RuntimeError
            The program has ended, or takes too long. The message is the end of its log.
        """
        end = time.monotonic() + PATIENCE
        while not self.is_ready():
            if not self.is_alive or time.monotonic() > end:
                lines = self.log.read_text(encoding="utf-8").splitlines()[-20:]
                code = self.process.poll()
                raise RuntimeError("\n".join([f"not ready, exit code {code}", *lines]))
            time.sleep(0.05)

    def is_ready(self) -> bool:
        """Whether the program responds to the probe with 200, or accepts a connection."""
        # httpx would read all certificates of the system each time, which takes as long as a mesh.
        connection = HTTPConnection(HOST, self.port, 5)
        with suppress(OSError, HTTPException), closing(connection):
            if self._probe:
                connection.request("GET", self._probe)
                return connection.getresponse().status == 200
            connection.connect()
            return True
        return False

    def stop(self) -> int:
        """Sends SIGTERM, after `PATIENCE` seconds SIGKILL; returns the exit code of the process."""
        self.process.terminate()
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            return self.kill()

    def kill(self) -> int:
        """Sends SIGKILL, waits until the process has ended, and returns its exit code."""
        self.process.kill()
        return self.process.wait(PATIENCE)

    def worker_pids(self) -> list[int]:
        """The processes that the program has started, without multiprocessing's helper."""
        pids = []
        for file in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):  # a process that has just ended
                # The second field, the name in parentheses, may contain spaces.
                parent = file.read_text(encoding="utf-8").rpartition(")")[2].split()[1]
                command = file.with_name("cmdline").read_bytes()
                if int(parent) == self.pid and b"resource_tracker" not in command:
                    pids.append(int(file.parent.name))
        return sorted(pids)

    def open_files(self) -> int:
        """The number of file descriptors that the process has open."""
        return len(os.listdir(f"/proc/{self.pid}/fd"))


def service_environment(settings: Mapping[str, str]) -> dict[str, str]:
    """The environment of this process, with these settings in place of its variables `SURFACE_…`.

    By default, the service stores surfaces in memory.
    """
    variables = {key: value for key, value in os.environ.items() if not key.startswith("SURFACE_")}
    return variables | {"SURFACE_STORE": "memory://"} | dict(settings)


def service_server(
    folder: Path, settings: Mapping[str, str], name: str = "service", probe: str = "/health/live"
) -> Server:
    """The service as an operator starts it, at a free port, with its log in this folder."""
    port = free_port()
    command = (sys.executable, "-m", "service", "serve", "--port", str(port))
    log = folder / f"{name}-{port}.log"
    return Server(log, command, port, service_environment(settings), probe=probe)


class Proxy(Server):
    """HAProxy with the configuration of `deploy/`, in front of the services at two ports."""

    def __init__(self, folder: Path, first_port: int, second_port: int) -> None:
        port = free_port()
        self._metrics_port = free_port()
        environment = {
            "SURFACE_1": f"{HOST}:{first_port}",
            "SURFACE_2": f"{HOST}:{second_port}",
            "SURFACE_PROXY_BIND": f"{HOST}:{port}",
            "SURFACE_PROXY_NUMBERS": f"{HOST}:{self._metrics_port}",
        }
        command = (
            find_program("haproxy"),
            "-db",  # in the foreground
            "-f",
            ROOT / "deploy" / "haproxy" / "haproxy.cfg",
        )
        super().__init__(folder / "haproxy.log", command, port, environment)

    def metric(self, name: str, label: str = "") -> float:
        """The sum of a metric of HAProxy over the series with a label, `name="value"`, or all."""
        text = httpx.get(f"http://{HOST}:{self._metrics_port}/metrics").text
        lines = (line for line in text.splitlines() if line.startswith(name + "{"))
        return sum(float(line.rpartition(" ")[2]) for line in lines if label in line)
