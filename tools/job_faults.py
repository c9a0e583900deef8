"""Injects faults into running jobs, and prints a table of the outcomes: `make test-jobs`.

1. Ten callers queue a hundred jobs of a hundred parts each: all must end, none may be lost, and at
   no time may one caller have much more than another.
2. A job process and then the service are killed (kill -9) in mid-job: the parts must equal those of
   an undisturbed run, and no finished part may be computed again.
3. With two workers, the one that works on a job is killed: the other, or its replacement, goes on.
4. A job of heavy parts is cancelled: after two seconds no process may compute.
5. The disk gets full in mid-job: the state must name it, and the job must go on when there is room.
   This one mounts a small tmpfs; the program is skipped if it may not.

Each fault has a service in a process of its own, with a store in a folder. The program fails if a
fault does.
"""

import glob
import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import orjson

from service.api.guard.keys import format_entry, make_key
from tools.processes import Server, service_server

CALLERS, JOBS, PARTS = 10, 100, 100
"""How many callers, jobs of each, and parts of each job."""

PATIENCE = 1200.0
"""Seconds within which all jobs of a fault must have ended."""


def make_part(number: int, size: int = 8, resolution: int = 16) -> dict[str, Any]:
    """A mesh of a B-spline; each number gives another one."""
    net = [[[i, j, (i * j) % 7 + number / 7] for j in range(size)] for i in range(size)]
    surface = {"type": "bspline", "degree": 3, "knots": "clamped", "control_net": net}
    return {
        "name": f"part {number}",
        "path": "/v1/mesh?format=glb",
        "body": {"surface": surface, "resolution": resolution},
    }


