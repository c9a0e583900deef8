"""Compares meshes by tolerance with those of Open CASCADE and with uniform grids: `make bench-occ`.

The table compares triangles, time, memory and sampled deviations for the same tolerance. Open
CASCADE meshes with a linear deflection equal to the tolerance and an angular deflection of 0.5 rad,
in a process of its own; both meshers run alternately. Its time is the time of the mesher alone.
The time of the service is from patches to the mesh in memory, with the heap settings of the
service; with the default of glibc, memory would be returned to the system after each mesh. Memory
is the growth during one mesh: for the service as tracemalloc counts it, for Open CASCADE the peak
of its process. The uniform grid is the smallest grid whose proved bound is within the tolerance; it
is left out for models of several batches.

    python -m tools.benchmarks.open_cascade PYTHON [GROUP …]

PYTHON is a Python in which cadquery-ocp is installed, and GROUP a group of surfaces of the table.
"""

import subprocess
import sys
import tempfile
import time
import tracemalloc
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias

import numpy as np

from oracles.deviation import measure_surface_to_mesh
from oracles.distance import Soup
from oracles.sheets import build_sheets
from service.engine.accuracy import Accuracy
from service.engine.bounds.second_derivatives import bound_second_derivatives, count_blocks
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.settings.runtime import pin_blas, share_heap
from service.surface.batches import TensorPatches
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples.catalogue import find
from service.surface.lowered import Part, PatchModel
from tools.building import build
from tools.certify.surfaces import (
    FAMILIES,
    MODERATE,
    QUARTER,
    QUARTER_WEIGHTS,
    WILD,
    Array,
    bicubic,
    scatter_points,
)

Surface: TypeAlias = BezierSurface | BsplineSurface | PatchModel
OpenCascade: TypeAlias = Callable[[Surface, float], tuple[Array, float, int]]

WORKER = Path(__file__).with_name("open_cascade_worker.py")
TOLERANCES = (1e-2, 1e-3, 1e-4)
ROUNDS, MAX_REPEATED_SECONDS = 3, 2.0
"""Number of rounds; a mesh that takes more than `MAX_REPEATED_SECONDS` is made only once."""

MAX_SHEETS = 4
"""A model with more sheets is sampled only once, not more finely where the deviation is largest.

A sheet is one surface as `oracles.sheets` evaluates it, without code of the service."""

MODELS = (
    "utah-teapot", "sphere", "torus", "cone", "cylinder", "bourke-1111", "nurbs-goblet",
)  # fmt: skip
SHAPES = (1, 1), (2, 1), (1, 2), (4, 1), (1, 4), (8, 1), (1, 8)
"""Ratios of the divisions along u and v of uniform grids."""

HEADER = (
    f"{'surfaces':22}{'tolerance':>10}{'ours':>8}{'OCC':>8}{'ratio':>7}{'ms':>8}{'OCC':>8}"
    f"{'ratio':>7}{'MB':>7}{'OCC':>7}{'found/tol':>11}{'OCC':>7}{'over':>6}{'OCC':>5}"
    f"{'uniform':>9}{'ratio':>7}"
)


def list_groups() -> dict[str, list[Surface]]:
    """The surfaces by name of their group."""
    rng = np.random.default_rng(15)
    ridges = (FAMILIES["sine ridges"].surface(seed) for seed in range(6))
    spikes = (FAMILIES["spikes"].surface(seed) for seed in range(6))
    groups: dict[str, list[Surface]] = {
        "bicubic, moderate": [BezierSurface(bicubic(seed, MODERATE)) for seed in range(12)],
        "bicubic, wild": [BezierSurface(bicubic(100 + seed, WILD)) for seed in range(12)],
        "degree 15": [
            BezierSurface(scatter_points(rng, 16, 16, spread=0.02, height=0.3)) for _ in range(4)
        ],
        # All of these are B-splines; the conditions tell mypy.
        "spikes": [s for s in spikes if isinstance(s, BsplineSurface)],
        "sine ridges": [s for s in ridges if isinstance(s, BsplineSurface)],
        "1000 small faces": [build_machine_parts()],
        "thin skins": [build_wing_skin(seed) for seed in range(2)],
    }
    return groups | {name: [find_example(name)] for name in MODELS}


def find_example(name: str) -> Surface:
    """A built-in surface: a Bézier patch, a B-spline, or the patches of its model."""
    surface = find(name).surface()
    if isinstance(surface, BezierSurface | BsplineSurface):
        return surface
    model = surface.lower()
    assert isinstance(model, PatchModel)
    return model


