"""Compares the judge's intervals with dense samples, for a thousand meshes: `make judge-meshes`.

    python -m tools.judge_meshes [share] [kind or family …]

`share` is the share of the meshes that are judged. Each mesh is one of the service, as it is, or
decimated, displaced or with holes; or of Open CASCADE, if it is installed. The exit status is 1 if
an interval does not hold.
"""

import sys
import time
from collections import Counter
from collections.abc import Sequence
from multiprocessing import Pool, cpu_count
from typing import NamedTuple

from service.errors import SurfaceError
from service.settings.runtime import pin_blas
from tools.judge_meshes.cases import OF_EACH, Case, build_mesh, build_surface, list_cases
from tools.judge_meshes.compare import check, find_faults


class Finding(NamedTuple):
    """The findings about a mesh; `width` is the larger width of both intervals."""

    case: Case
    text: str
    faults: tuple[str, ...]
    triangles: int = 0
    seconds: float = 0.0
    limit: str = ""
    is_refused: bool = False


def judge_case(case: Case) -> Finding:
    """The findings about a mesh; a refused surface or mesh is one too."""
    text = ""
    try:
        surface, truth = build_surface(case)
        text, mesh, query = build_mesh(case, surface)
        start = time.process_time()
        answer = check(surface, mesh, query)
        seconds = time.process_time() - start
        faults = tuple(find_faults(answer, mesh, truth, query))
    except SurfaceError as error:
        return Finding(case, text, (), is_refused=True, limit=str(error)[:100])
    except Exception as error:  # any other error is a fault
        return Finding(case, text, (f"{type(error).__name__}: {error}"[:300],))
    limit = "" if answer["reached"] else answer["limit"]
    return Finding(case, text, faults, len(mesh.triangles), seconds, limit)


def main(arguments: Sequence[str]) -> int:
    """Judges all meshes; prints a row for each family, and all faults."""
    share = float(arguments[0]) if arguments else 1.0
    names = arguments[1:]
    cases = [
        case for case in list_cases(share) if not names or {case.kind, case.family} & set(names)
    ]
    totals: dict[str, Counter[str]] = {}
    lines = []
    start = time.monotonic()
    with Pool(min(2, cpu_count()), pin_blas) as pool:
        for finding in pool.imap_unordered(judge_case, cases, chunksize=OF_EACH):
            row = Counter(
                meshes=1, triangles=finding.triangles, refused=finding.is_refused,
                open=bool(finding.limit) and not finding.is_refused, wrong=bool(finding.faults),
                milliseconds=round(1e3 * finding.seconds),
            )  # fmt: skip
            for name in (f"{finding.case.kind}: {finding.case.family}", "all"):
                totals.setdefault(name, Counter()).update(row)
            texts = [f"{finding.case}, {finding.text}: {fault}" for fault in finding.faults]
            lines += texts
            for line in texts:
                print(line, file=sys.stderr, flush=True)
            if finding.is_refused:
                print(f"{finding.case}: refused: {finding.limit}", file=sys.stderr, flush=True)
            if totals["all"]["meshes"] % 50 == 0:
                seconds = time.monotonic() - start
                print(f"{dict(totals['all'])}, {seconds:.0f} s", file=sys.stderr, flush=True)
    columns = "meshes", "triangles", "refused", "open", "wrong", "milliseconds"
    print(f"{'family':36}" + "".join(f"{name:>13}" for name in columns))
    for name in sorted(totals, key=lambda each: (each == "all", each)):
        print(f"{name:36}" + "".join(f"{totals[name][column]:13}" for column in columns))
    print("\n".join([*lines, "Something is wrong." if lines else "Nothing is wrong."]))
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
