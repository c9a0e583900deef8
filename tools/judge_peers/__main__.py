"""Makes meshes by all makers, judges them, and prints a section of docs/judge.md.

    python -m tools.judge_peers TOLERANCE [--continue] [surface …]

The tolerance is a share of the diagonal. `make judge-peers` installs the makers into Pythons of
their own; makers that are not installed are left out. Meshes are in build/judge_peers/meshes, and
rows in build/judge_peers/rows.json. With `--continue`, those that are there are not made again:
after a run that was ended, for the rows of several tolerances, and, without the rows, to judge the
same meshes again. Progress is printed to the standard error.
"""

import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from service import __version__
from service.bases.cache import MESH_PLANS
from service.errors import SurfaceError
from service.settings.runtime import pin_blas, share_heap
from tools.judge_peers.cases import Case, build_case, list_surfaces, mesh_surface
from tools.judge_peers.rows import Row, judge, load, save
from tools.judge_peers.running import MAKERS, Made, Runner
from tools.judge_peers.table import OURS, write_section
from tools.judge_peers.wishes import Wish

FOLDER = Path("build/judge_peers")
CONTINUE = "--continue"

MAX_TRIANGLES = 1_000_000
"""Meshes with more triangles are not judged."""


def make_ours(case: Case, tolerance: float) -> Made:
    """The mesh of the service."""
    MESH_PLANS.clear()  # a surface that was meshed before is kept prepared
    start = time.process_time()
    try:
        vertices, faces = mesh_surface(case.surface, tolerance)
    except SurfaceError as error:
        return Made(error=str(error))
    return Made(vertices, faces, time.process_time() - start)


def judge_made(row: Row, case: Case, made: Made) -> Row:
    """The row with what the judge finds of a mesh."""
    if made.vertices is None or made.faces is None:
        return replace(row, error=made.error)
    if len(made.faces) > MAX_TRIANGLES:
        return replace(row, error=f"{len(made.faces)} triangles")
    found = judge(case.surface, made.vertices, made.faces, row.relative * case.diagonal)
    return replace(row, seconds=made.seconds, **found)


def judge_case(case: Case, relative: float, runners: Sequence[Runner]) -> list[Row]:
    """The rows of all makers for a surface and a tolerance; makers run at the same time."""
    tolerance = relative * case.diagonal
    ours = make_ours(case, tolerance)
    count = 0 if ours.faces is None else len(ours.faces)
    wishes = [(runner, runner.maker.ask(case, tolerance, count)) for runner in runners]
    chosen: list[tuple[Runner, Wish]] = [(runner, wish) for runner, wish in wishes if wish]
    with ThreadPoolExecutor(2) as pool:
        made = list(
            pool.map(lambda pair: pair[0].make(case.name, relative, pair[1].fields), chosen)
        )
    meshes = [(OURS, "the tolerance", ours)]
    meshes += [
        (runner.maker.name, wish.text, mesh)
        for (runner, wish), mesh in zip(chosen, made, strict=True)
    ]
    return [
        judge_made(Row(case.name, case.group, case.is_closed, maker, relative, asked), case, mesh)
        for maker, asked, mesh in meshes
    ]


def main(arguments: Sequence[str]) -> int:
    """Judges all surfaces, or the named ones; returns the exit status."""
    meshes, path, keeps = FOLDER / "meshes", FOLDER / "rows.json", CONTINUE in arguments
    meshes.mkdir(parents=True, exist_ok=True)
    relative, *names = [name for name in arguments if name != CONTINUE]
    runners = [Runner(maker, meshes, keeps) for maker in MAKERS]
    runners = [runner for runner in runners if runner.python.exists()]
    rows, versions = load(path) if keeps and path.exists() else ([], {OURS: __version__})
    cases = [
        build_case(name, group, surface, step, FOLDER)
        for name, group, surface, step in list_surfaces(FOLDER / "parts")
        if not names or name in names
    ]
    known = {(row.case, row.relative) for row in rows}
    try:
        for case in cases:
            if (case.name, float(relative)) in known:
                continue
            start = time.monotonic()
            rows += judge_case(case, float(relative), runners)
            versions |= {each.maker.name: each.version for each in runners if each.version}
            save(rows, versions, path)
            seconds = time.monotonic() - start
            print(f"{case.name} at {relative}: {seconds:.1f} s", file=sys.stderr, flush=True)
    finally:
        for runner in runners:
            runner.close()
    print(write_section(rows, versions))
    return 0


if __name__ == "__main__":
    pin_blas()
    share_heap()
    sys.exit(main(sys.argv[1:]))
