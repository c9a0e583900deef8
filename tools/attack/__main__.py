"""The attack table: `make test-attack`.

It attacks a service in a process of its own, with default settings, but with a small memory budget
and a small quota. The attacks run one after the other, and at the end the worst of them together.
Meanwhile a well-behaved client sends small requests and compares every byte of the responses.
Attacks that only HAProxy can withstand go through the HAProxy of `deploy/`. Attackers have a low
priority and send only a few requests at a time, because they share two processors with the service
and the client: the test looks for limits, not for bandwidth.

It fails if the service held more memory than allowed, if the client waited too long or got a wrong
response, or if an attack got a response that is not documented. It also fails if the attacks leave
something behind: memory, open files, held memory or threads in the metrics, or a service that does
not respond.
"""

import asyncio
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import httpx

from tools.attack.bodies import BODIES
from tools.attack.connections import CONNECTIONS, HALF_BODIES, PROXIED, SLOW_BODIES, WORST
from tools.attack.heads import HEADS, SLOW_HEADS
from tools.attack.wire import Attack
from tools.attack.work import WORK
from tools.processes import (
    ROOT,
    Proxy,
    Server,
    peak_memory,
    reset_peak,
    resident_memory,
    service_server,
)

BUDGET = 400_000_000
"""`SURFACE_MEMORY_BYTES` of the attacked service."""

MOST_RESIDENT = BUDGET + 250e6
"""The most bytes that the process may hold: its budget, and 250 MB for Python, NumPy and the
server."""

SLOWEST, SLOWEST_JSON = 0.1, 0.3
"""Limits of the client's 99th percentile in seconds: in general, and during an attack that sends
the largest JSON."""

LEFT = 250e6
"""The most bytes that the process may hold after all attacks, cached responses included."""

QUIET = 2.0
"""Seconds before the first attack, in which the client is measured for comparison."""

FOLDER = ROOT / "build" / "attack"

LASTING = (SLOW_HEADS, SLOW_BODIES, HALF_BODIES)
FIRST, BESIDE, LAST = (BODIES, (*HEADS, *CONNECTIONS), (*WORK, WORST))
"""Attacks before the lasting ones, during these, and after these; the lasting attacks take the
memory for bodies."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Result of one request of the well-behaved client."""

    time: float
    kind: str
    seconds: float
    what: str


@dataclass(slots=True)
class Row:
    """Result of one attack."""

    attack: Attack
    answers: Counter[str]
    start: float
    end: float
    resident: int
    seen: list[Seen] = field(default_factory=list)

    def wrong(self) -> list[str]:
        """Faults of the service that the attack showed."""
        faults = self.attack.wrong(self.answers)
        faults += [f"client: {what}" for what in sorted({s.what for s in self.seen} - {"ok"})]
        if self.resident > MOST_RESIDENT:
            faults.append("memory")
        if not self.seen:
            faults.append("no client")  # it waited during the whole attack, or has ended
        elif compute_percentile(self.seen, 99) > (SLOWEST_JSON if self.attack.parses else SLOWEST):
            faults.append("p99")
        return faults

    def line(self) -> str:
        """A line of the table."""
        answers = ", ".join(f"{count} × {what}" for what, count in self.answers.most_common())
        half, most = (compute_percentile(self.seen, part) * 1e3 for part in (50, 99))
        return (
            f"| {self.attack.name} | {self.end - self.start:.0f} s | {answers} | "
            f"{self.resident / 1e6:.0f} MB | {half:.1f} / {most:.1f} ms of {len(self.seen)} | "
            f"{', '.join(self.wrong()) or 'ok'} |"
        )


def compute_percentile(seen: list[Seen], part: int) -> float:
    """A percentile of the latencies of requests, in seconds; 0 without requests."""
    if len(seen) < 2:
        return sum(s.seconds for s in seen)
    return statistics.quantiles((s.seconds for s in seen), n=100, method="inclusive")[part - 1]


async def run_attacks(
    service: Server,
    port: int,
    first: Sequence[Attack],
    *,
    lasting: Sequence[Attack] = (),
    beside: Sequence[Attack] = (),
    last: Sequence[Attack] = (),
) -> list[Row]:
    """Runs the attacks `first`, then `lasting` together with `beside`, then `last`; returns their
    rows."""
    rows: list[Row] = []

    async def run_attack(attack: Attack) -> None:
        reset_peak(service.pid)
        start = time.monotonic()
        answers = await attack.run(port)
        rows.append(Row(attack, answers, start, time.monotonic(), peak_memory(service.pid)))
        print(f"  {attack.name}: {dict(answers)}", file=sys.stderr, flush=True)

    async def run_in_turn(attacks: Iterable[Attack]) -> None:
        for attack in attacks:
            await run_attack(attack)
            await asyncio.sleep(0.3)

    await run_in_turn(first)
    await asyncio.gather(*map(run_attack, lasting), run_in_turn(beside))
    await run_in_turn(last)
    return rows


