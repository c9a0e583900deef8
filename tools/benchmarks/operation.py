"""The figures of docs/runbook.md: memory, and processor time, of a service in a process of its own.

Processor time does not grow with the load of the machine, as the time of a clock does.
"""

import os
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import httpx

from tools.processes import Server, peak_memory, resident_memory, service_server

CLIENTS = 12
"""Clients that request a large mesh at the same time."""

SMALL_MEMORY, LARGEST = "250MB", 780
"""`SURFACE_MEMORY_BYTES` while large meshes are requested; and the divisions of one patch in almost
the largest mesh that this memory allows."""

PATCH: dict[str, Any] = {"control_net": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]]]}
TEAPOT = "/v1/surfaces/utah-teapot/mesh.glb?resolution=16"


class Figure(NamedTuple):
    """A measured number: its text in the runbook, its unit, and its value."""

    text: str
    unit: str
    value: float


def measure_figures(share: float = 1.0) -> Iterator[Figure]:
    """Measures all figures, in the order of the table of the runbook.

    `share` is the part of the usual number of requests; with fewer, the figures vary more.
    """
    with tempfile.TemporaryDirectory() as folder:
        with service_server(Path(folder), {}, probe="/health/ready") as server:
            yield Figure(
                "memory of a process that has served no request",
                "MB",
                resident_memory(server.pid) / 1e6,
            )
            with httpx.Client(base_url=server.url, timeout=60) as client:
                client.get(TEAPOT).raise_for_status()
                text = "processor time from the start to the first mesh"
                yield Figure(text, "s", processor_time(server.pid))
                yield from _measure_requests(server, client, share)
        settings = {"SURFACE_MEMORY_BYTES": SMALL_MEMORY}
        with service_server(Path(folder), settings, probe="/health/ready") as server:
            _request_large_meshes(server.url)
            text = f"most memory with `SURFACE_MEMORY_BYTES={SMALL_MEMORY}`, while twelve clients "
            yield Figure(f"{text}request the largest mesh", "MB", peak_memory(server.pid) / 1e6)


def processor_time(pid: int) -> float:
    """Seconds that a process has computed, in all of its threads (proc_pid_stat(5))."""
    stat = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    user, system = stat.rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def _measure_requests(server: Server, client: httpx.Client, share: float) -> Iterator[Figure]:
    """The processor time of the service for each request of several kinds."""

    def measure(usual_count: int, request: Callable[[], httpx.Response]) -> float:
        count = max(3, round(share * usual_count))
        request().raise_for_status()
        start = processor_time(server.pid)
        for _ in range(count):
            request().raise_for_status()
        return (processor_time(server.pid) - start) / count * 1e3

    surface = client.get("/v1/surfaces/utah-teapot").json()
    small, large = ({**surface, "resolution": divisions} for divisions in (16, 125))
    post = "/v1/mesh?format=glb"
    milliseconds = measure(600, lambda: client.get(TEAPOT))
    yield Figure("processor time of a cached response", "ms", milliseconds)
    milliseconds = measure(200, lambda: client.post(post, json={"surface": PATCH}))
    yield Figure("… of one patch at 16 divisions as glTF", "ms", milliseconds)
    milliseconds = measure(40, lambda: client.post(post, json=small))
    yield Figure("… of the teapot (32 patches) at 16 divisions as glTF", "ms", milliseconds)
    milliseconds = measure(4, lambda: client.post(post, json=large))
    yield Figure("… of a mesh of 500 000 vertices", "ms", milliseconds)


def _request_large_meshes(url: str) -> None:
    """Requests the largest mesh that the memory allows, from several clients at once."""
    limits = httpx.Limits(max_connections=CLIENTS)

    def request(number: int) -> None:
        # Different bodies: equal ones would share nothing, but the plan of the mesh is the same.
        net = [[[0, 0, 0], [0, 1, number]], [[1, 0, 1], [1, 1, 0]]]
        body = {"surface": {"control_net": net}, "resolution": LARGEST}
        with client.stream("POST", "/v1/mesh?format=glb", json=body) as response:
            response.raise_for_status()
            for _ in response.iter_bytes(1 << 20):
                pass

    with (
        httpx.Client(base_url=url, timeout=120, limits=limits) as client,
        ThreadPoolExecutor(CLIENTS) as pool,
    ):
        list(pool.map(request, range(CLIENTS)))


def write_rows(figures: Iterator[Figure]) -> Iterator[str]:
    """The rows of the table of the runbook, with two digits."""
    for text, unit, value in figures:
        yield f"| {text} | {float(f'{value:.2g}'):g} {unit} |"


def run() -> None:
    """Prints the table of the runbook."""
    print("| figure | measured |\n| --- | --- |")
    for row in write_rows(measure_figures()):
        print(row, flush=True)
