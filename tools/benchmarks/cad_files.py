"""Compares a STEP file's way to a GLB with that of Open CASCADE: a part of `make bench-occ`.

A part of 314 faces, with and without its own parameter curves, becomes a GLB within 1e-3 of its
diagonal. Both read, mesh and write in turn, on one thread; imports are not counted, and the best
time counts. The last row is the speed of reading alone, over all files that are given.

    python -m tools.benchmarks.cad_files PYTHON [FILE …]

PYTHON is a Python in which cadquery-ocp is installed. The exit status is 1 beyond a limit.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from service.bases.cache import MESH_PLANS
from service.decoders.format import FileLimits
from service.decoders.registry import BY_SUFFIX
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import plan_mesh
from service.schemas.document import DocumentLimits
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.settings.runtime import pin_blas, share_heap

FILES = {"panel_pcurves": 3.0, "panel_edges": 6.0}
"""Files, and the most that the time of the service may be, in times of Open CASCADE."""

ROUNDS = 5
RELATIVE = 1e-3
DIAGONAL = (120.0**2 + 90.0**2 + 8.0**2) ** 0.5
"""The diagonal of the part, in millimetres."""


def convert(source: Path, target: Path) -> list[float]:
    """The seconds of the service to read, and to mesh and write."""
    MESH_PLANS.clear()  # a brep that was meshed before is kept prepared
    start = time.process_time()
    decoded = BY_SUFFIX["step"].decode(source.read_bytes(), None, FileLimits())
    request = validate_document(SurfaceRequest, {"surface": decoded.tree}, DocumentLimits())
    surface = request.to_surface()
    read = time.process_time()
    options = MeshOptions(accuracy=Accuracy(tolerance=RELATIVE * DIAGONAL))
    file = plan_mesh(surface, options, BY_NAME["glb"], EncodeOptions()).run()
    target.write_bytes(bytes(file.content))
    return [read - start, time.process_time() - read]


def ask(worker: "subprocess.Popen[str]", *words: object) -> list[float]:
    """The numbers that the worker answers to a line; it prints messages of its library, too."""
    stdin, stdout = worker.stdin, worker.stdout
    assert stdin is not None
    assert stdout is not None
    if words:
        print(*words, file=stdin, flush=True)
    return _read_answer(stdout)


def _read_answer(stdout: IO[str]) -> list[float]:
    for line in stdout:
        if line.startswith("ready"):
            return []
        if line.startswith("result"):
            return [float(word) for word in line.split()[1:]]
    raise SystemExit("the process of Open CASCADE has ended")


def compare(folder: Path, worker: "subprocess.Popen[str]") -> bool:
    """Prints a row for each file; returns whether all are within their limits."""
    is_within = True
    print(f"{'file':16}{'read':>8}{'mesh':>8}{'all':>8}   Open CASCADE{'ratio':>8}  milliseconds")
    for name, limit in FILES.items():
        source = folder / f"{name}.step"
        ours: list[list[float]] = []
        theirs: list[list[float]] = []
        for _ in range(ROUNDS):
            ours.append(convert(source, folder / "own.glb"))
            answer = ask(worker, source, folder / "occ.glb", RELATIVE * DIAGONAL)
            theirs.append(answer[:3])
        own, occ = min(ours, key=sum), min(theirs, key=sum)
        ratio = sum(own) / sum(occ)
        is_within &= ratio <= limit
        times = "".join(f"{1e3 * seconds:8.0f}" for seconds in (*own, sum(own)))
        print(f"{name:16}{times}{1e3 * sum(occ):15.0f}{ratio:8.2f}  (at most {limit:g})")
    return is_within


def measure_reading(paths: Sequence[Path]) -> None:
    """Prints the speed of reading: from bytes to arrays."""
    total, seconds = 0, 0.0
    for path in paths:
        content = path.read_bytes()
        start = time.process_time()
        BY_SUFFIX[path.suffix.lower().removeprefix(".")].decode(content, None, FileLimits())
        seconds += time.process_time() - start
        total += len(content)
    print(f"reading {len(paths)} files: {total / seconds / 1e6:.1f} MB/s")


def main(python: str, *paths: str) -> int:
    """Runs the comparison; returns 0 if all is within the limits."""
    pin_blas()
    share_heap()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        command = [python, "-m", "tools.benchmarks.cad_files_worker", name]
        with subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as worker:
            ask(worker)
            convert(folder / "panel_pcurves.step", folder / "own.glb")  # imports what it needs
            is_within = compare(folder, worker)
            assert worker.stdin is not None
            worker.stdin.close()
        measure_reading([Path(p) for p in paths] or [folder / f"{each}.step" for each in FILES])
    return 0 if is_within else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
