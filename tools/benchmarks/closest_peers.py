"""Closest points per second, compared with other libraries, each in a Python of its own.

`make bench-queries` installs the libraries; libraries that are not installed are left out. Query
points are random in the bounding box of the control points, enlarged by 1/5. All libraries run
alternately; times are CPU times. A point is wrong if a library returns no distance, or a distance
that is larger than the smallest of all libraries by more than 1e-9 of the diagonal. For Open
CASCADE, which only searches for normals, points whose closest point is on a border are not wrong.
The table has all points per second, the right points per second, and the number of wrong points.
"""

import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from typing import IO, Any, NamedTuple

import numpy as np

from service.engine.closest.project import ProjectQuery, project_on_surface
from service.surface.lowered import PatchModel

ROUNDS, SERVICE_POINTS = 5, 20_000
"""Number of rounds, and of points of the service in each."""

WORKER = Path(__file__).with_name("closest_worker.py")


class Peer(NamedTuple):
    """A library: its Python, its number of points in each round, and whether it also finds closest
    points on borders."""

    python: Path
    points: int
    borders: bool


PEERS = {
    "open_cascade": Peer(Path("build/occ/bin/python"), 400, borders=False),
    "splinepy": Peer(Path("build/splines/bin/python"), 400, borders=True),
    "geomdl": Peer(Path("build/splines/bin/python"), 20, borders=True),
}


def print_closest(title: str, model: PatchModel) -> None:
    """Prints a row for the service, and a row for each library that is installed.

    All patches of the model are polynomial and have one degree.
    """
    low, high = model.bounds
    size = high - low
    points = np.random.default_rng(1).uniform(
        low - size / 10, high + size / 10, (SERVICE_POINTS, 3)
    )
    peers = {name: peer for name, peer in PEERS.items() if peer.python.exists()}
    seconds: dict[str, list[float]] = {name: [] for name in ("service", *peers)}
    by_library: dict[str, Any] = {}
    with ExitStack() as stack:
        workers = {name: stack.enter_context(_start_worker(name, model, points)) for name in peers}
        for _ in range(ROUNDS):
            start = time.process_time()
            ours = project_on_surface(model, ProjectQuery(points))
            seconds["service"].append(time.process_time() - start)
            for name, request in workers.items():
                response = request()
                seconds[name].append(float(response["seconds"]))
                by_library[name] = response["distances"]
    by_library["service"] = ours["distances"]
    smallest = by_library["service"].copy()
    for distances in by_library.values():
        smallest[: len(distances)] = np.minimum(smallest[: len(distances)], distances)
    print(f"{title:24}{'points a second':>18}{'right a second':>18}{'wrong of':>10}")
    for name, times in seconds.items():
        count = len(by_library[name])
        is_wrong = by_library[name] > smallest[:count] + 1e-9 * model.diagonal
        if name in PEERS and not PEERS[name].borders:
            is_wrong &= ~ours["on_boundary"][:count]
        rate, faults = count / median(times), int(is_wrong.sum())
        right_rate = rate * (1 - faults / count)
        print(f"{name:24}{rate:18,.0f}{right_rate:18,.0f}{f'{faults} of {count}':>16}", flush=True)


class _Worker:
    """A process that computes the closest points of one file at each call."""

    def __init__(self, stdin: IO[str], stdout: IO[str], file: Path) -> None:
        self.stdin, self.stdout, self.file = stdin, stdout, file

    def __call__(self) -> Any:
        self.stdin.write(f"{self.file}\n")
        self.stdin.flush()
        self.stdout.readline()  # comes after the worker has written its file
        return np.load(f"{self.file}.out.npz")


@contextmanager
def _start_worker(name: str, model: PatchModel, points: Any) -> Iterator[_Worker]:
    """A process that runs this library; it ends at the end of the block."""
    peer = PEERS[name]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "points.npz"
        nets = np.concatenate([batch.points for batch in model.batches])
        np.savez(file, nets=nets, points=points[: peer.points])
        command = [str(peer.python), str(WORKER), name]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            yield _Worker(process.stdin, process.stdout, file)
            process.stdin.close()
