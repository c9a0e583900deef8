"""A Dask cluster on this machine: commands that are started again when they end.

It works on Linux only, because it finds the processes of workers in /proc.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import dask

from tools.processes import HOST, PATIENCE, ROOT, Server, free_port
from tools.programs import find_program

ROLES = ("CLIENT", "SCHEDULER", "WORKER")
WATCH_SECONDS = 0.2
"""Seconds between looks whether a command has ended."""


def make_certificates(folder: Path) -> dict[str, str]:
    """Makes a certificate in a folder; the variables of Dask's settings that name it."""
    command = (
        find_program("openssl"), "req", "-x509", "-newkey", "ec", "-pkeyopt",
        "ec_paramgen_curve:P-256", "-nodes", "-days", "1", "-subj", "/CN=surface-cluster",
        "-keyout", "tls.key", "-out", "tls.crt",
    )  # fmt: skip
    subprocess.run(command, cwd=folder, capture_output=True, check=True)
    prefix = "DASK_DISTRIBUTED__COMM__"
    variables = {f"{prefix}TLS__CA_FILE": str(folder / "tls.crt")}
    for role in ROLES:
        variables[f"{prefix}TLS__{role}__CERT"] = str(folder / "tls.crt")
        variables[f"{prefix}TLS__{role}__KEY"] = str(folder / "tls.key")
    return variables | {f"{prefix}REQUIRE_ENCRYPTION": "true", f"{prefix}DEFAULT_SCHEME": "tls"}


def use_certificates(variables: Mapping[str, str]) -> None:
    """Makes Dask in this process read its settings again, with these variables."""
    os.environ.update(variables)
    dask.config.refresh()


class Cluster:
    """A scheduler and workers, each started again when it ends (`restart: always`).

    Parameters
    ----------
    folder : Path
        Gets the logs, and the files of workers.
    workers : int
        The number of workers, each with one thread.
    certificates : mapping
        The variables of `make_certificates`.
    """

    def __init__(self, folder: Path, workers: int, certificates: Mapping[str, str]) -> None:
        environment = {**os.environ, **certificates, "PYTHONPATH": str(ROOT)}
        port = free_port()
        self.address = f"tls://{HOST}:{port}"
        dask = (sys.executable, "-m", "dask")
        own = ("--host", HOST, "--dashboard-address", f"{HOST}:0")
        self.scheduler = Server(
            folder / "scheduler.log",
            (*dask, "scheduler", "--port", str(port), *own),
            port,
            environment,
        )
        worker = (
            *dask, "worker", self.address, *own, "--preload", "service.jobs.dask_worker",
            "--nthreads", "1", "--memory-limit", "0", "--local-directory", str(folder / "dask"),
        )  # fmt: skip
        self.workers = [
            Server(folder / f"worker-{number}.log", worker, 0, environment)
            for number in range(workers)
        ]
        self._has_ended = threading.Event()
        self._watch = threading.Thread(target=self._start_again, name="restart always")

    def start(self) -> None:
        """Starts the commands, and watches them; returns when the scheduler responds."""
        self.scheduler.start()
        for worker in self.workers:
            worker.start()
        self._watch.start()
        self.scheduler.wait_until_ready()

    def stop(self) -> None:
        """Ends all commands."""
        self._has_ended.set()
        self._watch.join()
        for command in (*self.workers, self.scheduler):
            command.stop()

    def kill_worker(self, number: int) -> int:
        """Sends SIGKILL to the process that computes; its parent, the nanny, starts another one."""
        (pid,) = find_workers(self.workers[number].pid)
        os.kill(pid, signal.SIGKILL)
        return pid

    def _start_again(self) -> None:
        while not self._has_ended.wait(WATCH_SECONDS):
            for command in (self.scheduler, *self.workers):
                if not command.is_alive:
                    command.start()


@contextmanager
def run_cluster(folder: Path, workers: int, certificates: Mapping[str, str]) -> Iterator[Cluster]:
    """A cluster that runs until the block ends."""
    cluster = Cluster(folder, workers, certificates)
    cluster.start()
    try:
        yield cluster
    finally:
        cluster.stop()


def find_workers(nanny: int) -> list[int]:
    """The processes that compute, below the nanny with this process id; waits for the first."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        lists = Path(f"/proc/{nanny}/task").glob(
            "*/children"
        )  # each thread has children of its own
        children = " ".join(each.read_text(encoding="ascii") for each in lists).split()
        commands = {int(pid): Path(f"/proc/{pid}/cmdline").read_bytes() for pid in children}
        if pids := [pid for pid, command in commands.items() if b"spawn_main" in command]:
            return pids
        time.sleep(0.05)
    raise RuntimeError(f"the nanny {nanny} has started no worker")
