"""How fast one and two job processes, and one and two Dask workers, compute the parts of a job.

    python -m tools.benchmarks.jobs [--parts 4000] [--rounds 3]

A part is a bicubic B-spline of 8 × 8 control points as GLB at resolution 16, in batches of about a
second; files go to a folder. All engines run before the first round, and then in turn, so that
other load of the machine slows all of them. With two idle processors, two job processes must make
at least 1.6 times the parts a second of one, and two Dask workers 1.6 times the parts of one; two
Dask workers may take at most 1.2 times the time of two job processes. Otherwise the exit status
is 1.
"""

import argparse
import asyncio
import sys
import tempfile
import time
from collections import Counter
from contextlib import AsyncExitStack
from pathlib import Path
from statistics import median

from service.jobs.batch import SUCCEEDED
from service.jobs.dask_engine import open_dask
from service.jobs.engine import Engine
from service.jobs.pool import ProcessEngine
from service.settings.runtime import half_of_memory
from service.storage.address import open_store
from tools.cluster import make_certificates, run_cluster, use_certificates
from tools.job_parts import make_parts, make_tasks, run_tasks, wait_for_slots

BATCH_SECONDS, PART_SECONDS = 1.0, 0.0025
"""The time of a batch, and that of a part on one processor."""

SPEEDUP, MAX_RATIO = 1.6, 1.2
"""Least parts a second of two, as a multiple of one; most time of Dask, of that of processes."""

ENGINES = ("1 process", "2 processes", "1 Dask worker", "2 Dask workers")


async def measure(parts: int, rounds: int, folder: Path) -> dict[str, float]:
    """The median seconds of each engine for all parts."""
    lines = make_parts(parts)
    size = round(BATCH_SECONDS / PART_SECONDS)
    times: dict[str, list[float]] = {name: [] for name in ENGINES}
    certificates = make_certificates(folder)
    use_certificates(certificates)
    async with AsyncExitStack() as stack:
        engines: dict[str, Engine] = {}
        for name in ENGINES:
            count = int(name[0])
            engine: Engine = ProcessEngine(count, half_of_memory() // 2)
            if "Dask" in name:
                cluster = run_cluster(folder / f"cluster-{count}", count, certificates)
                engine = open_dask(stack.enter_context(cluster).address, name)
                await wait_for_slots(engine, 2 * count, make_store(folder))
            stack.push_async_callback(engine.close)
            engines[name] = engine
        for number in range(rounds):
            for name, engine in engines.items():
                # Idle processes may have ended, and a new one first imports all modules.
                await run_tasks(engine, make_tasks(lines[:40], 10, make_store(folder)))
                tasks = make_tasks(lines, size, make_store(folder))
                start = time.monotonic()
                records = await run_tasks(engine, tasks)
                seconds = time.monotonic() - start
                states = Counter(record["state"] for record in records)
                if states != {SUCCEEDED: parts}:
                    raise RuntimeError(f"{name}: {states}")
                times[name].append(seconds)
                print(
                    f"  round {number + 1}: {name:<14} {parts / seconds:6.0f} parts/s", flush=True
                )
    return {name: median(each) for name, each in times.items()}


def make_store(folder: Path) -> Path:
    """A new store in a folder of `folder`."""
    store = Path(tempfile.mkdtemp(dir=folder))
    open_store(str(store), 0)
    return store


def main() -> int:
    """Prints the table; returns 0 if all ratios are within their limits."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--parts", type=int, default=4000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        seconds = asyncio.run(measure(options.parts, options.rounds, Path(folder)))
    one, two, one_dask, two_dask = (seconds[name] for name in ENGINES)
    for name in ENGINES:
        print(f"{name:<14} {options.parts / seconds[name]:6.0f} parts/s")
    ratios = {
        "two processes ÷ one, parts/s": (one / two, one / two >= SPEEDUP),
        "two Dask workers ÷ one, parts/s": (one_dask / two_dask, one_dask / two_dask >= SPEEDUP),
        "two Dask workers ÷ two processes, time": (two_dask / two, two_dask / two <= MAX_RATIO),
    }
    for name, (ratio, passes) in ratios.items():
        print(f"{' ' if passes else '✗'} {name:<40} {ratio:.2f}")
    return 0 if all(passes for _, passes in ratios.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
