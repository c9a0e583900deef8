"""Measures the time and the memory in which the service refuses hostile bodies.

Each body is sent to an application in a process of its own, in the pieces in which a server would
receive it. Memory is the growth of that process up to its peak, with the bytes of the body that the
application read.
"""

import gc
import time
from collections.abc import Callable
from functools import partial
from multiprocessing import get_context
from typing import NamedTuple

from service.api.app import create_app
from service.settings.values import Settings
from tools.client import start_client
from tools.hostile.calls import CALLS
from tools.hostile.files import FILES
from tools.hostile.requests import split_body
from tools.processes import peak_memory, reset_peak, resident_memory

MAX_SECONDS = 0.2
MAX_BYTES = 50e6

HOSTILE = CALLS["/v1/mesh"]

_JSON = {"Content-Type": "application/json"}


class Cost(NamedTuple):
    """The time in seconds and the peak memory in bytes of one refusal."""

    name: str
    seconds: float
    peak: float


def measure_costs() -> list[Cost]:
    """The costs of all hostile bodies, each measured in a new process; the slowest is first."""
    context = get_context("forkserver")
    context.set_forkserver_preload(["tools.benchmarks.hostile"])  # imported once
    with context.Pool(1, maxtasksperchild=1) as pool:
        costs = pool.map(_measure_cost, range(len(HOSTILE) + len(FILES)), chunksize=1)
    return sorted(costs, key=lambda cost: -cost.seconds)


def run() -> bool:
    """Prints the ten slowest bodies; returns whether time and memory are within the limits."""
    rows = measure_costs()
    slowest, largest = rows[0], max(rows, key=lambda cost: cost.peak)
    print(f"{len(rows)} hostile bodies; the slowest ten:")
    for cost in rows[:10]:
        print(f"  {cost.seconds * 1e3:7.1f} ms  {cost.peak / 1e6:6.1f} MB  {cost.name}")
    print(f"slowest {slowest.seconds * 1e3:.0f} ms (allowed {MAX_SECONDS * 1e3:.0f}), ", end="")
    print(f"largest {largest.peak / 1e6:.0f} MB (allowed {MAX_BYTES / 1e6:.0f}): {largest.name}")
    return slowest.seconds <= MAX_SECONDS and largest.peak <= MAX_BYTES


def _measure_cost(index: int) -> Cost:
    """The cost of one body: the shortest of three times, and the peak memory of the first."""
    with start_client(create_app(Settings())) as client:
        for case in HOSTILE[:3]:  # the first requests of a process take longer
            client.request("POST", "/v1/mesh", case.chunks(), _JSON)
        if index < len(HOSTILE):
            name, chunks = HOSTILE[index].name, list(HOSTILE[index].chunks())
            send_body = partial(client.request, "POST", "/v1/mesh", chunks, _JSON)
        else:
            file = FILES[index - len(HOSTILE)]
            name, chunks = file.name, list(split_body(file.build()))
            headers = {"Content-Type": file.media_type}
            send_body = partial(client.request, "POST", f"/v1/mesh?{file.query}", chunks, headers)
        gc.collect()
        reset_peak()
        bytes_before = resident_memory()
        seconds = [_measure_time(send_body)]
        peak = peak_memory() - bytes_before
        seconds += [_measure_time(send_body) for _ in range(2)]
    return Cost(name, min(seconds), peak)


def _measure_time(send_body: Callable[[], object]) -> float:
    start = time.perf_counter()
    send_body()
    return time.perf_counter() - start
