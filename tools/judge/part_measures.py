"""Judges `/v1/measure` on parts: areas, volumes and centroids.

    python -m tools.judge.part_measures [PYTHON] [case …]      (make judge-queries)

The judge computes the measures by Green's theorem (`oracles.part_measures`). An interval is wrong
if it does not hold this value, up to the error of the judge; where parameter curves of the part are
wrong or missing, up to the area between edges and regions. The valid solids of the tests are also
written as STEP files, and measured by Open CASCADE in PYTHON, a Python in which cadquery-ocp is
installed: the file, and the solid that the document was made from. An interval, widened by 1e-8 of
its value, must hold one of these values. Where none is in it, but the judge's is, the line is
marked as disputed: over some splines Open CASCADE integrates less exactly than it is asked to.

The columns are the relative widths of intervals, and how far beyond them, relatively, the values of
the judge (`judge`) and of Open CASCADE (`file`, `model`) are; negative inside. A value of the judge
is missing if its error is large. The exit status is 1 if anything is wrong.
"""

import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from multiprocessing import Pool, cpu_count
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from oracles.brep_documents import Array
from oracles.part_measures import measure_part
from oracles.solids import VALID, read_solid
from service.api.app import create_app
from service.encoders.cad.registry import DEFINITIONS_BY_NAME
from service.settings.runtime import pin_blas
from tools.client import start_client
from tools.judge.judged_part import SETTINGS, JudgedPart, Refused, open_case, validate
from tools.judge.part_cases import build_case, list_names

EXACT = MappingProxyType({("solid viviani", "volume"): 2000 / 3 * (math.pi - 4 / 3)})
"""Values of closed forms, by case and quantity, where the judge's error is large."""

TOLERANCE = 1e-8
"""The relative width of intervals that is asked for; if it is refused, the default is."""

WIDER = 1e-8
"""Share of its value by which an interval is widened for Open CASCADE."""

UNSURE = 1e-6
"""The largest error of the judge, as a share of the value, with which it says anything."""

ROUNDING = 1e-12
"""Error of the judge, as a share of the value."""

SEEDS = 2
"""Parts of each family."""

SAMPLES = 400
"""Samples of parts, by which only the lengths of borders are measured."""

NAMES = ("area", "volume")


class Row(NamedTuple):
    """The result for one part.

    `intervals` are low and high of area and volume; without volume, of the area alone. `beyond` is
    how far beyond them the values of the judge are, less their errors; negative inside, and missing
    if the error is large. `faults` are lines about all that is wrong.
    """

    name: str
    intervals: dict[str, tuple[float, float]]
    beyond: dict[str, float]
    faults: list[str]


def judge_case(name: str) -> Row:
    """The measures of one part, compared with those of the judge."""
    with start_client(create_app(SETTINGS)) as client:
        judged = open_case(build_case(name), client, SAMPLES)
        try:
            answer = _ask(judged)
        except Refused as error:
            return Row(name, {}, {}, [f"{name}: {error}"])
    return compare(judged, answer)


def _ask(judged: JudgedPart) -> Any:
    try:
        return judged.ask("measure", tolerance=TOLERANCE)
    except Refused:
        return judged.ask("measure")


def compare(judged: JudgedPart, answer: Any) -> Row:
    """The intervals of an answer, and how far beyond them the values of the judge are."""
    name = judged.case.name
    origin = judged.part.corners.mean(axis=0)
    measured = measure_part(judged.part, origin)
    slack = measured.errors + ROUNDING * np.abs(measured.values)
    if judged.case.truth is not None:
        # The judge has other parameter curves: regions differ by strips beside the edges.
        area_slack = 2 * float((judged.gaps * measure_borders(judged)).sum())
        slack[0] += area_slack
        slack[1:] += area_slack * judged.diagonal
    if judged.case.is_closed:
        # The volume of a closed part is that about any origin, up to errors of the judge's loops.
        others = [measure_part(judged.part, origin + judged.diagonal * axis) for axis in np.eye(3)]
        drift = max(abs(float(each.values[1] - measured.values[1])) for each in others)
        slack[1] += drift
        slack[2:] += drift * judged.diagonal
    rows, beyond, faults = {}, {}, []
    for k, key in enumerate(NAMES):
        if key not in answer:
            continue
        low, high = rows[key] = answer[key]["low"], answer[key]["high"]
        value = float(measured.values[k])
        if (name, key) in EXACT:
            value, slack[k] = EXACT[name, key], 0.0
        if slack[k] > UNSURE * abs(value):
            continue
        beyond[key] = (max(low - value, value - high) - float(slack[k])) / abs(value)
        if not beyond[key] <= 0:
            faults.append(f"{name}: {key} [{low!r}, {high!r}], judge {value!r} ± {slack[k]:.2g}")
    if judged.case.is_closed and "volume" not in answer:
        faults.append(f"{name}: without a volume")
    if "centroid" in answer and "volume" in beyond:
        faults += list(_compare_centroids(name, answer, origin, measured.values, slack))
    return Row(name, rows, beyond, faults)


