"""Callers that take much, and the times of another caller: the second table of `make test-attack`.

The service runs with two threads. One caller, at the address 127.0.0.2, sends heavy work or reads
large responses slowly. Another, at 127.0.0.1, sends one mesh at a time that a thread computes: in
turn to this service, and to a second one without other clients. So both times are measured on the
same machine in the same minute.
"""

import asyncio
import json
import random
import re
import socket
import statistics
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import repeat
from pathlib import Path

from tools.attack.wire import HOST, build_get, build_post, open_connection, summarize
from tools.cad_files.sheets import write_sheets
from tools.processes import service_server

TAKER = "127.0.0.2"
"""The address of the caller that takes much."""

SETTINGS = {
    "SURFACE_THREADS": "2",
    "SURFACE_MEMORY_BYTES": "400000000",
    "SURFACE_CACHE_BYTES": "0",
}

START_SECONDS, SECONDS = 4.0, 20.0
"""Seconds for which the first caller begins, and for which the other one is measured."""

PAUSE = 0.03
"""Seconds from the end of a request of the measured caller to its next."""

HEAVY_CONNECTIONS = 20
MAX_WAIT = 1.0
"""The most seconds that a mesh of the other caller may wait beside `HEAVY_CONNECTIONS`."""

SLOW_CONNECTIONS, SLOW_BYTES = 10, 50_000
"""Number of slow readers, and the bytes that each reads a second."""

FILE_BYTES = 20_000_000
"""Bytes of a file of `send_files`."""

MAX_FACTOR = 2.0
"""The most by which slow readers and files may change the 99th percentile of the other caller's
times."""

