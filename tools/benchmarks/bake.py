"""The cost of baking many meshes: `surface bake` with one process and with two.

The parts are bicubic B-splines of 8 × 8 control points, at 16 divisions, as GLB: 236 kB each. All
that a run costs is counted, from the start of the command to its end. `tools.benchmarks.jobs`
compares the engines alone.
"""

import random
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from subprocess import Popen
from typing import NamedTuple

import orjson

from tools.processes import ROOT, list_family, own_memory

PARTS, MAX_SECONDS, MAX_MEMORY = 10_000, 60.0, 600e6
"""The parts of a run; with two processes, the most seconds, and the most bytes of memory of all
processes of the command together."""

LOOK_SECONDS = 0.1
"""Seconds between looks at the memory."""


class Run(NamedTuple):
    """A run of the command: its seconds, the processor seconds and the most bytes of all its
    processes together."""

    seconds: float
    processor: float
    memory: int


def run_command(folder: Path, processes: int) -> Run:
    """Runs `surface bake` in an empty folder, and checks that it has made all files."""
    parts_list, output = folder / "list.ndjson", folder / "output"
    with parts_list.open("wb") as file:
        file.writelines(write_lines(PARTS))
    command = [sys.executable, "-m", "service", "bake", str(parts_list), "-o", str(output)]
    start, processor = time.monotonic(), _processor_time()
    with Popen([*command, "--processes", str(processes)], cwd=ROOT) as process:
        memory = _watch_memory(process)
        seconds = time.monotonic() - start
    made = sum(path.suffix == ".glb" for path in output.iterdir())
    if process.returncode or made != PARTS:
        raise RuntimeError(f"made {made} of {PARTS} files, exit code {process.returncode}")
    return Run(seconds, _processor_time() - processor, memory)


def write_lines(count: int) -> Iterator[bytes]:
    """The lines of a list of parts, all of which are different."""
    numbers = random.Random(1)
    for part in range(count):
        net = [[[u, v, round(numbers.random(), 6)] for v in range(8)] for u in range(8)]
        surface = {"type": "bspline", "degree": 3, "control_net": net}
        body = {"surface": surface, "resolution": 16}
        yield orjson.dumps({"name": f"part-{part:06}", "body": body}) + b"\n"


def _processor_time() -> float:
    """Seconds that ended processes have computed that this one has started, and those of these."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _watch_memory(process: "Popen[bytes]") -> int:
    """The most bytes of a process and of those that it has started, until it ends."""
    most = 0
    while process.poll() is None:
        with suppress(OSError):  # a process has ended in the meantime
            most = max(most, sum(map(own_memory, list_family(process.pid))))
        time.sleep(LOOK_SECONDS)
    return most


def run() -> bool:
    """Prints a table; returns whether the run with two processes is within its limits."""
    print(f"surface bake, {PARTS:,} B-splines of 8 × 8 control points, at 16 divisions, as GLB")
    print(f"{'processes':12}{'seconds':>10}{'parts/s':>10}{'processor s':>13}{'memory MB':>11}")
    for processes in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            last = run_command(Path(folder), processes)
        rate, memory = PARTS / last.seconds, last.memory / 1e6
        print(
            f"{processes:<12}{last.seconds:10.1f}{rate:10.0f}{last.processor:13.1f}{memory:11.0f}"
        )
    return last.seconds < MAX_SECONDS and last.memory < MAX_MEMORY
