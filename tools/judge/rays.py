"""Judges hits of rays by closed forms and by exhaustive search, without the engine's code.

    python -m tools.judge.rays [rays] [surfaces] [family …]      (make judge-queries)

It sends 1000 rays through each of 8 surfaces of every family and of two examples: from outside,
from inside, along two points of the surface, and along axes; 25 times as many through the teapot,
and 50 times as many to the sphere and the torus, whose true hits are roots of polynomials; half of
these rays are almost tangent. A row counts crossings outside all intervals of their ray (`missed`),
hits that are not on the ray and the surface (`invented`), rays that were not reached, and kinds of
hits. The exit status is 1 if any hit is missed or invented.
"""

import sys
import time
from collections import Counter
from multiprocessing import Pool, cpu_count
from typing import Any

import numpy as np

from service.bases.arrays import Bools
from service.engine.models import to_patches
from service.engine.queries.intersect import RayQuery, intersect_rays
from service.settings.runtime import pin_blas
from service.surface.examples import find
from service.surface.lowered import PatchModel
from tests.oracles.quadrics import sphere, torus
from tests.oracles.rays import Ints, find_crossings
from tests.oracles.sheets import Array, build_sheets
from tools.certify.surfaces import FAMILIES
from tools.judge.roots import find_sphere_roots, find_torus_roots

FIRST = 8000
"""Seed of the first surface of a family; tests and `make certify` use other seeds."""

EXAMPLES = ("utah-teapot", "octahedral-sphere", "nurbs-goblet")
EXACT = {"sphere": (sphere, find_sphere_roots), "torus": (torus, find_torus_roots)}
TIMES = {"utah-teapot": 25, "sphere": 50, "torus": 50}
"""Factors of the number of rays, by example."""


def scatter_rays(model: PatchModel, points: Array, count: int, seed: int) -> tuple[Array, Array]:
    """Rays towards points in the box and towards points of the surface; half of the latter are
    tangent."""
    rng = np.random.default_rng(seed)
    low, high = model.bounds
    reach = float(np.linalg.norm(high - low))
    origins = (low + high) / 2 + rng.normal(0, reach, (count, 3)) * rng.choice([0.1, 1], (count, 1))
    at = rng.uniform(low, high, (count, 3))
    on = points[rng.integers(0, len(points), count)]
    draw = rng.random(count)
    at = np.where((draw < 0.4)[:, np.newaxis], on, at)
    beside = points[rng.integers(0, len(points), count)]
    origins = np.where((draw < 0.1)[:, np.newaxis], 3 * at - 2 * beside, origins)
    axis = np.eye(3)[rng.integers(0, 3, count)] * reach
    origins = np.where((draw > 0.9)[:, np.newaxis], at - axis, origins)
    directions = at - origins
    still = ~directions.any(axis=1)
    directions[still] = [0.0, 0, 1]
    return origins, directions


def find_unheld(
    ray: Ints, t: Array, slack: Array, rays: Ints, intervals: tuple[Array, Array]
) -> Bools:
    """Whether each value t (n,) is outside all intervals of its ray; `rays` is sorted."""
    firsts, lasts = (np.searchsorted(rays, ray, side) for side in ("left", "right"))
    held = np.zeros(len(ray), bool)
    low, high = intervals
    for k in range(int((lasts - firsts).max(initial=0))):
        row = np.minimum(firsts + k, max(len(low) - 1, 0))
        held |= (firsts + k < lasts) & (low[row] - slack <= t) & (t <= high[row] + slack)
    return ~held