def _compare_centroids(
    name: str, answer: Any, origin: Array, values: Array, slack: Array
) -> Sequence[str]:
    faults = []
    volume = values[1]
    for axis in range(3):
        value = float(origin[axis] + values[2 + axis] / volume)
        offset = abs(value - float(origin[axis]))
        error = float((slack[2 + axis] + offset * slack[1]) / abs(volume))
        error += ROUNDING * (abs(value) + float(np.abs(origin).max()))
        low, high = answer["centroid"][axis]["low"], answer["centroid"][axis]["high"]
        if not low - error <= value <= high + error:
            faults.append(
                f"{name}: centroid {axis} [{low!r}, {high!r}], judge {value!r} ± {error:.2g}"
            )
    return faults


def measure_borders(judged: JudgedPart) -> Array:
    """The lengths (F,) of the borders of each face, by chords."""
    lengths = [
        float(np.linalg.norm(np.diff(each.points, axis=0), axis=1).sum())
        for each in judged.search.borders
    ]
    return np.array([sum(lengths[k] for k in face.borders) for face in judged.part.faces])


Others: TypeAlias = dict[str, dict[str, list[float]]]
"""Values of Open CASCADE by `file` and `model`, and then by quantity."""


def ask_open_cascade(python: str) -> dict[str, Others]:
    """The values of all valid solids, by case."""
    form = DEFINITIONS_BY_NAME["step"]
    with tempfile.TemporaryDirectory() as folder:
        for name in VALID:
            surface = validate(read_solid(name)).to_surface()
            written = form.encode(surface.lower(), surface.unit, lambda _: None)
            (Path(folder) / f"{name}.step").write_bytes(bytes(written.content))
        command = [python, "-m", "tools.judge.measures_worker", folder]
        result = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [json.loads(each) for each in result.stdout.splitlines() if each.startswith('{"name"')]
    return {f"solid {line.pop('name')}": line for line in lines}


def compare_others(row: Row, others: Others) -> tuple[dict[str, float], list[str], list[str]]:
    """How far beyond the intervals the values of Open CASCADE are; faults, and disputed lines.

    Of two values of one quantity, that counts which is less far beyond.
    """
    result: dict[str, float] = {}
    faults: list[str] = []
    disputed: list[str] = []
    for key, (low, high) in row.intervals.items():
        apart = {
            kind: min(max(low - value, value - high) / abs(value) for value in values[key])
            for kind, values in others.items()
        }
        result |= {f"{key} {kind}": each for kind, each in apart.items()}
        if apart and min(apart.values()) > WIDER:
            line = f"{row.name}: {key} [{low!r}, {high!r}], Open CASCADE {others}"
            (disputed if row.beyond.get(key, np.inf) <= 0 else faults).append(line)
    return result, faults, disputed


def main(arguments: Sequence[str]) -> int:
    """Judges all parts; prints a row for each."""
    python = [each for each in arguments[:1] if Path(each).is_file()]
    names = arguments[len(python) :] or list_names(SEEDS)
    others = ask_open_cascade(python[0]) if python else {}
    faults: list[str] = []
    disputed: list[str] = []
    head = [f"{key} {kind}" for key in NAMES for kind in ("width", "judge", "file", "model")]
    print(f"{'':24}" + "".join(f"{each:>14}" for each in head))
    with Pool(min(2, cpu_count()), pin_blas) as pool:
        for row in pool.imap_unordered(judge_case, names):
            apart, more, some = compare_others(row, others.get(row.name, {}))
            faults += row.faults + more
            disputed += [f"{line} (disputed)" for line in some]
            cells = ""
            for key in NAMES:
                low, high = row.intervals.get(key, (np.nan, np.nan))
                values = [(high - low) / max(abs(low), abs(high)), row.beyond.get(key, np.nan)]
                values += [apart.get(f"{key} {kind}", np.nan) for kind in ("file", "model")]
                cells += "".join(f"{value:14.2e}" for value in values)
            print(f"{row.name:24}{cells}", flush=True)
    print("\n".join([*disputed, *faults, "Something is wrong." if faults else "Nothing is wrong."]))
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
