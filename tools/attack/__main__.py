"""Attacks a running service and prints a table of the results: `make test-attack`.

The service runs in a process of its own, with a small memory budget and a small quota; its other
settings are the defaults. The attacks run one after the other, and at the end the worst of them at
once. Meanwhile a well-behaved client sends small requests and compares every byte of the responses.
Attacks that only HAProxy can withstand run first, through the HAProxy of `deploy/`. The attackers
send only a few requests at a time, and after the first attacks they have a low priority, because
they share two processors with the service and the client: the program tests limits, not bandwidth.

The program fails if the service used more memory than allowed, if the client waited too long or got
a wrong response, or if an attack got a response that is not documented. It also fails if, after the
attacks, the service does not respond, uses too much memory or too many open files, or still reports
reserved memory or busy threads in its metrics. A second table has callers that take much, and what
another caller notices (`neighbours`); they run alone, with a service of their own.
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
from tools.attack.neighbours import run_neighbours
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

MAX_RESIDENT = BUDGET + 250e6
"""The largest number of bytes that the process may use during attacks: its budget, and 250 MB for
Python, NumPy and the server."""

MAX_LATENCY, MAX_LATENCY_JSON = 0.1, 0.3
"""The largest 99th percentiles of the client's latencies in seconds: in general, and during an
attack that sends the largest JSON."""

MAX_LEFTOVER = 275e6
"""The largest number of bytes that the process may use after all attacks, with its caches."""

MAX_NEW_FILES = 4
"""The largest number of files that may be open after the attacks beyond those before them."""

QUIET_SECONDS = 2.0
"""Seconds before the first attack, in which the latencies of the client are measured."""

FOLDER = ROOT / "build" / "attack"

SLOW_ATTACKS = (SLOW_HEADS, SLOW_BODIES, HALF_BODIES)
"""Slow attacks, which run for a long time, at once with others."""

ATTACKS_BEFORE = BODIES
ATTACKS_MEANWHILE = (*HEADS, *CONNECTIONS)
ATTACKS_AFTER = (*WORK, WORST)
"""Attacks that run before, during and after `SLOW_ATTACKS`. Attacks with large bodies do not run
during these, because the slow attacks take the memory for bodies."""


@dataclass(frozen=True, slots=True)
class ClientResult:
    """The result of one request of the well-behaved client; `outcome` is `ok` or the fault."""

    time: float
    kind: str
    seconds: float
    outcome: str


@dataclass(slots=True)
class Row:
    """The result of one attack; times in seconds.

    `resident` is the peak memory of the service in bytes. `results` are those of the well-behaved
    client during the attack; `assign_results` sets them.
    """

    attack: Attack
    responses: Counter[str]
    start: float
    end: float
    resident: int
    results: list[ClientResult] = field(default_factory=list)

    def find_faults(self) -> list[str]:
        """The faults of the service during the attack."""
        faults = self.attack.find_faults(self.responses)
        faults += [f"client: {text}" for text in sorted({r.outcome for r in self.results} - {"ok"})]
        if self.resident > MAX_RESIDENT:
            faults.append("memory")
        if not self.results:
            faults.append("no client")  # no request ended during the attack
        elif compute_percentile(self.results, 99) > (
            MAX_LATENCY_JSON if self.attack.sends_largest_json else MAX_LATENCY
        ):
            faults.append("p99")
        return faults

    def format(self) -> str:
        """A row of the table in Markdown."""
        responses = ", ".join(f"{count} × {text}" for text, count in self.responses.most_common())
        p50, p99 = (compute_percentile(self.results, percent) * 1e3 for percent in (50, 99))
        return (
            f"| {self.attack.name} | {self.end - self.start:.0f} s | {responses} | "
            f"{self.resident / 1e6:.0f} MB | {p50:.1f} / {p99:.1f} ms of {len(self.results)} | "
            f"{', '.join(self.find_faults()) or 'ok'} |"
        )


def compute_percentile(results: list[ClientResult], percent: int) -> float:
    """The percentile `percent` of the latencies in seconds; 0 without results."""
    if len(results) < 2:
        return sum(result.seconds for result in results)
    latencies = [result.seconds for result in results]
    return statistics.quantiles(latencies, n=100, method="inclusive")[percent - 1]


async def run_attacks(
    service: Server,
    port: int,
    attacks_before: Sequence[Attack],
    *,
    slow_attacks: Sequence[Attack] = (),
    attacks_meanwhile: Sequence[Attack] = (),
    attacks_after: Sequence[Attack] = (),
) -> list[Row]:
    """Runs all attacks; returns the rows of the table.

    The slow attacks run all at once, and at the same time `attacks_meanwhile`, one after the other.
    The other attacks run one after the other, before and after these.
    """
    rows: list[Row] = []

    async def run_attack(attack: Attack) -> None:
        reset_peak(service.pid)
        start = time.monotonic()
        responses = await attack.run(port)
        rows.append(Row(attack, responses, start, time.monotonic(), peak_memory(service.pid)))
        print(f"  {attack.name}: {dict(responses)}", file=sys.stderr, flush=True)

    async def run_one_by_one(attacks: Iterable[Attack]) -> None:
        for attack in attacks:
            await run_attack(attack)
            await asyncio.sleep(0.3)

    await run_one_by_one(attacks_before)
    await asyncio.gather(*map(run_attack, slow_attacks), run_one_by_one(attacks_meanwhile))
    await run_one_by_one(attacks_after)
    return rows


@contextmanager
def run_client(port: int) -> Iterator[list[ClientResult]]:
    """Runs the well-behaved client during the block; the list has its results after the block."""
    command = [sys.executable, "-m", "tools.attack.client", str(port)]
    results: list[ClientResult] = []
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, cwd=ROOT, stdout=output)
        try:
            time.sleep(QUIET_SECONDS + 1)  # the client starts in about 1 s
            yield results
        finally:
            process.terminate()
            process.wait()
        output.seek(0)
        for line in output:
            moment, kind, seconds, outcome = line.rstrip("\n").split(" ", 3)
            results.append(ClientResult(float(moment), kind, float(seconds), outcome))


def find_leftovers(service: Server, files: int) -> list[str]:
    """Memory, open files and gauges that are too high after the attacks, and stay so for 30 s.

    `files` is the number of open files before the attacks; `MAX_NEW_FILES` more are allowed.
    """
    problems: list[str] = []
    for _ in range(60):
        time.sleep(0.5)
        problems = []
        if resident_memory(service.pid) > MAX_LEFTOVER:
            problems.append(f"{resident_memory(service.pid) / 1e6:.0f} MB of memory")
        if service.open_files() > files + MAX_NEW_FILES:
            problems.append(f"{service.open_files()} open files, {files} before")
        problems += find_nonzero_gauges(service)
        if not problems:
            break
    return problems


GAUGES = ("surface_queue_length{", "surface_threads_busy{", "surface_memory_bytes{")
"""Gauges that must be 0 after the attacks."""


def find_nonzero_gauges(service: Server) -> list[str]:
    """The gauges of `GAUGES` that are above 0 in the metrics of the service."""
    response = httpx.get(f"{service.url}/metrics")
    if response.status_code != 200:
        return ["no /metrics"]
    nonzero = []
    for line in response.text.splitlines():
        name, _, value = line.rpartition(" ")
        if name.startswith(GAUGES) and float(value) > 0:
            nonzero.append(f"{name} {value}")
    return nonzero


def main(words: list[str]) -> bool:
    """Runs all attacks, or those whose name contains one of these words.

    Returns whether the service withstood them.
    """

    def select(attacks: Sequence[Attack]) -> list[Attack]:
        return [each for each in attacks if not words or any(word in each.name for word in words)]

    shutil.rmtree(FOLDER, ignore_errors=True)
    settings = {
        "SURFACE_STORE": str(FOLDER / "store"),
        "SURFACE_STORE_QUOTA": "4MiB",
        "SURFACE_MEMORY_BYTES": str(BUDGET),
    }
    proxied_rows: list[Row] = []
    with service_server(FOLDER, settings) as service:
        if select(PROXIED):
            with (
                # The configuration of HAProxy has two services; here both are the same.
                Proxy(FOLDER, first_port=service.port, second_port=service.port) as proxy,
                run_client(proxy.port) as proxied_results,
            ):
                proxied_rows = asyncio.run(run_attacks(service, proxy.port, select(PROXIED)))
            assign_results(proxied_rows, proxied_results)
        with run_client(service.port) as results:
            # The service and the client have started, so only the attacks get the low priority.
            os.nice(10)
            files, begin = service.open_files(), time.monotonic()
            attacks = run_attacks(
                service,
                service.port,
                select(ATTACKS_BEFORE),
                slow_attacks=select(SLOW_ATTACKS),
                attacks_meanwhile=select(ATTACKS_MEANWHILE),
                attacks_after=select(ATTACKS_AFTER),
            )
            rows_without_proxy = asyncio.run(attacks)
            end = time.monotonic()
        assign_results(rows_without_proxy, results)
        leftovers = find_leftovers(service, files)
        traceback_count = service.log.read_text(encoding="utf-8").count("Traceback")
    quiet_results = [result for result in results if result.time < begin]
    rows = proxied_rows + rows_without_proxy
    is_good = not rows or print_report(rows, quiet_results, leftovers, traceback_count, end - begin)
    faults = run_neighbours(FOLDER, lambda name: not words or any(word in name for word in words))
    print("\n".join(f"- {text}" for text in faults))
    return is_good and not faults


def assign_results(rows: list[Row], results: list[ClientResult]) -> None:
    """Gives each row the results of the client during its attack."""
    for row in rows:
        row.results = [result for result in results if row.start <= result.time <= row.end]


def print_report(
    rows: list[Row],
    quiet_results: list[ClientResult],
    leftovers: list[str],
    traceback_count: int,
    seconds: float,
) -> bool:
    """Prints the table and the faults; returns whether there are no faults.

    `quiet_results` are the results of the client before the first attack.
    """
    p50, p99 = (compute_percentile(quiet_results, percent) * 1e3 for percent in (50, 99))
    print("| attack | duration | responses | peak memory | client p50 / p99 | faults |")
    print("| --- | --- | --- | --- | --- | --- |")
    print(f"| nothing | | | | {p50:.1f} / {p99:.1f} ms of {len(quiet_results)} | |")
    for row in rows:
        print(row.format())
    faults = [f"{row.attack.name}: {text}" for row in rows for text in row.find_faults()]
    faults += [f"after the attacks: {text}" for text in leftovers]
    faults += [f"{traceback_count} exceptions in the log"] if traceback_count else []
    results = [result for row in rows for result in row.results]
    slowest_results = sorted(results, key=lambda result: -result.seconds)[:5]
    print(f"\n{seconds:.0f} s; slowest requests of the client:", end=" ")
    print(", ".join(f"{each.seconds * 1e3:.0f} ms {each.kind}" for each in slowest_results))
    for kind in sorted({result.kind for result in quiet_results}):
        results_of_kind = [result for result in results if result.kind == kind]
        p50, p99 = (compute_percentile(results_of_kind, percent) * 1e3 for percent in (50, 99))
        print(f"  {kind}: {p50:.1f} / {p99:.1f} ms of {len(results_of_kind)}")
    print(f"{len(faults)} faults" + "".join(f"\n- {text}" for text in faults))
    return not faults


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1:]) else 1)
