"""Judges closest points by exhaustive search, with none of the engine's code.

    python -m tools.judge.closest [points] [surfaces] [family …]      (make judge-queries)

It asks for 1000 points near each of 8 surfaces of every family: near and far, on the surface, and
close to it. A row counts nearer points than the interval allows (`outside`), reported points that
are not the nearest though the interval was reached (`wrong`), intervals that were not reached, and
points a second. The exit status is 1 if any point is outside or wrong.
"""

import sys
import time
from collections import Counter
from multiprocessing import Pool, cpu_count

import numpy as np

from service.engine.queries.project import ProjectQuery, project_on_surface
from service.settings.runtime import pin_blas
from tests.oracles.closest import nearest
from tests.oracles.sheets import Array, Sheet, sheets_of
from tools.certify.surfaces import FAMILIES

FIRST = 7000
"""Number of the first surface of a family: others than tests and `make certify` have."""


def strewn(sheets: list[Sheet], low: Array, high: Array, count: int, seed: int) -> Array:
    """Points within and beside a box, far away, on the sheets, and close to these."""
    rng = np.random.default_rng(seed)
    reach = float(np.linalg.norm(high - low))
    on = np.concatenate([sheet.at(sheet.samples(500)) + sheet.origin for sheet in sheets])
    each = max(1, count // 4)
    near, far = (rng.uniform(low - by * reach, high + by * reach, (each, 3)) for by in (0.3, 4))
    here = on[rng.integers(0, len(on), each)]
    rest = on[rng.integers(0, len(on), max(1, count - 3 * each))]
    return np.concatenate([near, far, here, rest + rng.normal(0, 1e-3 * reach, rest.shape)])


def judge(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The findings about one surface."""
    name, seed, count = case
    surface = FAMILIES[name].surface(seed)
    model, sheets = surface.lower(), sheets_of(surface)
    low, high = model.bounds
    points = strewn(sheets, low, high, count, seed)
    start = time.process_time()
    columns = project_on_surface(model, ProjectQuery(points))
    seconds = time.process_time() - start
    diagonal = float(np.linalg.norm(high - low))
    # What the samples themselves are wrong by.
    slack = 1e-15 * np.abs(points).max(axis=1) + 1e-14 * diagonal
    least = nearest(sheets, points)
    reached, bounds = columns["reached"], columns["distance_bounds"]
    away = np.linalg.norm(columns["positions"] - points, axis=1)
    wrong = reached & (columns["distances"] > least + 1e-9 * diagonal + slack)
    wrong |= np.abs(away - columns["distances"]) > 8 * slack
    outside = (least < bounds[:, 0] - slack) | (columns["distances"] > bounds[:, 1])
    return name, Counter(
        points=len(points), outside=int(outside.sum()), wrong=int(wrong.sum()),
        wider=int((~reached).sum()), tied=int(columns["tied"].sum()),
        milliseconds=round(1e3 * seconds),
    )  # fmt: skip


def main(arguments: list[str]) -> int:
    """Judges all, and prints a row for each family."""
    count, surfaces = (int(a) for a in (arguments + ["1000", "8"][len(arguments[:2]) :])[:2])
    names = arguments[2:] or list(FAMILIES)
    cases = [(name, FIRST + k, count) for k in range(surfaces) for name in names]
    totals: dict[str, Counter[str]] = {}
    with Pool(min(2, cpu_count()), pin_blas) as pool:
        for name, found in pool.imap_unordered(judge, cases):
            for kind in (name, "all"):
                totals.setdefault(kind, Counter()).update(found)
    columns = ("points", "outside", "wrong", "wider", "tied", "milliseconds")
    print(f"{'family':28}" + "".join(f"{column:>13}" for column in columns))
    for name in [*names, "all"]:
        print(f"{name:28}" + "".join(f"{totals[name][column]:13}" for column in columns))
    failed = totals["all"]["outside"] + totals["all"]["wrong"] > 0
    print("Something is wrong." if failed else "Nothing is wrong.")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
