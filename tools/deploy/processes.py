"""Instances of the service as processes of their own, and in front of them HAProxy."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import httpx

from tests.programs import program

ROOT = Path(__file__).parents[2]
HAPROXY = ROOT / "deploy" / "haproxy" / "haproxy.cfg"
PATIENCE = 120.0
"""Seconds within which a process starts, or ends."""


def free_port() -> int:
    """A port that nobody listens at just now."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


class Instance:
    """One process of the service, on one port whenever it is started."""

    def __init__(self, name: str, folder: Path, settings: dict[str, str]) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._log = folder / f"{name}.log"
        self._settings = settings
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Starts it; `wait_until_ready` says when it serves."""
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith("SURFACE_")
        }
        environment |= self._settings | {
            "SURFACE_HOST": "127.0.0.1",
            "SURFACE_PORT": str(self.port),
            "PYTHONPATH": str(ROOT),
        }
        with self._log.open("ab") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "service", "serve"],
                cwd=ROOT,
                env=environment,
                stdout=log,
                stderr=log,
            )

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self.process is not None and self.process.poll() is None

    @property
    def peak_bytes(self) -> int:
        """The most memory that it had at any time, as resident."""
        assert self.process is not None
        status = Path(f"/proc/{self.process.pid}/status").read_text(encoding="ascii")
        return int(re.findall(r"VmHWM:\s+(\d+) kB", status)[0]) * 1024

    def is_ready(self) -> bool:
        """Whether it says that it is ready."""
        with suppress(httpx.TransportError):
            return httpx.get(f"{self.url}/health/ready", timeout=5).status_code == 200
        return False

    def wait_until_ready(self) -> None:
        """Returns once it serves.

        Raises
        ------
        RuntimeError
            It has ended, or takes too long; with the end of its log.
        """
        assert self.process is not None
        end = time.monotonic() + PATIENCE
        while not self.is_ready():
            if self.process.poll() is not None or time.monotonic() > end:
                ended = f"it has ended with {self.process.poll()}"
                raise RuntimeError(f"the service does not start; {ended}:\n{self.last_lines()}")
            time.sleep(0.1)

    def stop(self) -> int:
        """SIGTERM, as whoever runs containers sends it; the exit code once the process is gone."""
        assert self.process is not None
        self.process.terminate()
        return self.process.wait(PATIENCE)

    def kill(self) -> int:
        """SIGKILL: the process has no say in it."""
        assert self.process is not None
        self.process.kill()
        return self.process.wait(PATIENCE)

    def last_lines(self) -> str:
        """The end of its log."""
        return "\n".join(self._log.read_text(encoding="utf-8").splitlines()[-20:])


class Proxy:
    """The HAProxy of `deploy/`, its file as it is shipped, addresses from the environment."""

    def __init__(self, folder: Path, *ports: int) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self._log = (folder / "haproxy.log").open("ab")
        one, two = ports
        self.numbers = free_port()
        self.process = subprocess.Popen(
            [program("haproxy"), "-db", "-f", HAPROXY],
            env={
                "SURFACE_1": f"127.0.0.1:{one}",
                "SURFACE_2": f"127.0.0.1:{two}",
                "SURFACE_PROXY_BIND": f"127.0.0.1:{self.port}",
                "SURFACE_PROXY_NUMBERS": f"127.0.0.1:{self.numbers}",
            },
            stdout=self._log,
            stderr=self._log,
        )
        self._wait()

    def metric(self, name: str, label: str = "") -> float:
        """The sum of one of HAProxy's own numbers over all that have such a label."""
        text = httpx.get(f"http://127.0.0.1:{self.numbers}/metrics").text
        lines = (line for line in text.splitlines() if line.startswith(name + "{"))
        return sum(float(line.rpartition(" ")[2]) for line in lines if label in line)

    def stop(self) -> None:
        """Ends it, whoever is connected."""
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(PATIENCE)
        self._log.close()

    def _wait(self) -> None:
        end = time.monotonic() + PATIENCE
        while True:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self.port)):
                return
            if self.process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"HAProxy did not start: {Path(self._log.name).read_text()}")
            time.sleep(0.05)
