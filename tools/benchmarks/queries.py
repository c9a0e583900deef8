"""Closest points a second, beside those of Open CASCADE; rays, signs, sections and measures.

Open CASCADE where `make bench-occ` installed it.

Points are strewn in the box of the control points, made larger by a fifth. Both take turns; time is
that of the processor. `wrong` are points for which the least distance that was found is not within
1e-9 of the diagonal of the least of both, or nothing was found. Points nearest to a border are not
counted against Open CASCADE, which looks for normals alone.
"""

import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np

from service.encoders.sections.registry import SECTIONS_BY_NAME
from service.engine.measures.measure import measure
from service.engine.measures.values import MeasureQuery
from service.engine.models import to_patches
from service.engine.queries.intersect import RayQuery, intersect_rays
from service.engine.queries.project import ProjectQuery, project_on_surface
from service.engine.sections.planes import Planes, SectionTolerance
from service.pipeline.section import plan_sections
from service.surface.bezier import BezierSurface
from service.surface.examples import find
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind
from tools.certify.surfaces import FAMILIES

ROUNDS, OURS, THEIRS, RAYS = 5, 20_000, 400, 50_000
"""Rounds, points in each, and rays."""

SIGNED, PLANES = 2000, 20
"""Points whose signs are asked for, and planes."""

PYTHON = Path("build/occ/bin/python")
WORKER = Path(__file__).with_name("open_cascade_closest.py")


def run() -> None:
    """Prints the table."""
    bicubic = FAMILIES["bicubic, moderate"].surface(1)
    assert isinstance(bicubic, BezierSurface)
    surfaces: dict[str, SurfaceKind] = {
        "one bicubic patch": bicubic, "teapot, 32 patches": find("utah-teapot").surface(),
    }  # fmt: skip
    print(f"{'closest points a second':24}{'ours':>12}{'wrong':>8}{'occ':>12}{'wrong':>8}")
    for title, surface in surfaces.items():
        model = to_patches(surface.lower())
        low, high = model.bounds
        side = high - low
        points = np.random.default_rng(1).uniform(low - side / 10, high + side / 10, (OURS, 3))
        ours, theirs, wrong = compared(model, points)
        cells = [f"{OURS / ours:12,.0f}", f"{wrong[0]:8}"]
        cells += [f"{THEIRS / theirs:12,.0f}", f"{wrong[1]:8}"] if theirs else [f"{'-':>12}", ""]
        print(f"{title:24}" + "".join(cells), flush=True)
    print(f"\n{'rays a second':24}{'first hits':>12}{'all hits':>12}{'hits a ray':>12}")
    for title, surface in surfaces.items():
        rates, each = ray_rates(to_patches(surface.lower()))
        print(f"{title:24}" + "".join(f"{rate:12,.0f}" for rate in rates) + f"{each:12.2f}")

    print(f"\n{'':24}{'signs a second':>16}{'planes a second':>16}{'measured, ms':>16}")
    for name in ("sphere", "rounded-box", "utah-teapot"):
        others = other_rates(find(name).surface())
        print(f"{name:24}" + "".join(f"{value:16,.0f}" for value in others), flush=True)


def other_rates(surface: SurfaceKind) -> tuple[float, float, float]:
    """Signed points a second, planes a second, and milliseconds of all measures."""
    model = to_patches(surface.lower())
    low, high = model.bounds
    rng = np.random.default_rng(1)
    points = ProjectQuery(rng.uniform(low, high, (SIGNED, 3)), sign=True)
    normals = rng.normal(size=(PLANES, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    planes = Planes(normals, (rng.uniform(low, high, (PLANES, 3)) * normals).sum(axis=1))
    cut = plan_sections(surface, (planes, SectionTolerance()), SECTIONS_BY_NAME["json"])
    work: tuple[Callable[[], object], ...] = (
        lambda: project_on_surface(model, points),
        cut.run,
        lambda: measure(model, MeasureQuery()),
    )
    seconds: list[list[float]] = [[], [], []]
    for _ in range(ROUNDS):
        for which, run_once in enumerate(work):
            start = time.process_time()
            run_once()
            seconds[which].append(time.process_time() - start)
    signed, planed, measured = (median(each) for each in seconds)
    return SIGNED / signed, PLANES / planed, 1e3 * measured


def ray_rates(model: PatchModel) -> tuple[list[float], float]:
    """Rays a second, first hits and all, and hits of a ray: from a sphere to points of the box."""
    low, high = model.bounds
    rng = np.random.default_rng(1)
    away = rng.normal(size=(RAYS, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    origins = (low + high) / 2 + 0.75 * model.diagonal * away
    directions = rng.uniform(low, high, (RAYS, 3)) - origins
    seconds: list[list[float]] = [[], []]
    hits = 0
    for _ in range(ROUNDS):
        for which, only_first in enumerate((True, False)):
            start = time.process_time()
            query = RayQuery(origins, directions, only_first)
            hits = len(intersect_rays(model, query, 10**7)["t"])
            seconds[which].append(time.process_time() - start)
    return [RAYS / median(each) for each in seconds], hits / RAYS


def compared(
    model: PatchModel, points: "np.ndarray[tuple[int, int], np.dtype[np.float64]]"
) -> tuple[float, float | None, tuple[int, int]]:
    """Seconds of both, and how many of the first points are wrong."""
    ours, theirs = [], []
    few = points[:THEIRS]
    columns = project_on_surface(model, ProjectQuery(few))
    least, is_inner = columns["distances"], ~columns["on_boundary"]
    found = least
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "points.npz"
        np.savez(file, nets=np.concatenate([b.points for b in model.batches]), points=few)
        command = [str(PYTHON), str(WORKER)]
        worker = None
        if PYTHON.exists():
            worker = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
            )
        for _ in range(ROUNDS):
            start = time.process_time()
            project_on_surface(model, ProjectQuery(points))
            ours.append(time.process_time() - start)
            if worker is not None and worker.stdin is not None and worker.stdout is not None:
                worker.stdin.write(f"{file}\n")
                worker.stdout.readline()
                answer = np.load(f"{file}.out.npz")
                theirs.append(float(answer["seconds"]))
                found = answer["distances"]
        if worker is not None:
            worker.communicate()
    best = np.minimum(least, found)
    slack = 1e-9 * model.diagonal
    wrong = int((least > best + slack).sum()), int(((found > best + slack) & is_inner).sum())
    return median(ours), median(theirs) if theirs else None, wrong
