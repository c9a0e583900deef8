"""Judges questions to whole parts by exhaustive search, and by closed forms where there are some.

    python -m tools.judge.parts [--quick] [--only=inside,closest,rays] [points] [rays] [case …]

The parts are the valid solids of the tests, solids of closed form, generated parts of every family
(holes near borders, poles, seams, voids, faces 1e-6 wide, gaps) and groups. Each gets its share of
100,000 points and 100,000 rays; `part_points`, `part_closest` and `part_rays` say what is wrong and
what the columns mean. Each column begins with its question. With `--quick`, two small parts get a
few points and rays. The exit status is 1 if any answer is wrong or refused. A line about a fault
begins with the case, from which `python -m tools.judge.parts 1000 1000 "gaps 9000"` makes the same
questions again, if the numbers of points and rays of the case are the same. `make judge-queries`
runs all.
"""

import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from multiprocessing import Pool, cpu_count
from types import MappingProxyType
from typing import TypeAlias

from service.api.app import create_app
from service.settings.runtime import pin_blas
from tools.client import start_client
from tools.judge.findings import Findings
from tools.judge.judged_part import SAMPLES, SETTINGS, JudgedPart, Refused, open_case
from tools.judge.part_cases import build_case, list_names
from tools.judge.part_closest import judge_closest
from tools.judge.part_points import judge_points
from tools.judge.part_rays import judge_rays

POINTS, RAYS, SEEDS = 100_000, 100_000, 3
"""Points and rays of all parts together; parts of each family."""

QUICK = ("solid box", "thin parts 9000")
"""The parts of `--quick`."""

QUESTIONS = ("inside", "closest", "rays")
"""The questions that are judged by default."""

SEED = 37
"""The seed of all questions."""

COLUMNS = (
    *("inside places", "inside null", "inside unsure", "inside wrong"),
    *("closest points", "closest wider", "closest near_edge", "closest far", "closest null"),
    *("closest judged", "closest wrong"),
    *("rays rays", "rays hits", "rays certain", "rays unreached", "rays near_edge", "rays wrong"),
    "refused",
)
"""Question and count of each column."""


Question: TypeAlias = Callable[[JudgedPart, int, int], Findings]

JUDGES: Mapping[str, Question] = MappingProxyType(
    {"inside": judge_points, "closest": judge_closest, "rays": judge_rays}
)
"""By question, the function that judges a part with a number of points or rays, and a seed."""


def judge_case(
    name: str, *, numbers: Mapping[str, int], samples: int = SAMPLES
) -> tuple[str, Counter[str], list[str], float]:
    """The counts of a case, lines about faults, and the largest width of an interval.

    `numbers` are the numbers of points or rays of each question.
    """
    start = time.process_time()
    counts: Counter[str] = Counter()
    lines: list[str] = []
    width = 0.0
    with start_client(create_app(SETTINGS)) as client:
        judged = open_case(build_case(name), client, samples)
        for question, number in numbers.items():
            try:
                findings = JUDGES[question](judged, number, SEED)
            except Refused as error:
                counts["refused"] += 1
                lines.append(f"{name}: {error}")
                continue
            except Exception:
                # A fault of the judge must not hide what it found in other parts.
                counts["refused"] += 1
                lines.append(f"{name}: {question}: {traceback.format_exc()}")
                continue
            counts += Counter({f"{question} {key}": n for key, n in findings.counts.items()})
            lines += findings.lines
            width = max(width, findings.width)
    counts["seconds"] = round(time.process_time() - start)
    return name, counts, lines, width


def main(arguments: list[str]) -> int:
    """Judges all parts; prints a row for each family, and lines about faults."""
    is_quick = "--quick" in arguments
    only = [each.removeprefix("--only=") for each in arguments if each.startswith("--only=")]
    questions = only[0].split(",") if only else QUESTIONS
    arguments = [each for each in arguments if not each.startswith("--")]
    given = [int(each) for each in arguments if each.isdigit()]
    names = [each for each in arguments if not each.isdigit()]
    names = names or list(QUICK if is_quick else list_names(SEEDS))
    points, rays = (-(-n // len(names)) for n in (*given, *(POINTS, RAYS)[len(given) :]))
    if is_quick:
        points, rays = 20, 12
    numbers = {each: rays if each == "rays" else points for each in questions}
    work = partial(judge_case, numbers=numbers, samples=2000 if is_quick else SAMPLES)
    totals: dict[str, Counter[str]] = {}
    widths: dict[str, float] = {}
    lines: list[str] = []
    with Pool(1 if is_quick else min(2, cpu_count()), pin_blas) as pool:
        for name, counts, some, width in pool.imap_unordered(work, names):
            print(f"{name}: {dict(counts)}", file=sys.stderr, flush=True)
            lines += some
            family = name.rpartition(" ")[0] if name.rpartition(" ")[2].isdigit() else name
            for row in (family, "all"):
                totals.setdefault(row, Counter()).update(counts)
                widths[row] = max(widths.get(row, 0.0), width)
    print_table(totals, widths)
    print("\n".join(lines))
    has_faults = any(totals["all"][c] for c in COLUMNS if c.endswith(("wrong", "refused")))
    print("Something is wrong." if has_faults else "Nothing is wrong.")
    return int(has_faults)


def print_table(totals: Mapping[str, Counter[str]], widths: Mapping[str, float]) -> None:
    """Prints a row for each family of parts, and one for all; in two lines the head."""
    columns = [column for column in COLUMNS if column in totals["all"] or " " not in column]
    heads = [column.partition(" ") for column in [*columns, "closest width"]]
    for line in (0, 2):
        print(f"{'':22}" + "".join(f"{head[line]:>10}" for head in heads))
    for row in [*(row for row in totals if row != "all"), "all"]:
        cells = "".join(f"{totals[row][column]:10}" for column in columns)
        print(f"{row:22}{cells}{widths[row]:10.3g}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