def judge(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The findings about one surface."""
    name, seed, count = case
    surface = find(name).surface() if name in EXAMPLES else FAMILIES[name].surface(seed)
    model = to_patches(surface.lower())
    sheets = build_sheets(model)
    points = np.concatenate([s.at(s.samples(200)) + s.origin for s in sheets])
    origins, directions = scatter_rays(model, points, count, seed)
    start = time.process_time()
    hits = intersect_rays(model, RayQuery(origins, directions, False), 10**7)
    seconds = time.process_time() - start
    length = np.linalg.norm(directions, axis=1)
    ray, t, error = find_crossings(sheets, origins, directions, 12_000)
    error += (1e-12 * (model.diagonal + np.linalg.norm(origins, axis=1)) / length)[ray]
    is_judged = hits["reached"][ray]
    ray, t, error = ray[is_judged], t[is_judged], error[is_judged]
    lost = find_unheld(ray, t, error, hits["ray"], tuple(hits["t_bounds"].T))
    _print_missed(name, seed, ray[lost])
    ours = hits["ray"]
    places = origins[ours] + hits["t"][:, np.newaxis] * directions[ours]
    away = np.linalg.norm(places - hits["positions"], axis=1)
    invented = away > 1e-9 * model.diagonal + 2e-16 * np.abs(origins[ours]).max(axis=1)
    return name, _count_results(hits, len(origins), int(lost.sum()), invented, seconds)


def _print_missed(name: str, seed: int, rays: Ints) -> None:
    if len(rays):
        print(f"{name}, {seed}: rays {np.unique(rays)[:9].tolist()}", flush=True)


def _count_results(
    hits: dict[str, Any], rays: int, lost: int, invented: Bools, seconds: float
) -> Counter[str]:
    kinds = Counter(list(hits["kind"]))
    return Counter(
        rays=rays, hits=len(hits["t"]), missed=lost, invented=int(invented.sum()),
        wider=int((~hits["reached"]).sum()), touching=kinds["touching"], along=kinds["along"],
        milliseconds=round(1e3 * seconds),
    )  # fmt: skip


def judge_exactly(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The findings about the sphere or the torus: compares its roots with the hits."""
    name, seed, count = case
    model = to_patches(find(name).surface().lower())
    off, roots = EXACT[name]
    origins, d = draw_almost_tangent(name, count, seed)
    start = time.process_time()
    hits = intersect_rays(model, RayQuery(origins, d, False), 10**7)
    seconds = time.process_time() - start
    ray, t = hits["ray"], hits["t"]
    true_ray, true, error = roots(origins, d)
    error += 1e-12
    lost = find_unheld(true_ray, true, error, ray, tuple(hits["t_bounds"].T))
    lost &= hits["reached"][true_ray]
    _print_missed(name, seed, true_ray[lost])
    places = origins[ray] + t[:, np.newaxis] * d[ray]
    invented = np.abs(off(places)[0]) > 2e-9 * model.diagonal
    # A crossing is more than a touch: its interval contains a root.
    order = np.lexsort((true, true_ray))
    ends = true[order] - error[order], true[order] + error[order]
    low, high = hits["t_bounds"].T
    is_root = ~find_unheld(ray, (low + high) / 2, (high - low) / 2, true_ray[order], ends)
    invented |= (np.asarray(hits["kind"]) == "crossing") & ~is_root
    _print_missed(name, seed, ray[invented])
    return name, _count_results(hits, count, int(lost.sum()), invented, seconds)


def draw_almost_tangent(name: str, count: int, seed: int) -> tuple[Array, Array]:
    """Rays of unit directions through points of the sphere or the torus, half almost tangent."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    normals = points
    if name == "torus":
        turn, tilt = rng.uniform(0, 2 * np.pi, (2, count))
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        normals = points * np.cos(tilt)[:, np.newaxis] + np.outer(np.sin(tilt), [0, 0, 1])
        points = points + 0.4 * normals
    d = rng.normal(size=(count, 3))
    is_grazing = rng.random(count) < 0.5
    d[is_grazing] = np.cross(normals[is_grazing], d[is_grazing])
    depth = rng.choice([-1, 1], count) * 10.0 ** rng.uniform(-10, 0, count)
    points = points - np.where(is_grazing, depth, 0.0)[:, np.newaxis] * normals
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return points - 4 * d, d


def _judge_any(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    return (judge_exactly if case[0] in EXACT else judge)(case)


def main(arguments: list[str]) -> int:
    """Judges all surfaces; prints a row for each family."""
    count, surfaces = (int(a) for a in (arguments + ["1000", "8"][len(arguments[:2]) :])[:2])
    names = arguments[2:] or [*FAMILIES, *EXAMPLES, "sphere", "torus"]
    cases = [(n, FIRST + k, TIMES.get(n, 1) * count) for k in range(surfaces) for n in names]
    totals: dict[str, Counter[str]] = {}
    with Pool(min(2, cpu_count()), pin_blas) as pool:
        for name, counts in pool.imap_unordered(_judge_any, cases):
            print(f"{name}: {dict(counts)}", file=sys.stderr, flush=True)
            for kind in (name, "all"):
                totals.setdefault(kind, Counter()).update(counts)
    columns = ("rays", "hits", "missed", "invented", "wider", "touching", "along", "milliseconds")
    print(f"{'family':28}" + "".join(f"{column:>13}" for column in columns))
    for name in [*names, "all"]:
        print(f"{name:28}" + "".join(f"{totals[name][column]:13}" for column in columns))
    failed = totals["all"]["missed"] + totals["all"]["invented"] > 0
    print("Something is wrong." if failed else "Nothing is wrong.")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
