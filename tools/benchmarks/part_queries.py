"""Closest points and rays a second on whole parts, compared with patches alone and with others.

Each part is asked with its trims, and as the whole surfaces of its faces: as many patches without
trims. Open CASCADE reads the part from a STEP file that the service wrote; it is left out if
`make bench-queries` has not installed it. All run alternately; times are CPU times, and preparation
is apart. Points are random in the box of the part, enlarged by 1/5; rays begin on a sphere around
it and go to random points of the box. `wrong` counts points at which Open CASCADE finds no distance
or a larger one, and rays with another number of hits.
"""

import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import IO, Any, TypeAlias

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.cache import MESH_PLANS
from service.encoders.cad.registry import DEFINITIONS_BY_NAME
from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.parts.build import build_part
from service.engine.parts.intersect import intersect_part
from service.engine.parts.part import Part
from service.engine.parts.project import project_on_part
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.surface.brep import BrepSurface
from service.surface.examples.catalogue import find

PARTS = ("plate-with-holes", "gear", "impeller", "pipe-tee")
"""Built-in parts of 9 to 87 faces."""

ROUNDS, POINTS, RAYS = 3, 10_000, 20_000
"""Number of rounds, and of points and rays of the service in each."""

OTHER_POINTS, OTHER_RAYS = 40, 2000
"""Numbers of points and rays of Open CASCADE."""

PYTHON = Path("build/occ/bin/python")

LEAST = 0.5
"""The least share of the speed without trims that a part may have."""

Times: TypeAlias = dict[str, list[float]]

KINDS = ("prepare", "points", "all hits", "first hits")


@dataclass(frozen=True, eq=False)
class Questions:
    """Points (n, 3) and rays for one part."""

    points: FloatArray
    origins: FloatArray
    directions: FloatArray


def run() -> bool:
    """Prints a table for each part; returns whether all are within the limits."""
    is_within = True
    with _start_worker() if PYTHON.exists() else nullcontext() as worker:
        for name in PARTS:
            surface = find(name).surface()
            assert isinstance(surface, BrepSurface)
            is_within &= compare(name, surface, worker)
    return is_within


def compare(name: str, surface: BrepSurface, worker: "_Worker | None") -> bool:
    """Prints the table of one part; returns whether it is within the limits."""
    model = surface.lower()
    part = build_part(model)
    patches = part.members.definitions[0].surfaces.model
    questions = draw_questions(*patches.bounds)
    closest = ProjectQuery(questions.points)
    rays = [RayQuery(questions.origins, questions.directions, first) for first in (False, True)]
    hits = 10**7
    work: dict[str, tuple[Callable[[], Any], ...]] = {
        "with trims": (
            lambda: _build_anew(surface),
            lambda: project_on_part(part, closest),
            *(lambda each=each: intersect_part(part, each, hits) for each in rays),
        ),
        "without": (
            lambda: None,
            lambda: project_on_surface(patches, closest),
            *(lambda each=each: intersect_rays(patches, each, hits) for each in rays),
        ),
    }
    times: dict[str, Times] = {}
    answers: dict[str, list[Any]] = {}
    with tempfile.TemporaryDirectory() as folder:
        file = _write_questions(Path(folder), surface, questions)
        for _ in range(ROUNDS):
            for row, functions in work.items():
                answers[row] = []
                for kind, function in zip(KINDS, functions, strict=True):
                    start = time.process_time()
                    answers[row].append(function())
                    _add(times, row, kind, time.process_time() - start)
            if worker is not None:
                others = worker(file)
                for kind, seconds in zip(KINDS, others["seconds"].tolist(), strict=True):
                    _add(times, "Open CASCADE", kind, seconds)
    rates = {row: _list_rates(row, each) for row, each in times.items()}
    print(f"{name}: {len(surface.face_names)} faces, {patches.patch_count} patches")
    print(f"{'':16}{'prepare, ms':>14}" + "".join(f"{kind + ' a s':>18}" for kind in KINDS[1:]))
    for row, values in rates.items():
        print(f"{row:16}{values[0]:14.1f}" + "".join(f"{rate:18,.0f}" for rate in values[1:]))
    ratios = [a / b for a, b in zip(rates["with trims"][1:], rates["without"][1:], strict=True)]
    print(f"{'share of without':30}" + "".join(f"{ratio:18.2f}" for ratio in ratios))
    is_within = min(ratios) >= LEAST
    if worker is not None:
        _, distances, all_hits, _ = answers["with trims"]
        far = others["distances"] > distances["distance_bounds"][:OTHER_POINTS, 1] + 1e-6
        wrong = others["counts"] != np.asarray(all_hits["counts"])[:OTHER_RAYS]
        print(f"{'wrong of Open CASCADE':30}{far.sum():18}{wrong.sum():18}")
        pairs = zip(rates["with trims"][1:], rates["Open CASCADE"][1:], strict=True)
        is_within &= all(ours > theirs for ours, theirs in pairs)
    print(flush=True)
    return is_within