_TIMING = re.compile(rb"\r\nserver-timing: [^\r]*?wait;dur=([0-9.]+)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Sample:
    """One mesh of the measured caller: seconds in all, and seconds in the queue."""

    seconds: float
    wait: float
    status: str


def _build_net(size: int, seed: int) -> list[list[list[float]]]:
    values = random.Random(seed)
    return [[[i, j, values.random()] for j in range(size)] for i in range(size)]


def _build_mesh_request(surface: object, relative_tolerance: float) -> bytes:
    document = {"surface": surface, "relative_tolerance": relative_tolerance}
    return build_post("/v1/mesh?format=glb", json.dumps(document).encode())


def list_heavy_requests(first_seed: int) -> Iterator[bytes]:
    """Requests for different meshes, each of which takes a thread about half a second."""
    seed = first_seed
    while True:
        net = _build_net(24, seed)
        surface = {"type": "bspline", "degree": 3, "knots": "clamped", "control_net": net}
        yield _build_mesh_request(surface, 1e-3)
        seed += 1


def list_light_requests() -> Iterator[bytes]:
    """Requests for different meshes, each of which takes a thread some 30 ms."""
    seed = 0
    while True:
        yield _build_mesh_request({"control_net": _build_net(5, seed)}, 3e-4)
        seed += 1


async def send(port: int, request: bytes, source: str) -> tuple[str, bytes]:
    """The short form of the response to a request, and the first bytes of the response."""
    async with open_connection(port, source) as (reader, writer):
        writer.write(request)
        received = await reader.read(-1)
    return summarize(received, len(received)), received[:2000]


def list_teapots() -> Iterator[bytes]:
    """Requests for the teapot as GLB, which the event loop computes itself."""
    return repeat(build_get("/v1/surfaces/utah-teapot/mesh.glb?resolution=8"))


async def measure(
    ports: Sequence[int], requests: Iterator[bytes], seconds: float
) -> list[list[Sample]]:
    """Sends one request after the other, to each service in turn; the samples of each."""
    samples: list[list[Sample]] = [[] for _ in ports]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        request = next(requests)
        for port, results in zip(ports, samples, strict=True):
            start = time.monotonic()
            status, head = await send(port, request, HOST)
            match = _TIMING.search(head)
            wait = float(match[1]) / 1000 if match else 0.0
            results.append(Sample(time.monotonic() - start, wait, status))
            await asyncio.sleep(PAUSE)
    return samples


async def send_heavy_work(port: int) -> Counter[str]:
    """Sends heavy requests on `HEAVY_CONNECTIONS` connections, until it is cancelled."""
    responses: Counter[str] = Counter()

    async def send_one_by_one(number: int) -> None:
        for request in list_heavy_requests(100_000 * (number + 1)):
            status, _ = await send(port, request, TAKER)
            responses[status] += 1
            if status.startswith("429"):
                await asyncio.sleep(0.5)

    with suppress(asyncio.CancelledError):
        await asyncio.gather(*map(send_one_by_one, range(HEAVY_CONNECTIONS)))
    return responses


async def send_files(port: int) -> Counter[str]:
    """Sends four STEP files of `FILE_BYTES` at once, and again, until it is cancelled."""
    responses: Counter[str] = Counter()
    path = "/v1/estimate?format=glb&relative_tolerance=0.1"
    requests = [
        build_post(path, write_sheets(FILE_BYTES, number), media_type="model/step")
        for number in range(4)
    ]

    def send_one(request: bytes) -> str:
        """In a thread, because to send 20 MB would delay the measured caller."""
        with socket.create_connection((HOST, port), source_address=(TAKER, 0)) as connection:
            connection.sendall(request)
            received = b"".join(iter(partial(connection.recv, 1 << 16), b""))
        return summarize(received, len(received))

    async def send_again(request: bytes) -> None:
        while True:
            responses[await asyncio.to_thread(send_one, request)] += 1

    with suppress(asyncio.CancelledError):
        await asyncio.gather(*map(send_again, requests))
    return responses


async def read_slowly(port: int) -> Counter[str]:
    """Requests files of 49 MB and reads each at `SLOW_BYTES` a second, until it is cancelled."""
    responses: Counter[str] = Counter()

    async def read_one(number: int) -> None:
        request = build_get(f"/v1/surfaces/saddle/mesh.stl?resolution=700&crease_angle=0.{number}1")
        async with open_connection(port, TAKER) as (reader, writer):
            writer.write(request)
            head = await reader.readuntil(b"\r\n\r\n")
            responses[head[9:12].decode()] += 1
            while await reader.read(SLOW_BYTES // 10):
                await asyncio.sleep(0.1)

    with suppress(asyncio.CancelledError):
        await asyncio.gather(*map(read_one, range(SLOW_CONNECTIONS)), return_exceptions=True)
    return responses


def percentile(values: Sequence[float], percent: int) -> float:
    """The percentile `percent` of some numbers; of a single one, this number."""
    if len(values) < 2:
        return sum(values)
    return statistics.quantiles(values, n=100, method="inclusive")[percent - 1]


@dataclass(slots=True)
class Result:
    """The meshes of the other caller, and the responses to the caller that takes much.

    `together` are its meshes beside that caller, `alone` those of the service without others.
    """

    alone: list[Sample]
    together: list[Sample]
    responses: Counter[str]

    def compute_factor(self) -> float:
        """The 99th percentile of the times beside the other caller, divided by that alone."""
        times = ([s.seconds for s in samples] for samples in (self.together, self.alone))
        together, alone = (percentile(values, 99) for values in times)
        return together / alone

    def find_failures(self) -> list[str]:
        """Responses to the measured caller that are no mesh."""
        statuses = {sample.status for sample in self.alone + self.together} - {"200"}
        few = ["too few meshes"] if min(len(self.alone), len(self.together)) < 10 else []
        return [*few, *(f"client: {status}" for status in sorted(statuses))]

    def format(self) -> str:
        """The middle cells of a row of the table."""
        cells = []
        for samples in (self.alone, self.together):
            times = [sample.seconds for sample in samples]
            numbers = (percentile(times, 50), percentile(times, 99), max(times))
            cells.append(" / ".join(f"{each * 1e3:.0f}" for each in numbers))
        wait = max(sample.wait for sample in self.together)
        counts = ", ".join(f"{count} × {text}" for text, count in self.responses.most_common())
        return (
            f"{cells[0]} ms | {cells[1]} ms of {len(self.together)} | "
            f"{wait * 1e3:.0f} ms | {counts}"
        )


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A caller that takes much, and how its effect on another is judged."""

    name: str
    take: Callable[[int], Awaitable[Counter[str]]]
    judge: Callable[[Result], list[str]]
    list_requests: Callable[[], Iterator[bytes]] = list_light_requests
    settings: Mapping[str, str] = field(default_factory=dict)

    async def run(self, port: int, quiet_port: int) -> Result:
        """Measures another caller beside this one, and at a service without other clients."""
        requests = self.list_requests()
        await measure((port, quiet_port), requests, 1)  # fills caches
        task = asyncio.ensure_future(self.take(port))
        await asyncio.sleep(START_SECONDS)
        together, alone = await measure((port, quiet_port), requests, SECONDS)
        task.cancel()
        return Result(alone, together, await task)


def judge_wait(result: Result) -> list[str]:
    """A fault if a mesh waited longer than `MAX_WAIT`."""
    longest = max(sample.wait for sample in result.together)
    return [f"waited {longest:.1f} s"] if longest > MAX_WAIT else []


def judge_factor(result: Result) -> list[str]:
    """A fault if the 99th percentile changed by more than `MAX_FACTOR`."""
    factor = result.compute_factor()
    return [f"p99 × {factor:.1f}"] if factor > MAX_FACTOR else []


NEIGHBOURS = (
    Neighbour("twenty connections of heavy work from one caller", send_heavy_work, judge_wait),
    Neighbour("ten readers at 50 kB/s each", read_slowly, judge_factor),
    Neighbour(
        "four STEP files of 20 MB, read at once",
        send_files,
        judge_factor,
        list_teapots,
        {"SURFACE_MEMORY_BYTES": "2400000000"},
    ),
)


def run_neighbours(folder: Path, select: Callable[[str], bool]) -> list[str]:
    """Runs the selected ones, each with a service of its own; prints a table.

    Returns the faults.
    """
    faults: list[str] = []
    rows: list[str] = []
    for neighbour in NEIGHBOURS:
        if not select(neighbour.name):
            continue
        with (
            service_server(folder, {**SETTINGS, **neighbour.settings}, "neighbours") as service,
            service_server(folder, {**SETTINGS, **neighbour.settings}, "quiet") as quiet_service,
        ):
            result = asyncio.run(neighbour.run(service.port, quiet_service.port))
        print(f"  {neighbour.name}: {dict(result.responses)}", file=sys.stderr, flush=True)
        found = result.find_failures()
        found += neighbour.judge(result)
        rows.append(f"| {neighbour.name} | {result.format()} | {', '.join(found) or 'ok'} |")
        faults += [f"{neighbour.name}: {text}" for text in found]
    if rows:
        head = "neighbour | alone: p50 / p99 / max | beside it | longest wait | it got | faults"
        print(f"\n| {head} |")
        print("| --- | --- | --- | --- | --- | --- |")
        print("\n".join(rows))
    return faults