def make_tiny(number: int) -> dict[str, Any]:
    """A mesh of two triangles."""
    net = [[[0, 0, number], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]
    body = {"surface": {"control_net": net}, "resolution": 1}
    return {"path": "/v1/mesh?format=off", "body": body}


class Client:
    """A client of jobs, with a key or without."""

    def __init__(self, url: str, key: str = "") -> None:
        headers = {"Authorization": f"Bearer {key}"} if key else {}
        self.http = httpx.Client(base_url=url, headers=headers, timeout=120)

    def submit(self, parts: Sequence[dict[str, Any]]) -> str:
        body = b"\n".join(map(orjson.dumps, parts))
        headers = {"Content-Type": "application/x-ndjson"}
        response = self.http.post("/v1/jobs", content=body, headers=headers)
        assert response.status_code in (200, 202), response.text
        return str(response.json()["id"])

    def state(self, id: str) -> dict[str, Any]:
        try:
            response = self.http.get(f"/v1/jobs/{id}")
        except httpx.TransportError:  # the process of this connection was killed
            response = self.http.get(f"/v1/jobs/{id}")
        assert response.status_code == 200, response.text
        document: dict[str, Any] = response.json()
        return document

    def wait(self, id: str, is_enough: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The state of a job as soon as it is enough."""
        end = time.monotonic() + PATIENCE
        while not is_enough(state := self.state(id)):
            assert time.monotonic() < end, state
            time.sleep(0.1)
        return state

    def wait_for_end(self, id: str) -> dict[str, Any]:
        return self.wait(id, lambda state: state["ended"] is not None)

    def digests(self, id: str) -> list[str]:
        """The hashes of all results: those of the list, checked by those of the files."""
        digests: list[str] = []
        url = f"/v1/jobs/{id}/results?limit=1000"
        while url:
            page = self.http.get(url).json()
            digests += [result["sha256"] for result in page["results"]]
            url = page.get("next", "")
        for part in range(0, len(digests), 7):
            content = self.http.get(f"/v1/jobs/{id}/results/{part}").content
            assert hashlib.sha256(content).hexdigest() == digests[part]
        return digests


@contextmanager
def start(folder: Path, **settings: str) -> Iterator[tuple[Server, Client]]:
    """A service with a store in the folder, and its client."""
    environment = {"SURFACE_STORE": str(folder / "store"), "SURFACE_LOG_LEVEL": "info", **settings}
    with service_server(folder, environment) as server:
        yield server, Client(server.url)


def children(pid: int) -> list[int]:
    """The processes that a process has started and that compute: without Python's own helpers."""
    found = []
    for path in glob.glob(f"/proc/{pid}/task/*/children"):
        with suppress(OSError):
            found += [int(child) for child in Path(path).read_text(encoding="ascii").split()]
    return [child for child in found if b"spawn_main" in command_of(child)]


def command_of(pid: int) -> bytes:
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


def processor_seconds(pids: Sequence[int]) -> float:
    """The time of the processor that processes have used."""
    ticks = 0
    for pid in pids:
        with suppress(OSError):
            text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            ticks += int(text[11]) + int(text[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def queue_a_thousand_jobs(folder: Path) -> str:
    """Ten callers, a hundred jobs each, a hundred parts each."""
    keys = [make_key() for _ in range(CALLERS)]
    lines = ",".join(format_entry(f"c{number}", key) for number, key in enumerate(keys))
    with start(folder, SURFACE_API_KEYS=lines) as (server, _):
        clients = [Client(server.url, key) for key in keys]
        begin = time.monotonic()
        ids: dict[str, int] = {}
        for job in range(JOBS):
            for caller, client in enumerate(clients):
                first = (job * CALLERS + caller) * PARTS
                ids[client.submit([make_tiny(n) for n in range(first, first + PARTS)])] = caller
        queued = time.monotonic() - begin
        assert len(ids) == CALLERS * JOBS
        widest, ended = 0, 0
        while ended < len(ids):
            assert time.monotonic() < begin + PATIENCE
            time.sleep(1)
            counts = []
            for client in clients:
                jobs = client.http.get("/v1/jobs").json()["jobs"]
                assert len(jobs) == JOBS, "a job is lost"
                assert all(job["parts"]["failed"] == 0 for job in jobs)
                counts.append(sum(job["state"] == "succeeded" for job in jobs))
            ended = sum(counts)
            if max(counts) < JOBS:
                widest = max(widest, max(counts) - min(counts))
        took = time.monotonic() - begin
        for number, (id, caller) in enumerate(ids.items()):
            if number % 50 == 0:
                assert len(clients[caller].digests(id)) == PARTS
        # Turns are by seconds, which differ between equal jobs on a busy machine.
        assert widest <= JOBS // 2, f"a caller was {widest} jobs ahead"
    return (
        f"{len(ids)} jobs, queued in {queued:.0f} s, ended in {took:.0f} s "
        f"({len(ids) * PARTS / took:.0f} parts/s); largest lead of a caller: {widest} jobs"
    )


def kill_in_mid_job(folder: Path) -> str:
    """kill -9 of the service, and of a job process; compared with an undisturbed run."""
    parts = [make_part(number) for number in range(3000)]
    with start(folder / "undisturbed") as (_, client):
        begin = time.monotonic()
        id = client.submit(parts)
        assert client.wait_for_end(id)["state"] == "succeeded"
        alone = time.monotonic() - begin
        expected = client.digests(id)
    folder /= "killed"
    with start(folder) as (server, client):
        begin = time.monotonic()
        assert client.submit(parts) == id
        client.wait(id, lambda state: state["parts"]["succeeded"] > 300)
        process = children(server.pid)[0]
        os.kill(process, signal.SIGKILL)
        client.wait(id, lambda state: state["parts"]["succeeded"] > 1000)
        orphans = children(server.pid)
        owner_file = folder / "store/owners" / id
        owner = owner_file.read_bytes()
        server.kill()
        before = {path: path.stat().st_mtime_ns for path in (folder / "store/parts").rglob("*/*")}
        dead = time.monotonic()
        while any(map(is_computing, orphans)):
            assert time.monotonic() < dead + 3, "job processes have outlived the service"
            time.sleep(0.05)
        orphaned = time.monotonic() - dead
        server.start()
        server.wait_until_ready()
        started = time.monotonic()
        while owner_file.read_bytes() == owner:
            assert time.monotonic() < started + 60, "the job was not taken over"
            time.sleep(0.02)
        resumed = time.monotonic() - started
        assert client.wait_for_end(id)["state"] == "succeeded"
        took = time.monotonic() - begin
        assert client.digests(id) == expected
        assert len(expected) == len(parts)
        again = sum(path.stat().st_mtime_ns != time_ns for path, time_ns in before.items())
        assert not again, f"{again} finished parts were computed again"
    return (
        f"{len(parts)} parts equal; {took:.0f} s ({alone:.0f} s undisturbed); processes ended "
        f"{orphaned:.2f} s after the service; job taken over {resumed:.1f} s after the new start; "
        f"{len(before)} parts that were there, 0 computed again"
    )


def kill_a_worker(folder: Path) -> str:
    """kill -9 of the worker that works on a job, with two workers; all workers know all jobs."""
    parts = [make_part(number) for number in range(2000)]
    with start(folder, SURFACE_WORKERS="2") as (server, client):
        id = client.submit(parts)
        client.wait(id, lambda state: state["parts"]["succeeded"] > 100)
        for _ in range(20):  # on new connections, so that both workers respond
            with httpx.Client(base_url=server.url) as other:
                assert other.get(f"/v1/jobs/{id}").json()["parts"]["total"] == len(parts)
        (owner,) = [worker for worker in children(server.pid) if children(worker)]
        os.kill(owner, signal.SIGKILL)
        begin = time.monotonic()
        had = client.state(id)["parts"]["succeeded"]
        client.wait(id, lambda state: state["parts"]["succeeded"] > had)
        resumed = time.monotonic() - begin
        assert client.wait_for_end(id)["state"] == "succeeded"
        digests = client.digests(id)
        assert len(digests) == len(parts)
        for number in range(0, len(parts), 100):
            file = client.http.post(parts[number]["path"], json=parts[number]["body"]).content
            assert hashlib.sha256(file).hexdigest() == digests[number]
    return f"{len(parts)} parts; next batch done {resumed:.1f} s after the kill"


def is_computing(pid: int) -> bool:
    with suppress(OSError):
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return False


def cancel_a_job(folder: Path) -> str:
    """DELETE of a job whose parts take half a minute each."""
    parts = [make_part(number, size=40) for number in range(8)]
    for part in parts:
        part["body"] = {"surface": part["body"]["surface"], "tolerance": 2e-5}
    with start(folder) as (server, client):
        id = client.submit(parts)
        client.wait(id, lambda state: state["parts"]["running"] > 0)
        while not children(server.pid) or processor_seconds(children(server.pid)) < 3:
            assert client.state(id)["state"] == "running"
            time.sleep(0.1)
        begin = time.monotonic()
        assert client.http.delete(f"/v1/jobs/{id}").status_code == 204
        assert client.state(id)["state"] == "cancelled"
        time.sleep(max(0.0, begin + 2 - time.monotonic()))
        pids = children(server.pid)
        used = processor_seconds(pids)
        time.sleep(2)
        more = processor_seconds(pids) - used
        assert more <= 0.05, f"{more} s of the processor after the cancellation"
        assert client.state(id)["state"] == "cancelled"
    return f"{len(pids)} processes idle 2 s after DELETE ({more:.2f} s of the processor in 2 s)"


def fill_the_disk(folder: Path) -> str:
    """A tmpfs that has room for half of the results, until a file is removed."""
    folder.mkdir(parents=True, exist_ok=True)
    mount = ["mount", "-t", "tmpfs", "-o", "size=480m", "tmpfs", str(folder)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        return "skipped: no tmpfs can be mounted; run this as root"
    try:
        ballast = folder / "ballast"
        ballast.write_bytes(bytes(300 << 20))
        parts = [make_part(number) for number in range(1600)]
        with start(folder) as (_, client):
            id = client.submit(parts)
            state = client.wait(id, lambda state: bool(state.get("waiting_for")))
            assert state["waiting_for"] == "disk_full", state
            assert state["state"] == "running"
            had = state["parts"]["succeeded"]
            assert client.http.get("/health/live").status_code == 200
            time.sleep(15)  # it is tried again, in vain
            assert client.state(id)["waiting_for"] == "disk_full"
            ballast.unlink()
            begin = time.monotonic()
            assert client.wait_for_end(id)["state"] == "succeeded"
            took = time.monotonic() - begin
            digests = client.digests(id)
        with start(Path(tempfile.mkdtemp(dir=folder.parent))) as (_, client):
            client.submit(parts)
            client.wait_for_end(id)
            assert client.digests(id) == digests
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)
    return (
        f"disk_full named with {had} of {len(parts)} parts; all {took:.0f} s after there was room"
    )


FAULTS = (queue_a_thousand_jobs, kill_in_mid_job, kill_a_worker, cancel_a_job, fill_the_disk)


def main() -> int:
    """Injects the faults, or only those that the arguments name; returns the exit status."""
    failed = False
    for fault in FAULTS:
        if sys.argv[1:] and fault.__name__ not in sys.argv[1:]:
            continue
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            try:
                seen = fault(Path(folder) / "fault")
            except AssertionError as error:
                failed, seen = True, f"FAILED: {error}"
        print(f"{fault.__name__.replace('_', ' ')}: {seen}", flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