@contextmanager
def client(port: int) -> Iterator[list[Seen]]:
    """Results of a well-behaved client at a port: a list that is complete after the block."""
    command = [sys.executable, "-m", "tools.attack.client", str(port)]
    seen: list[Seen] = []
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, cwd=ROOT, stdout=output)
        try:
            time.sleep(QUIET + 1)
            yield seen
        finally:
            process.terminate()
            process.wait()
        output.seek(0)
        for line in output:
            moment, kind, seconds, what = line.rstrip("\n").split(" ", 3)
            seen.append(Seen(float(moment), kind, float(seconds), what))


def find_leftovers(service: Server, files: int) -> list[str]:
    """Leftovers some seconds after the last attack."""
    problems: list[str] = []
    for _ in range(60):
        time.sleep(0.5)
        problems = []
        if resident_memory(service.pid) > LEFT:
            problems.append(f"{resident_memory(service.pid) / 1e6:.0f} MB of memory")
        if service.open_files() > files + 4:
            problems.append(f"{service.open_files()} open files, {files} before")
        problems += find_held_resources(service)
        if not problems:
            break
    return problems


GAUGES = ("surface_queue_length{", "surface_threads_busy{", "surface_memory_bytes{")
"""Gauges that must be 0 after the attacks."""


def find_held_resources(service: Server) -> list[str]:
    """Memory and threads that the service's metrics still report as held."""
    response = httpx.get(f"{service.url}/metrics")
    if response.status_code != 200:
        return ["no /metrics"]
    held = []
    for line in response.text.splitlines():
        name, _, value = line.rpartition(" ")
        if name.startswith(GAUGES) and float(value) > 0:
            held.append(f"{name} {value}")
    return held


def main(chosen: list[str]) -> bool:
    """Whether the service withstood all attacks."""

    def select(attacks: Sequence[Attack]) -> list[Attack]:
        return [each for each in attacks if not chosen or any(word in each.name for word in chosen)]

    shutil.rmtree(FOLDER, ignore_errors=True)
    settings = {
        "SURFACE_STORE": str(FOLDER / "store"),
        "SURFACE_STORE_QUOTA": "4MiB",
        "SURFACE_MEMORY_BYTES": str(BUDGET),
    }
    rows: list[Row] = []
    with service_server(FOLDER, settings) as service:
        if select(PROXIED):
            with Proxy(FOLDER, service.port, service.port) as proxy, client(proxy.port) as seen:
                rows += asyncio.run(run_attacks(service, proxy.port, select(PROXIED)))
            assign(rows, seen)
        with client(service.port) as seen:
            os.nice(10)  # the attacks get only idle processor time
            files, begin = service.open_files(), time.monotonic()
            rest = {"lasting": select(LASTING), "beside": select(BESIDE), "last": select(LAST)}
            direct = asyncio.run(run_attacks(service, service.port, select(FIRST), **rest))
            end = time.monotonic()
        assign(direct, seen)
        left = find_leftovers(service, files)
        traces = service.log.read_text(encoding="utf-8").count("Traceback")
    before = [s for s in seen if s.time < begin]
    return report(rows + direct, before, left, traces, end - begin)


def assign(rows: list[Row], seen: list[Seen]) -> None:
    """Gives each row the client's requests during its attack."""
    for row in rows:
        row.seen = [s for s in seen if row.start <= s.time <= row.end]


def report(
    rows: list[Row], before: list[Seen], left: list[str], traces: int, seconds: float
) -> bool:
    """Prints the table; returns whether the service passed."""
    half, most = (compute_percentile(before, part) * 1e3 for part in (50, 99))
    print("| attack | took | answers | most memory | client p50 / p99 | |")
    print("| --- | --- | --- | --- | --- | --- |")
    print(f"| nothing | | | | {half:.1f} / {most:.1f} ms of {len(before)} | |")
    for row in rows:
        print(row.line())
    wrong = [f"{row.attack.name}: {what}" for row in rows for what in row.wrong()]
    wrong += [f"left over: {what}" for what in left]
    wrong += [f"{traces} exceptions in the log"] if traces else []
    slow = sorted((s for row in rows for s in row.seen), key=lambda s: -s.seconds)[:5]
    print(f"\n{seconds:.0f} s; the slowest of the client:", end=" ")
    print(", ".join(f"{s.seconds * 1e3:.0f} ms {s.kind}" for s in slow))
    for kind in sorted({s.kind for s in before}):
        of_kind = [s for row in rows for s in row.seen if s.kind == kind]
        half, most = (compute_percentile(of_kind, part) * 1e3 for part in (50, 99))
        print(f"  {kind}: {half:.1f} / {most:.1f} ms of {len(of_kind)}")
    print(f"{len(wrong)} things are wrong" + "".join(f"\n- {what}" for what in wrong))
    return not wrong


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1:]) else 1)
