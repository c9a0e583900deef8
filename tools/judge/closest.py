"""Judges the engine's closest points by exhaustive search and by convex hulls.

    python -m tools.judge.closest [points] [surfaces] [family …]      (make judge-queries)

The engine computes the closest points of 4500 points for each of 8 surfaces of every family, and
for the examples; the judge has none of its code. The points are in the box, beside it, far away, on
the surface, close to it, on its normals up to ten diagonals away, and midway between two points of
the surface. For each point, the engine returns a point of the surface, its distance, and an
interval that contains the least distance. A row has these counts. `outside`: the judge found a
nearer point than the interval allows, or the returned distance is above it. `wrong`: the engine
says that its interval is narrow enough, but the returned point is not the nearest; or the returned
distance is not that of the returned point. `wider`: the engine says that its interval is not narrow
enough. `tied`: several points may be the nearest. Every 10th point is also judged by an interval
that certainly contains the least distance (`enclosed`): the two intervals must overlap, else the
point is `outside`. `undecided`: computing that interval takes too many pieces, as for lines. The
exit status is 1 if any point is outside or wrong.
"""

import sys
import time
from collections import Counter
from multiprocessing import Pool, cpu_count

import numpy as np

from oracles.closest import find_nearest
from oracles.sheets import Array, Sheet, build_sheets
from service.engine.closest.project import ProjectQuery, project_on_surface
from service.engine.models import to_patches
from service.settings.runtime import pin_blas
from service.surface.examples.catalogue import EXAMPLES as ALL_EXAMPLES
from service.surface.examples.catalogue import find
from tools.certify.surfaces import FAMILIES
from tools.judge.__main__ import write_document
from tools.judge.enclosures import enclose_least_distances
from tools.judge.exact import list_nets

FIRST_SEED = 7000
"""Seed of the first surface of a family; tests and `make certify` use other seeds."""

ENCLOSED_EVERY, WIDTH = 10, 1e-9
"""Every 10th point is judged by an interval of this width, in diagonals."""

EXAMPLES = tuple(name for name in ALL_EXAMPLES if name not in ("trefoil-tube", "ribbon", "hair"))
"""The examples that are made of patches."""


def scatter_points(sheets: list[Sheet], low: Array, high: Array, count: int, seed: int) -> Array:
    """About `count` points (n, 3): as many of each of the seven kinds that the module names.

    `low` and `high` (3,) are the corners of the bounding box.
    """
    rng = np.random.default_rng(seed)
    reach = float(np.linalg.norm(high - low))
    of_each = max(1, count // 7)
    points_in_boxes = [
        rng.uniform(low - margin * reach, high + margin * reach, (of_each, 3))
        for margin in (0, 0.3, 4)
    ]
    samples, normals = (
        np.concatenate(arrays) for arrays in zip(*map(_sample_normals, sheets), strict=True)
    )
    first, second, third, fourth = (rng.integers(0, len(samples), of_each) for _ in range(4))
    heights = reach * rng.choice([-1, 1], of_each) * 10.0 ** rng.uniform(-3, 1, of_each)
    return np.concatenate(
        [
            *points_in_boxes,
            samples[first],
            samples[third] + rng.normal(0, 1e-3 * reach, (of_each, 3)),
            samples[fourth] + heights[:, np.newaxis] * normals[fourth],
            (samples[first] + samples[second]) / 2,
        ]
    )


def _sample_normals(sheet: Sheet) -> tuple[Array, Array]:
    """Points of a sheet, and its approximate unit normals there."""
    places = sheet.samples(500)
    points = sheet.at(places)
    du, dv = (sheet.at(sheet.clip_to_domain(places + 1e-6 * axis)) - points for axis in np.eye(2))
    normals = np.cross(du, dv)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(lengths > 0, lengths, 1.0)
    return points + sheet.origin, normals


def judge(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The findings about one surface: a family or example, its seed, and the number of points."""
    name, seed, count = case
    surface = FAMILIES[name].surface(seed) if name in FAMILIES else None
    model = to_patches((surface or find(name).surface()).lower())
    sheets = build_sheets(surface or model)
    low, high = model.bounds
    points = scatter_points(sheets, low, high, count, seed)
    start = time.process_time()
    columns = project_on_surface(model, ProjectQuery(points))
    seconds = time.process_time() - start
    diagonal = float(np.linalg.norm(high - low))
    # Rounding errors of the judge's samples.
    slack = 1e-15 * np.abs(points).max(axis=1) + 1e-14 * diagonal
    least_distances = find_nearest(sheets, points)
    reached, bounds = columns["reached"], columns["distance_bounds"]
    position_distances = np.linalg.norm(columns["positions"] - points, axis=1)
    is_wrong = reached & (columns["distances"] > least_distances + 1e-9 * diagonal + slack)
    is_wrong |= np.abs(position_distances - columns["distances"]) > 8 * slack
    is_outside = least_distances < bounds[:, 0] - slack
    is_outside |= columns["distances"] > bounds[:, 1]
    enclosed = undecided = 0
    if surface:
        rows = np.arange(seed % ENCLOSED_EVERY, len(points), ENCLOSED_EVERY)
        origin = (low + high) / 2
        nets = [net.astype(np.float64) for net in list_nets(write_document(surface), origin)]
        lows, highs = enclose_least_distances(nets, points[rows] - origin, WIDTH * diagonal)
        is_outside[rows] |= bounds[rows, 1] + slack[rows] < lows
        is_outside[rows] |= bounds[rows, 0] > highs
        undecided = int(np.isnan(highs).sum())
        enclosed = len(rows) - undecided
    if (is_outside | is_wrong).any():
        numbers = np.flatnonzero(is_outside | is_wrong)[:9].tolist()
        print(f"{name}, {seed}: points {numbers}", flush=True)
    return name, Counter(
        points=len(points), outside=int(is_outside.sum()), wrong=int(is_wrong.sum()),
        wider=int((~reached).sum()), enclosed=enclosed, undecided=undecided,
        tied=int(columns["tied"].sum()),
        milliseconds=round(1e3 * seconds),
    )  # fmt: skip


def main(arguments: list[str]) -> int:
    """Judges all surfaces; prints a row for each family."""
    count = int(arguments[0]) if arguments else 4500
    surface_count = int(arguments[1]) if len(arguments) > 1 else 8
    names = arguments[2:] or [*FAMILIES, *EXAMPLES]
    cases = [
        (name, FIRST_SEED + k, count)
        for k in range(surface_count)
        for name in names
        if name in FAMILIES or k == 0
    ]
    totals: dict[str, Counter[str]] = {}
    with Pool(min(2, cpu_count()), pin_blas) as pool:
        for name, counts in pool.imap_unordered(judge, cases):
            print(f"{name}: {dict(counts)}", file=sys.stderr, flush=True)
            for kind in (name, "all"):
                totals.setdefault(kind, Counter()).update(counts)
    columns = (
        "points", "outside", "wrong", "wider", "enclosed", "undecided", "tied", "milliseconds"
    )  # fmt: skip
    print(f"{'family':28}" + "".join(f"{column:>13}" for column in columns))
    for name in [*names, "all"]:
        print(f"{name:28}" + "".join(f"{totals[name][column]:13}" for column in columns))
    has_faults = totals["all"]["outside"] + totals["all"]["wrong"] > 0
    print("Something is wrong." if has_faults else "Nothing is wrong.")
    return int(has_faults)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
