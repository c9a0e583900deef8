"""Meshes by tolerance against Open CASCADE's mesher and a certified uniform grid: `make bench-occ`.

Triangles, time and kept promises at the same deflection. Open CASCADE meshes with a linear
deflection equal to the tolerance and an angular one of 0.5 rad, in a process of its own; the two
take turns. Its time is that of the mesher alone, ours that from patches to the mesh in memory. How
far each mesh truly is from its surface is found by sampling. The uniform grid is the smallest whose
own certified bound meets the tolerance.

    python -m tools.benchmarks.open_cascade PYTHON

PYTHON is one that has cadquery-ocp.
"""

import subprocess
import sys
import tempfile
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias

import numpy as np

from service.engine.adaptive.accuracy import Accuracy
from service.engine.build import build
from service.engine.deviation.bends import blocks_along, grid_bends
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.settings.process import pin_blas
from service.surface.batches import TensorPatches
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.oracles.deviation import surface_to_mesh
from tests.oracles.sheets import sheets_of
from tools.certify.surfaces import FAMILIES, MODERATE, WILD, Array, bicubic, strewn

Surface: TypeAlias = BezierSurface | BsplineSurface
Occ: TypeAlias = Callable[[Surface, float], tuple[Array, float]]

WORKER = Path(__file__).with_name("open_cascade_worker.py")
TOLERANCES = (1e-2, 1e-3, 1e-4)
ROUNDS = 3
SHAPES = (1, 1), (2, 1), (1, 2), (4, 1), (1, 4), (8, 1), (1, 8)
"""Divisions along u and v of uniform grids, up to a factor."""

HEADER = (
    f"{'surfaces':22}{'tolerance':>10}{'ours':>8}{'OCC':>8}{'ratio':>7}{'ms':>8}{'OCC':>8}"
    f"{'ratio':>7}{'found/tol':>11}{'OCC':>7}{'over':>6}{'OCC':>5}{'uniform':>9}{'ratio':>7}"
)


def works() -> dict[str, list[Surface]]:
    """What is meshed, in groups."""
    rng = np.random.default_rng(15)
    ridges = (FAMILIES["sine ridges"].surface(seed) for seed in range(6))
    spikes = (FAMILIES["spikes"].surface(seed) for seed in range(6))
    return {
        "bicubic, moderate": [BezierSurface(bicubic(seed, MODERATE)) for seed in range(12)],
        "bicubic, wild": [BezierSurface(bicubic(100 + seed, WILD)) for seed in range(12)],
        "degree 15": [BezierSurface(strewn(rng, 16, 16, 0.02, 0.3)) for _ in range(4)],
        "spikes": [s for s in spikes if isinstance(s, BsplineSurface)],
        "sine ridges": [s for s in ridges if isinstance(s, BsplineSurface)],
    }


@dataclass(frozen=True)
class Line:
    """One surface at one tolerance: ours, theirs; `found` in parts of the tolerance."""

    triangles: tuple[int, int]
    seconds: tuple[float, float]
    found: tuple[float, float]
    uniform: int


