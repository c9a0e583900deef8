"""Kills processes of a Dask cluster with SIGKILL in the middle of work, and compares all results.

    python -m tools.cluster_faults [--parts 3000]

A scheduler and two workers run as commands that are always started again. The same parts are
computed without a fault, and then with each fault, each time in a new store. Every part must have a
result, with the bytes of the run without a fault. Prints a line for each run; the exit status is 1
if a result is missing or differs.
"""

import argparse
import asyncio
import sys
import tempfile
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

from service.jobs.dask_engine import DaskEngine, open_dask
from service.storage.address import open_store
from tools.cluster import Cluster, make_certificates, run_cluster, use_certificates
from tools.job_parts import make_parts, make_tasks, run_tasks, wait_for_slots

WORKERS, BATCH = 2, 200
"""The number of workers; and of parts in a batch, half a second of work."""

Fault = Callable[[Cluster], object]


FAULTS: dict[str, Fault | None] = {
    "no fault": None,
    "kill -9 of a worker": lambda cluster: cluster.kill_worker(0),
    "kill -9 of both workers": lambda cluster: [cluster.kill_worker(0), cluster.kill_worker(1)],
    "kill -9 of the command of a worker": lambda cluster: cluster.workers[0].kill(),
    "kill -9 of the scheduler": lambda cluster: cluster.scheduler.kill(),
    "kill -9 of all": lambda cluster: [
        cluster.kill_worker(0), cluster.kill_worker(1), cluster.scheduler.kill(),
    ],
}  # fmt: skip


def hash_files(store: Path) -> dict[str, str]:
    """The hash of the file of each part, by the id of the part."""
    return {
        path.name: sha256(path.read_bytes()).hexdigest() for path in (store / "parts").glob("*/*")
    }


async def inflict(fault: Fault, cluster: Cluster, store: Path, files: int) -> int:
    """Makes a fault once the store has this number of files; returns how many it had then."""
    while (found := sum(1 for _ in (store / "parts").glob("*/*"))) < files:
        await asyncio.sleep(0.05)
    await asyncio.to_thread(fault, cluster)
    return found


async def run_once(
    engine: DaskEngine, cluster: Cluster, folder: Path, parts: int, fault: Fault | None
) -> tuple[dict[str, str], dict[str, str], float, int]:
    """The hashes of files and of records, the seconds, and the files at the time of the fault."""
    store = Path(tempfile.mkdtemp(dir=folder))
    open_store(str(store), 0)
    await wait_for_slots(engine, 2 * WORKERS, store)
    tasks = make_tasks(make_parts(parts), BATCH, store)
    start = time.monotonic()
    harm = asyncio.create_task(inflict(fault, cluster, store, parts // 3)) if fault else None
    records = await run_tasks(engine, tasks)
    seconds = time.monotonic() - start
    named = {record["id"]: record.get("sha256", record["state"]) for record in records}
    return hash_files(store), named, seconds, await harm if harm else 0


async def main(parts: int, folder: Path) -> int:
    """Prints the table; returns 0 if all results of all runs are equal."""
    certificates = make_certificates(folder)
    use_certificates(certificates)
    expected: tuple[dict[str, str], dict[str, str]] | None = None
    is_good = True
    with run_cluster(folder, WORKERS, certificates) as cluster:
        engine = open_dask(cluster.address, "the cluster")
        for name, fault in FAULTS.items():
            files, records, seconds, found = await run_once(engine, cluster, folder, parts, fault)
            expected = expected or (files, records)
            is_equal = (files, records) == expected and len(files) == parts
            is_good &= is_equal
            mark = " " if is_equal else "✗"
            text = f"{len(files)} of {parts} parts in {seconds:.1f} s"
            print(f"{mark} {name:<36} {text}; at the fault {found}", flush=True)
        await engine.close()
    return 0 if is_good else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--parts", type=int, default=3000)
    with tempfile.TemporaryDirectory() as root:
        sys.exit(asyncio.run(main(parser.parse_args().parts, Path(root))))
