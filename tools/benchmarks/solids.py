"""Compares meshes of the 26 solids with those of Open CASCADE: a part of `make bench-occ`.

Both meshers get the same absolute tolerance, a share of the diagonal, and run alternately on one
thread; the best time counts. The time of the service is from the parsed document to the arrays of
the mesh, without normals. That of Open CASCADE is the time of `BRepMesh` alone, on its own
cylinders, cones and spheres, where only the deviation counts. `pipe` at 1e-4 is named apart, and is
not part of the geometric means there. Memory for each triangle is what tracemalloc counts while a
large mesh is built.

    python -m tools.benchmarks.solids PYTHON [solid …]

PYTHON is a Python in which cadquery-ocp is installed.
"""

import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from statistics import geometric_mean
from typing import NamedTuple, TypeAlias

import numpy as np

from oracles.solids import VALID, read_solid
from service.bases.cache import MESH_PLANS
from service.engine.accuracy import Accuracy
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.schemas.brep import BrepDefinition
from service.settings.runtime import collect_rarely, pin_blas, share_heap
from tools.building import build

TOLERANCES = {1e-2: 7, 1e-3: 5, 1e-4: 3}
"""Relative tolerances, and how often each mesh is made."""

APART = "pipe", 1e-4
"""Solid and tolerance that the means leave out."""

LARGE = "torus_cut", 1e-5
"""Solid and tolerance whose mesh is large enough to measure the memory for a triangle."""

OpenCascade: TypeAlias = Callable[[str, float], tuple[int, float]]


class Row(NamedTuple):
    """The meshes of one solid: pairs of the service and of Open CASCADE."""

    name: str
    relative: float
    triangles: tuple[int, int]
    seconds: tuple[float, float]


@contextmanager
def start_open_cascade(python: str) -> Iterator[OpenCascade]:
    """Starts the worker; yields a function of a solid and a tolerance: triangles and seconds."""
    command = [python, "-m", "tools.benchmarks.solids_worker"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as worker:
        assert worker.stdin is not None
        assert worker.stdout is not None
        worker.stdout.readline()

        def mesh(name: str, tolerance: float) -> tuple[int, float]:
            print(name, tolerance, file=worker.stdin, flush=True)
            line = worker.stdout.readline() if worker.stdout else ""
            if not line:
                raise SystemExit("the process of Open CASCADE has ended")
            triangles, seconds = line.split()
            return int(triangles), float(seconds)

        yield mesh
        worker.stdin.close()


def time_mesh(name: str, tolerance: float) -> tuple[Mesh, float]:
    """A mesh without normals, and the CPU time in seconds from the parsed document to it."""
    document = read_solid(name)
    options = MeshOptions(accuracy=Accuracy(tolerance=tolerance), normals=False)
    MESH_PLANS.clear()  # a brep that was meshed before is kept prepared
    start = time.process_time()
    model = BrepDefinition.model_validate(document).to_surface().lower()
    mesh = build(model, options)
    return mesh, time.process_time() - start


def compare(name: str, relative: float, diagonal: float, occ: OpenCascade) -> Row:
    """The comparison of both meshers for one solid."""
    tolerance = relative * diagonal
    ours, theirs = [], []
    for _ in range(TOLERANCES[relative]):
        mesh, seconds = time_mesh(name, tolerance)
        occ_triangles, occ_seconds = occ(name, tolerance)
        ours.append(seconds)
        theirs.append(occ_seconds)
    triangles = len(mesh.triangles), occ_triangles
    return Row(name, relative, triangles, (min(ours), min(theirs)))


def measure_memory(name: str, tolerance: float) -> str:
    """The memory of a mesh and of the arrays it is made from."""
    tracemalloc.start()
    mesh, _ = time_mesh(name, tolerance)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    count = len(mesh.triangles)
    return f"{name} at {LARGE[1]:g}: {count} triangles, {peak / count:.0f} bytes for each"


def write_row(row: Row) -> str:
    """A row of the table."""
    (ours, theirs), (seconds, occ_seconds) = row.triangles, row.seconds
    return (
        f"{row.name:14}{row.relative:10g}{ours:9}{theirs:9}{ours / theirs:7.2f}"
        f"{1e3 * seconds:9.1f}{1e3 * occ_seconds:9.1f}{seconds / occ_seconds:7.2f}"
    )


def write_means(rows: Sequence[Row], relative: float) -> str:
    """The geometric means of the ratios at one tolerance."""
    counted = [row for row in rows if row.relative == relative and (row.name, relative) != APART]
    if not counted:
        return ""
    triangles = geometric_mean(row.triangles[0] / row.triangles[1] for row in counted)
    seconds = geometric_mean(row.seconds[0] / row.seconds[1] for row in counted)
    return f"{'geometric mean':14}{relative:10g}{'':18}{triangles:7.2f}{'':18}{seconds:7.2f}"


def run(python: str, names: Sequence[str] = ()) -> None:
    """Prints the table, or its rows for these solids."""
    print("Solids by tolerance: the service and Open CASCADE (deviation alone); best times")
    print(
        f"{'solid':14}{'tolerance':>10}{'ours':>9}{'OCC':>9}{'ratio':>7}{'ms':>9}{'OCC':>9}"
        f"{'ratio':>7}"
    )
    rows: list[Row] = []
    diagonals = {name: measure_diagonal(name) for name in names or VALID}
    with start_open_cascade(python) as occ:
        for relative in TOLERANCES:
            for name, diagonal in diagonals.items():
                rows.append(compare(name, relative, diagonal, occ))
                print(write_row(rows[-1]), flush=True)
            print(write_means(rows, relative), flush=True)
    if LARGE[0] in diagonals:
        print(measure_memory(LARGE[0], LARGE[1] * diagonals[LARGE[0]]))


def measure_diagonal(name: str) -> float:
    """The diagonal of the box of a solid."""
    model = BrepDefinition.model_validate(read_solid(name)).to_surface().lower()
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-3), normals=False)
    return float(np.linalg.norm(np.ptp(build(model, options).positions, axis=0)))


if __name__ == "__main__":
    pin_blas()
    share_heap()
    collect_rarely()
    run(sys.argv[1], sys.argv[2:])