def build_machine_parts() -> PatchModel:
    """A model of 1000 faces as machine parts have them: planes, quarters of cylinders, and fillets.

    Fillets are quarters of a tube along a quarter of a circle. The faces have many sizes, and stand
    on a lattice in random orientations.
    """
    rng = np.random.default_rng(16)
    # Control points of a quarter of a circle, with z = 1 as a factor for the products below.
    turn = np.column_stack([QUARTER, np.ones(3)])
    line, unit_weights = np.array([[0.0, 0, 0], [0, 0, 1]]), np.ones(2)
    ring = np.stack([turn * np.array([3 + x, 3 + x, y]) for x, y in QUARTER.tolist()], axis=1)
    plane = np.stack([line, line + np.array([1.0, 0, 0])])
    pipe = turn[:, np.newaxis] * np.array([1.0, 1, 0]) + line
    kinds = (
        (plane, np.ones((2, 2))),
        (pipe, np.outer(QUARTER_WEIGHTS, unit_weights)),
        (ring, np.outer(QUARTER_WEIGHTS, QUARTER_WEIGHTS)),
    )
    batches, number = [], 0
    for (net, weights), count in zip(kinds, (334, 333, 333), strict=True):
        nets = []
        for _ in range(count):
            rotated_net = (
                net @ np.linalg.qr(rng.normal(size=(3, 3)))[0] * 10 ** rng.uniform(-1, 0.5)
            )
            position = np.array([number // 100, number // 10 % 10, number % 10]) * 4.0
            nets.append(rotated_net / np.ptp(net) + position)
            number += 1
        batches.append(TensorPatches(np.stack(nets), np.repeat(weights[np.newaxis], count, axis=0)))
    return PatchModel("faces", tuple(batches), (Part("faces", 0, number),))


def build_wing_skin(seed: int) -> BsplineSurface:
    """The skin of a wing: 526 × 13 control points, with dense knots near its leading edge.

    Every seed except 0 adds noise to the control points, as a measured skin has.
    """
    rng = np.random.default_rng(seed)
    offsets = np.cumsum(np.geomspace(1e-8, 0.02, 261))
    knots = np.concatenate([[0.0] * 4, 0.5 - offsets[::-1], 0.5 + offsets, [1.0] * 4])
    greville = np.array([knots[k + 1 : k + 4].mean() for k in range(len(knots) - 4)])
    angle = 2 * np.pi * greville[:, np.newaxis]
    outward = np.linspace(0, 1, 13)  # from the root of the wing to its tip
    chord, twist = 1 - 0.6 * outward, 0.1 * rng.uniform(-1, 1) * outward
    x, y = chord * (1 + np.cos(angle)) / 2, 0.07 * chord * np.sin(angle) * (1.4 - np.cos(angle))
    y = y + 1e-4 * seed * rng.normal(size=y.shape)
    net = np.stack([x - twist * y, y + twist * x, 8 * outward + 0 * x], axis=-1)
    return BsplineSurface(net, (3, 2), (knots, "clamped"))


@dataclass(frozen=True)
class Comparison:
    """The meshes of one surface at one tolerance: pairs of the service and of Open CASCADE.

    `peak` is in megabytes. `deviations` are sampled, in multiples of the tolerance. `uniform` is
    the number of triangles of the uniform grid, or 0 for a model of several batches.
    """

    triangles: tuple[int, int]
    seconds: tuple[float, float]
    peak: tuple[float, float]
    deviations: tuple[float, float]
    uniform: int


@contextmanager
def start_open_cascade(python: str) -> Iterator[OpenCascade]:
    """Starts the worker process of Open CASCADE, which ends at the end of the block.

    The result is a function of a surface and a tolerance. It returns corners (T, 3, 3), seconds and
    peak memory in bytes.
    """
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(
            [python, WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as worker,
    ):
        assert worker.stdin is not None
        assert worker.stdout is not None
        name = f"{folder}/surface.npz"

        def mesh(surface: Surface, deflection: float) -> tuple[Array, float, int]:
            faces = enumerate(build_fields(surface))
            arrays: Any = {f"{k} {key}": x for k, face in faces for key, x in face.items()}
            np.savez(name, deflection=deflection, **arrays)
            print(name, file=worker.stdin, flush=True)
            if worker.stdout is None or not worker.stdout.readline():
                raise SystemExit("the process of Open CASCADE has ended")
            response = np.load(f"{name}.out.npz")
            return response["corners"], float(response["seconds"]), int(response["peak"])

        yield mesh
        worker.stdin.close()


def build_fields(surface: Surface) -> list[dict[str, Array]]:
    """The arrays of each face that the worker reads."""
    if isinstance(surface, PatchModel):
        fields = []
        for batch in surface.batches:
            weights = [{}] * batch.count if batch.weights is None else [
                {"weights": each} for each in batch.weights
            ]  # fmt: skip
            fields += [{"net": net} | each for net, each in zip(batch.points, weights, strict=True)]
        return fields
    face = {"net": surface.control_net}
    if surface.weights is not None:
        face["weights"] = surface.weights
    if isinstance(surface, BsplineSurface):
        face["degree"] = np.array(surface.degree)
        for axis, knots in zip("uv", surface.knot_vectors, strict=True):
            face[f"knots_{axis}"], times = np.unique(knots, return_counts=True)
            face[f"times_{axis}"] = times.astype(np.float64)
    return [face]


def time_mesh(model: PatchModel, tolerance: float) -> tuple[Mesh, float]:
    """A mesh without normals, and the CPU time in seconds."""
    options = MeshOptions(accuracy=Accuracy(tolerance=tolerance), normals=False)
    start = time.process_time()
    mesh = build(model, options, is_float32=False)
    return mesh, time.process_time() - start


def count_uniform(model: PatchModel, tolerance: float) -> int:
    """Triangles of the smallest uniform grid whose proved bound is within the tolerance.

    The ratio of divisions along u and along v is 1, 2, 4 or 8, in either direction.
    """
    (batch,) = model.batches
    assert isinstance(batch, TensorPatches)
    p, q = batch.degree

    def exceeds_tolerance(times: int, shape: tuple[int, int]) -> bool:
        u, v = times * shape[0], times * shape[1]
        bound = bound_second_derivatives(batch, (u, v), (count_blocks(u, p), count_blocks(v, q)))
        return float(bound.bound_deviations(1 / u, 1 / v).max()) > tolerance

    def find_min_times(shape: tuple[int, int]) -> int:
        high = 1
        while exceeds_tolerance(high, shape):
            high *= 2
        # More divisions have a smaller bound, so `bisect_left` finds the least sufficient number.
        times = range(high // 2 + 1, high)
        return times.start + bisect_left(times, True, key=lambda n: not exceeds_tolerance(n, shape))

    return min(
        2 * find_min_times(shape) ** 2 * shape[0] * shape[1] * batch.count for shape in SHAPES
    )


def compare_meshes(surface: Surface, relative: float, occ: OpenCascade) -> Comparison:
    """The comparison of both meshers for one surface; `relative` is the relative tolerance."""
    model = surface if isinstance(surface, PatchModel) else surface.lower()
    points = np.concatenate([batch.points.reshape(-1, 3) for batch in model.batches])
    tolerance = relative * float(np.linalg.norm(np.ptp(points, axis=0)))
    times: list[tuple[float, float]] = []
    while len(times) < ROUNDS and (not times or times[0][0] < MAX_REPEATED_SECONDS):
        mesh, seconds = time_mesh(model, tolerance)
        occ_corners, occ_seconds, occ_peak = occ(surface, tolerance)
        times.append((seconds, occ_seconds))
    tracemalloc.start()
    time_mesh(model, tolerance)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    return Comparison(
        (len(corners), len(occ_corners)),
        (median(row[0] for row in times), median(row[1] for row in times)),
        (peak / 1e6, occ_peak / 1e6),
        (
            measure_deviation(surface, corners) / tolerance,
            measure_deviation(surface, occ_corners) / tolerance,
        ),
        count_uniform(model, tolerance) if len(model.batches) == 1 else 0,
    )


def measure_deviation(surface: Surface, corners: Array) -> float:
    """The largest sampled distance from the surface to the triangles with these corners."""
    sheets = build_sheets(surface)
    if len(sheets) <= MAX_SHEETS:
        return measure_surface_to_mesh(
            sheets, corners, int(np.clip(4 * len(corners), 4000, 30000))
        ).distance
    count = max(200, 4 * len(corners) // len(sheets))
    points = np.concatenate([sheet.at(sheet.samples(count)) + sheet.origin for sheet in sheets])
    _, largest = Soup(corners).farthest(points)
    return largest


def write_row(title: str, relative: float, lines: list[Comparison]) -> str:
    """A row of the table: medians over a group, largest deviations, counts above the tolerance."""
    triangles, occ_triangles = (median(line.triangles[k] for line in lines) for k in range(2))
    ms, occ_ms = (1e3 * median(line.seconds[k] for line in lines) for k in range(2))
    grid = median(line.uniform for line in lines)
    ratios = [line.triangles[0] / max(line.uniform, 1) for line in lines]
    peak, occ_peak = (max(line.peak[k] for line in lines) for k in range(2))
    largest, occ_largest = (max(line.deviations[k] for line in lines) for k in range(2))
    exceeding, occ_exceeding = (sum(line.deviations[k] > 1 for line in lines) for k in range(2))
    return (
        f"{title:22}{relative:10g}{triangles:8.0f}{occ_triangles:8.0f}"
        f"{median(line.triangles[0] / line.triangles[1] for line in lines):7.2f}"
        f"{ms:8.1f}{occ_ms:8.1f}{median(line.seconds[0] / line.seconds[1] for line in lines):7.2f}"
        f"{peak:7.1f}{occ_peak:7.1f}"
        f"{largest:11.3f}{occ_largest:7.2f}"
        f"{exceeding:6}{occ_exceeding:5}" + (f"{grid:9.0f}{median(ratios):7.2f}" if grid else "")
    )


def run(python: str, names: Sequence[str] = ()) -> None:
    """Prints the table, or its rows for these groups."""
    print("Meshes by tolerance: the service, Open CASCADE, and a uniform grid; medians;")
    print("MB is the largest peak; found/tol is the largest sampled deviation divided by the")
    print("tolerance; over is the number of meshes for which this is above 1")
    print(HEADER)
    with start_open_cascade(python) as occ:
        for title, surfaces in list_groups().items():
            for relative in TOLERANCES if not names or title in names else ():
                lines = [compare_meshes(surface, relative, occ) for surface in surfaces]
                print(write_row(title, relative, lines), flush=True)


if __name__ == "__main__":
    pin_blas()
    share_heap()
    run(sys.argv[1], sys.argv[2:])
