"""Judges meshes of over 1,000 random surfaces and 1,000 parts, models and groups: `make certify`.

The program meshes every surface at four tolerances and one resolution, and every part (a brep),
model and group (surfaces placed by matrices) at one tolerance. It reads the files, and compares
them with samples of the surface. Ctrl-C ends the program, which then prints the findings so far.
The exit status is 1 if there are faults.

    python -m tools.certify [share] [family …]

`share` is the share of the surfaces and models that are judged, by default 1. The families are
those of the printed tables, by default all.
"""

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import cache
from multiprocessing import Pool, cpu_count
from typing import Literal, TypeAlias

from service.api.app import create_app
from service.settings.runtime import pin_blas
from service.settings.values import Settings
from tools.certify import groups
from tools.certify.closing import NEARLY_CLOSED, NearlyClosed, judge_nearly
from tools.certify.groups import judge_group
from tools.certify.judge import TOLERANCES, Case, Verdict, judge
from tools.certify.models import BODIES
from tools.certify.part_judge import PartFinding, judge_part
from tools.certify.parts import PARTS
from tools.certify.seams import SeamReport, judge_model
from tools.certify.surfaces import FAMILIES
from tools.certify.sweeps import SWEEPS, SweptFinding, judge_sweep
from tools.certify.table import Finding, write_rows
from tools.client import Client, start_client

JOINT_TOLERANCES = 3e-1, 3e-2, 3e-3
RESOLUTIONS = (1, 1), (4, 4), (3, 7), (16, 2), (6, 6)
MAX_SECONDS = 60
"""CPU seconds after which a task counts as failed."""

MAX_COMPLAINTS = 40
"""The largest number of complaints that are printed at the end."""

TWO_SIDED_EVERY, BINARY_EVERY = 6, 2
"""Every 6th surface is meshed with a bound in both directions, at tolerances of at least 1e-3.
Every 2nd mesh of a surface by tolerance is a GLB file, all other files are JSON."""


def list_cases(share: float, names: list[str]) -> Iterator[Case]:
    """The meshes of all surfaces, or of the named families: by tolerance and by resolution."""
    for name, family in FAMILIES.items():
        if names and name not in names:
            continue
        for seed in range(max(1, round(share * family.count))):
            for number, relative in enumerate(TOLERANCES):
                two_sided = seed % TWO_SIDED_EVERY == 0 and relative >= 1e-3
                is_binary = (seed + number) % BINARY_EVERY == 0
                yield Case(name, seed, relative, two_sided, "glb" if is_binary else "json")
            resolution = RESOLUTIONS[seed % len(RESOLUTIONS)]
            faces: Literal["triangles", "quads"] = "quads" if seed % 3 else "triangles"
            yield Case(name, seed, resolution=resolution, faces=faces)


def list_models(share: float, names: list[str]) -> Iterator[tuple[str, int, float]]:
    """All models, parts, nearly closed surfaces, sweeps and groups: family, seed, and a tolerance.

    The tolerance of a part comes from its generator.
    """
    families: list[tuple[str, int, tuple[float, ...]]] = [
        *[(kind, count, JOINT_TOLERANCES) for kind, (count, _) in BODIES.items()],
        *[(kind, family.size, (0.0,)) for kind, family in PARTS.items()],
        *[(kind, family.count, TOLERANCES[:3]) for kind, family in NEARLY_CLOSED.items()],
        *[(kind, family.count, TOLERANCES[:3]) for kind, family in SWEEPS.items()],
        ("groups", groups.COUNT, TOLERANCES[1:4]),
    ]
    for kind, count, tolerances in families:
        if not names or kind in names:
            for seed in range(max(1, round(share * count))):
                yield kind, seed, tolerances[seed % len(tolerances)]


Task: TypeAlias = Case | tuple[str, int, float]


def _get_seed(task: Task) -> int:
    return task.seed if isinstance(task, Case) else task[1]


def judge_task(task: Task) -> Finding:
    """The findings about one mesh, model or group; a task that takes too long has a fault."""
    signal.setitimer(signal.ITIMER_PROF, MAX_SECONDS)
    try:
        if isinstance(task, Case):
            return judge(task)
        if task[0] in PARTS:
            return judge_part(_start_client(), *task[:2])
        if task[0] in NEARLY_CLOSED:
            return judge_nearly(*task)
        if task[0] in SWEEPS:
            return judge_sweep(*task)
        return judge_group(*task[1:]) if task[0] == "groups" else judge_model(*task)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


