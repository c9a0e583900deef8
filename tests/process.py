"""The service in a process of its own, as an operator starts it, and what it takes of the machine.

Linux only: what a process holds is read from /proc.
"""

import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True, slots=True)
class Service:
    """A service that runs.

    Attributes
    ----------
    port : int
        Where it listens on this machine.
    pid : int
    log : Path
        The file that it writes its log to.
    """

    port: int
    pid: int
    log: Path

    @property
    def url(self) -> str:
        """Its address."""
        return f"http://127.0.0.1:{self.port}"

    def resident(self) -> int:
        """Bytes of memory that it holds now."""
        return self._status("VmRSS")

    def most_resident(self) -> int:
        """The most that it has held, since it started or `forget_most` was called."""
        return self._status("VmHWM")

    def forget_most(self) -> None:
        """Begins that anew (proc_pid_clear_refs(5))."""
        Path(f"/proc/{self.pid}/clear_refs").write_text("5", encoding="ascii")

    def files(self) -> int:
        """File descriptors that it has open."""
        return len(os.listdir(f"/proc/{self.pid}/fd"))

    def _status(self, name: str) -> int:
        status = Path(f"/proc/{self.pid}/status").read_text(encoding="ascii")
        found = re.search(rf"^{name}:\s+(\d+) kB", status, re.MULTILINE)
        if found is None:
            raise RuntimeError(f"process {self.pid} has ended")
        return int(found.group(1)) * 1024


@contextmanager
def service_process(folder: Path, settings: Mapping[str, str]) -> Iterator[Service]:
    """A service with these settings, `SURFACE_…`, and none from the environment, until the block
    ends; its log is kept in the folder. Surfaces are kept in memory unless the settings say else.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ours = {key: value for key, value in os.environ.items() if not key.startswith("SURFACE_")}
    environment = ours | {"PYTHONPATH": str(ROOT), "SURFACE_STORE": "memory://"} | dict(settings)
    command = [sys.executable, "-m", "service", "serve", "--port", str(port)]
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / f"service-{port}.log"
    with (
        log.open("wb") as output,
        subprocess.Popen(
            command, cwd=ROOT, env=environment, stdout=output, stderr=subprocess.STDOUT
        ) as process,
    ):
        service = Service(port, process.pid, log)
        try:
            _wait(service, process)
            yield service
            if process.poll() is not None:
                raise RuntimeError(f"the service ended; its log is {log}")
        finally:
            process.terminate()
            try:
                process.wait(timeout=40)
            except subprocess.TimeoutExpired:
                process.kill()


def _wait(service: Service, process: "subprocess.Popen[bytes]") -> None:
    """Returns when it answers."""
    for _ in range(600):
        if process.poll() is not None:
            raise RuntimeError(service.log.read_text(encoding="utf-8"))
        try:
            httpx.get(f"{service.url}/health/live").raise_for_status()
            return
        except httpx.TransportError:
            time.sleep(0.05)
    raise RuntimeError(f"the service does not answer; its log is {service.log}")