@contextmanager
def open_cascade(python: str) -> Iterator[Occ]:
    """A function that meshes with Open CASCADE: corners (T, 3, 3) and seconds."""
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(
            [python, WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as worker,
    ):
        assert worker.stdin is not None
        assert worker.stdout is not None
        name = f"{folder}/surface.npz"

        def mesh(surface: Surface, deflection: float) -> tuple[Array, float]:
            arrays: Any = stated(surface)
            np.savez(name, deflection=deflection, **arrays)
            print(name, file=worker.stdin, flush=True)
            if worker.stdout is None or not worker.stdout.readline():
                raise SystemExit("Open CASCADE has ended")
            answer = np.load(f"{name}.out.npz")
            return answer["corners"], float(answer["seconds"])

        yield mesh
        worker.stdin.close()


def stated(surface: Surface) -> dict[str, Array]:
    """The arrays that the worker reads."""
    if isinstance(surface, BezierSurface):
        return {"net": surface.control_net}
    found = {"net": surface.control_net, "degree": np.array(surface.degree)}
    for axis, knots in zip("uv", surface.knot_vectors, strict=True):
        found[f"knots_{axis}"], found[f"times_{axis}"] = np.unique(knots, return_counts=True)
    return found


def ours(model: PatchModel, tolerance: float) -> tuple[Mesh, float]:
    """A mesh of bare positions, and seconds of CPU time."""
    options = MeshOptions(accuracy=Accuracy(tolerance=tolerance), normals=False)
    start = time.process_time()
    mesh = build(model, options, single=False)
    return mesh, time.process_time() - start


def uniform(model: PatchModel, tolerance: float) -> int:
    """Triangles of the smallest uniform grid whose certified bound meets the tolerance.

    As many divisions along u as along v, or twice, four times, eight times as many.
    """
    (batch,) = model.batches
    assert isinstance(batch, TensorPatches)
    p, q = batch.degree

    def misses(times: int, shape: tuple[int, int]) -> bool:
        u, v = times * shape[0], times * shape[1]
        bends = grid_bends(batch, (u, v), (blocks_along(u, p), blocks_along(v, q)))
        return float(bends.deviations(1 / u, 1 / v).max()) > tolerance

    def least(shape: tuple[int, int]) -> int:
        high = 1
        while misses(high, shape):
            high *= 2
        # The bound is met from some number of divisions on.
        times = range(high // 2 + 1, high)
        return times.start + bisect_left(times, True, key=lambda n: not misses(n, shape))

    return min(2 * least(shape) ** 2 * shape[0] * shape[1] * batch.count for shape in SHAPES)


def measured(surface: Surface, relative: float, occ: Occ) -> Line:
    """Both meshers in turns, and what is true of their meshes."""
    points = surface.control_net.reshape(-1, 3)
    tolerance = relative * float(np.linalg.norm(np.ptp(points, axis=0)))
    model = surface.lower()
    times: list[tuple[float, float]] = []
    for _ in range(ROUNDS):
        mesh, mine = ours(model, tolerance)
        theirs, its = occ(surface, tolerance)
        times.append((mine, its))
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    found = [
        surface_to_mesh(sheets_of(surface), soup, int(np.clip(4 * len(soup), 4000, 30000)))
        for soup in (corners, theirs)
    ]
    return Line(
        (len(corners), len(theirs)),
        (median(mine for mine, _ in times), median(its for _, its in times)),
        (found[0].distance / tolerance, found[1].distance / tolerance),
        uniform(model, tolerance),
    )


def row(title: str, relative: float, lines: list[Line]) -> str:
    """Medians over a group, the worst deviations, and how many are over the tolerance."""
    mine, its = (median(line.triangles[k] for line in lines) for k in range(2))
    slow, fast = (1e3 * median(line.seconds[k] for line in lines) for k in range(2))
    grid = median(line.uniform for line in lines)
    ratios = [line.triangles[0] / line.uniform for line in lines]
    return (
        f"{title:22}{relative:10g}{mine:8.0f}{its:8.0f}"
        f"{median(line.triangles[0] / line.triangles[1] for line in lines):7.2f}"
        f"{slow:8.1f}{fast:8.1f}{median(line.seconds[0] / line.seconds[1] for line in lines):7.2f}"
        f"{max(line.found[0] for line in lines):11.3f}{max(line.found[1] for line in lines):7.2f}"
        f"{sum(line.found[0] > 1 for line in lines):6}{sum(line.found[1] > 1 for line in lines):5}"
        f"{grid:9.0f}{median(ratios):7.2f}"
    )


def run(python: str) -> None:
    """Prints the table."""
    print("Meshes by tolerance, ours, Open CASCADE's and a certified uniform grid; medians;")
    print("found/tol is the largest deviation met by sampling, over counts the meshes above 1")
    print(HEADER)
    with open_cascade(python) as occ:
        for title, surfaces in works().items():
            for relative in TOLERANCES:
                lines = [measured(surface, relative, occ) for surface in surfaces]
                print(row(title, relative, lines), flush=True)


if __name__ == "__main__":
    pin_blas()
    run(sys.argv[1])