_STACK = ExitStack()
"""Keeps the client of a process open until the process ends."""


@cache
def _start_client() -> Client:
    """The client of a process."""
    return _STACK.enter_context(start_client(create_app(Settings())))


def _raise_timeout(_signal: int, _frame: object) -> None:
    raise TimeoutError(f"more than {MAX_SECONDS} s")


def _prepare_worker() -> None:
    """Ignores Ctrl-C, which the parent handles; ends a task that takes too long."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGPROF, _raise_timeout)
    pin_blas()


def main(arguments: list[str]) -> int:
    """Judges all tasks in at most two processes and prints the tables; returns the exit status."""
    share = float(arguments[0]) if arguments else 1.0
    names = arguments[1:]
    # Sorted by seed, so that a run that ends early has judged some surfaces of each family.
    tasks: list[Task] = sorted(
        [*list_models(share, names), *list_cases(share, names)], key=_get_seed
    )
    findings: list[Finding] = []
    start = time.monotonic()
    pool = Pool(min(2, cpu_count()), _prepare_worker)
    try:
        for result in pool.imap_unordered(judge_task, tasks, chunksize=4):
            findings.append(result)
            for text in result.complaints():
                print(f"\r{text}", file=sys.stderr)
            if len(findings) % 50 == 0 or len(findings) == len(tasks):
                fault_count = sum(bool(each.faults) for each in findings)
                print(
                    f"\r{len(findings)} of {len(tasks)}, {fault_count} wrong, "
                    f"{time.monotonic() - start:.0f} s",
                    end="",
                    file=sys.stderr,
                    flush=True,
                )
    except KeyboardInterrupt:
        pool.terminate()
    print(file=sys.stderr)
    return print_report(findings)


def print_report(findings: list[Finding]) -> int:
    """Prints the tables and the complaints; returns 1 if there are complaints."""
    order = {
        name: number
        for number, name in enumerate(
            [*FAMILIES, *BODIES, *PARTS, *NEARLY_CLOSED, *SWEEPS, "groups"]
        )
    }
    findings.sort(key=lambda each: (order[each.kind], each.seed, -each.tolerance))
    models_and_groups = [each for each in findings if isinstance(each, SeamReport)]
    parts = [each for each in findings if isinstance(each, PartFinding)]
    nearly_closed = [each for each in findings if isinstance(each, NearlyClosed)]
    swept = [each for each in findings if isinstance(each, SweptFinding)]
    verdicts = [each for each in findings if isinstance(each, Verdict)]
    by_tolerance = [v for v in verdicts if v.case.resolution is None]
    by_resolution = [v for v in verdicts if v.case.resolution is not None]
    for title, rows, counts in (
        ("family", by_tolerance, ("missed", "bad", "excused")),
        ("by resolution", by_resolution, ()),
        ("models", models_and_groups, ("seams", "boundary")),
        ("parts", parts, ()),
        ("equal up to rounding", nearly_closed, ("closed",)),
        ("tubes and ribbons", swept, ("refused",)),
    ):
        if rows:
            print("\n".join([*write_rows(title, rows, counts), ""]))
    two_sided_verdicts = [v for v in by_tolerance if v.case.two_sided and v.mesh_bound > 0]
    if two_sided_verdicts:
        max_ratio = max(v.mesh_deviation / v.mesh_bound for v in two_sided_verdicts)
        print(
            f"{len(two_sided_verdicts)} two-sided meshes: "
            f"found/bound from mesh to surface at most {max_ratio:.3f}"
        )
    complaints = [text for each in findings for text in each.complaints()]
    omitted = (
        [f"… and {len(complaints) - MAX_COMPLAINTS} more"]
        if len(complaints) > MAX_COMPLAINTS
        else []
    )
    print(
        "\n".join(
            ["", *complaints[:MAX_COMPLAINTS], *omitted]
            if complaints
            else ["", "Nothing is wrong."]
        )
    )
    return int(bool(complaints))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