def draw_questions(low: FloatArray, high: FloatArray) -> Questions:
    """Points in the box of a part, enlarged by 1/5, and rays from a sphere around it."""
    rng = np.random.default_rng(1)
    size, middle = high - low, (low + high) / 2
    points = rng.uniform(low - size / 10, high + size / 10, (POINTS, 3))
    outward = rng.normal(size=(RAYS, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    origins = middle + 0.75 * np.linalg.norm(size) * outward
    directions = rng.uniform(low, high, (RAYS, 3)) - origins
    return Questions(points, origins, directions)


def _build_anew(surface: BrepSurface) -> Part:
    """The part of a surface that no request has had before."""
    MESH_PLANS.clear()
    return build_part(surface.lower())


def _add(times: dict[str, Times], row: str, kind: str, seconds: float) -> None:
    times.setdefault(row, {}).setdefault(kind, []).append(seconds)


def _list_rates(row: str, times: Times) -> list[float]:
    """Milliseconds of the preparation, and numbers a second of points, all hits and first hits."""
    points, rays = (OTHER_POINTS, OTHER_RAYS) if row == "Open CASCADE" else (POINTS, RAYS)
    prepare, *others = (median(times[kind]) for kind in KINDS)
    counts = points, rays, rays
    rates = [count / max(each, 1e-9) for count, each in zip(counts, others, strict=True)]
    return [1e3 * prepare, *rates]


def _write_questions(folder: Path, surface: BrepSurface, questions: Questions) -> Path:
    """The input of the worker: a STEP file, and some of the points and rays."""
    path, file = folder / "part.step", folder / "questions.npz"
    written = DEFINITIONS_BY_NAME["step"].encode(surface.lower(), surface.unit, _allow_any)
    path.write_bytes(bytes(written.content))
    np.savez(
        file,
        path=str(path),
        points=questions.points[:OTHER_POINTS],
        origins=questions.origins[:OTHER_RAYS],
        directions=questions.directions[:OTHER_RAYS],
    )
    return file


def _allow_any(bound: int) -> None:
    """Allow a file of any size."""


class _Worker:
    """A process of Open CASCADE that answers one file at each call."""

    def __init__(self, stdin: IO[str], stdout: IO[str]) -> None:
        self.stdin, self.stdout = stdin, stdout

    def __call__(self, file: Path) -> Any:
        print(file, file=self.stdin, flush=True)
        for line in self.stdout:
            if line.startswith("done"):
                return np.load(f"{file}.out.npz")
        raise SystemExit("the process of Open CASCADE has ended")


@contextmanager
def _start_worker() -> Iterator[_Worker]:
    command = [str(PYTHON), "-m", "tools.benchmarks.part_queries_worker"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        yield _Worker(process.stdin, process.stdout)
        process.stdin.close()
