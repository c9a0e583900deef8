"""How time and memory grow with the size of a mesh: with patches, control points and divisions.

Each mesh is made in a process of its own, as GLB: the first request makes its plan, the others find
the plan in the cache. The times are the least CPU times of this process. The memory is that of the
first request, in multiples of the bytes of the file; it includes the plan. The slope between two
sizes is log(time ratio) / log(size ratio): 1 if the time grows in proportion to the size.
"""

import time
from math import log
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from service.bases.arrays import FloatArray
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import plan_mesh
from service.settings.runtime import collect_rarely, limit_plans, pin_blas, share_heap
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.kinds import Surface
from service.surface.patches import PatchSurface
from tools.processes import peak_memory, reset_peak, resident_memory

MAX_SLOPE, MAX_PEAK = 1.1, 4.0
"""The largest slope of the times of requests whose plans are kept; and the most memory of the first
request, in multiples of the file, for the largest size of a series."""

MEMORY, ROUNDS = 8 << 30, 12
"""The setting `SURFACE_MEMORY_BYTES` on a machine of 16 GB; and the number of requests after the
first."""


class Growth(NamedTuple):
    """A mesh: its series, its number of patches, control points or samples, and its divisions."""

    series: str
    size: int
    divisions: int


SERIES = (
    [Growth("patches", size, 4) for size in (1_000, 10_000, 100_000)],
    [Growth("control points of a B-spline", side**2, 4) for side in (100, 316)],
    [Growth("samples of a patch", (side + 1) ** 2, side) for side in (512, 1024, 2048)],
    [Growth("control points at 1 division", 1000**2, 1)],
)


class Measurement(NamedTuple):
    """CPU seconds of the first request, the least of the others, peak memory, size of the file."""

    first: float
    least: float
    peak: int
    file_bytes: int


def build_hills(rows: int, columns: int) -> FloatArray:
    """Control points (rows, columns, 3) of smooth hills."""
    x, y = np.meshgrid(np.arange(float(rows)), np.arange(float(columns)), indexing="ij")
    return np.stack([x, y, np.sin(x / 3) * np.cos(y / 5)], axis=-1)


def build_patches(count: int) -> PatchSurface:
    """About `count` bicubic patches in a square; neighbours share control points."""
    side = round(count**0.5)
    columns = 3 * side + 1
    number = np.arange(columns**2).reshape(columns, columns)
    windows = np.lib.stride_tricks.sliding_window_view(number, (4, 4))[::3, ::3]
    return PatchSurface(build_hills(columns, columns).reshape(-1, 3), windows.reshape(-1, 4, 4))


def build_surface(growth: Growth) -> Surface:
    """The surface of a mesh."""
    if growth.series == "patches":
        return build_patches(growth.size)
    side = 4 if growth.series == "samples of a patch" else round(growth.size**0.5)
    net = build_hills(side, side)
    return BezierSurface(net) if side == 4 else BsplineSurface(net)


def measure(growth: Growth) -> Measurement:
    """Measures a mesh in this process, which must have done no work before."""
    pin_blas()
    share_heap()
    collect_rarely()
    limit_plans(MEMORY)
    surface, glb = build_surface(growth), BY_NAME["glb"]
    plan_mesh(build_surface(growth._replace(size=100)), MeshOptions((2, 2)), glb).run()
    options = MeshOptions((growth.divisions, growth.divisions))
    bytes_before = resident_memory()
    reset_peak()

    def make() -> tuple[float, int]:
        begin = time.process_time()
        size = len(plan_mesh(surface, options, glb).run().content)
        return time.process_time() - begin, size

    first, file_bytes = make()
    peak = peak_memory() - bytes_before
    least = min(make()[0] for _ in range(ROUNDS if growth.divisions > 1 else 1))
    return Measurement(first, least, peak, file_bytes)


def run() -> bool:
    """Prints the table; returns whether slopes and peaks are within their limits."""
    print("Growth of meshes as GLB: CPU time, and peak memory of the first request")
    print(
        f"{'size':>9} {'of':30}{'divisions':>10}{'first s':>9}{'kept s':>9}{'slope':>7}"
        f"{'file MB':>9}{'peak / file':>12}"
    )
    is_within = True
    with get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for series in SERIES:
            results = pool.map(measure, series, chunksize=1)
            for k, (growth, result) in enumerate(zip(series, results, strict=True)):
                text = ""
                if k:
                    ratio = result.least / results[k - 1].least
                    slope = log(ratio) / log(growth.size / series[k - 1].size)
                    is_within &= slope <= MAX_SLOPE
                    text = f"{slope:.2f}"
                peak = result.peak / result.file_bytes
                print(
                    f"{growth.size:9} {growth.series:30}{growth.divisions:10}{result.first:9.3f}"
                    f"{result.least:9.3f}{text:>7}{result.file_bytes / 1e6:9.1f}{peak:12.2f}",
                    flush=True,
                )
            is_within &= len(series) == 1 or peak <= MAX_PEAK
    print(f"Slopes are at most {MAX_SLOPE}, and the last peak of a series at most {MAX_PEAK:g}.")
    return is_within
