"""Judges the engine's hits of rays by closed forms and by exhaustive search.

    python -m tools.judge.rays [rays] [surfaces] [family …]      (make judge-queries)

It sends 1000 rays through each of 8 surfaces of every family and of three examples: from outside,
from inside, through two points of the surface, and along axes; 25 times as many through the teapot.
It sends 50 times as many rays to the sphere and the torus, whose true hits are roots of
polynomials; half of these rays are almost tangent. A row has these counts. `missed`: crossings that
no interval of their ray contains. `invented`: hits whose point on the ray is not the point of the
surface that the engine computed for them; for the sphere and the torus, points that are not on
their surface, and crossings without a root. `unreached`: rays for which the service says that hits
may be missing. `touching`, `along`: hits at which the ray touches the surface or lies in it. The
exit status is 1 if any hit is missed or invented.
"""

import sys
import time
from collections import Counter
from multiprocessing import Pool, cpu_count
from typing import Any

import numpy as np

from oracles.quadrics import sphere, torus
from oracles.rays import Ints, find_crossings
from oracles.sheets import Array, build_sheets
from service.bases.arrays import Bools
from service.engine.models import to_patches
from service.engine.rays.intersect import RayQuery, intersect_rays
from service.settings.runtime import pin_blas
from service.surface.examples.catalogue import find
from service.surface.lowered import PatchModel
from tools.certify.surfaces import FAMILIES
from tools.judge.roots import find_sphere_roots, find_torus_roots

FIRST_SEED = 8000
"""Seed of the first surface of a family; tests and `make certify` use other seeds."""

EXAMPLES = ("utah-teapot", "octahedral-sphere", "nurbs-goblet")
MAX_HITS = 10**7
"""More hits than all rays through one surface have together, so that none are refused."""

CLOSED_FORMS = {"sphere": (sphere, find_sphere_roots), "torus": (torus, find_torus_roots)}
"""By example, a function that measures distances from the surface, and one that finds all roots."""

RAY_FACTORS = {"utah-teapot": 25, "sphere": 50, "torus": 50}
"""Factors of the number of rays, by example; 1 for all other surfaces."""


def scatter_rays(model: PatchModel, points: Array, count: int, seed: int) -> tuple[Array, Array]:
    """Rays for a model with some `points` (m, 3) of its surface: origins and directions (count, 3).

    Of ten rays, six go towards a random point of the box, one of them along an axis; three go
    towards a point of the surface, and one goes through two points of the surface.
    """
    rng = np.random.default_rng(seed)
    low, high = model.bounds
    reach = float(np.linalg.norm(high - low))
    origins = (low + high) / 2 + rng.normal(0, reach, (count, 3)) * rng.choice([0.1, 1], (count, 1))
    targets = rng.uniform(low, high, (count, 3))
    surface_points = points[rng.integers(0, len(points), count)]
    draw = rng.random(count)
    targets = np.where((draw < 0.4)[:, np.newaxis], surface_points, targets)
    second_points = points[rng.integers(0, len(points), count)]
    origins = np.where((draw < 0.1)[:, np.newaxis], 3 * targets - 2 * second_points, origins)
    axis = np.eye(3)[rng.integers(0, 3, count)] * reach
    origins = np.where((draw > 0.9)[:, np.newaxis], targets - axis, origins)
    directions = targets - origins
    is_zero = ~directions.any(axis=1)
    directions[is_zero] = [0.0, 0, 1]
    return origins, directions


def find_values_outside(
    ray: Ints, t: Array, slack: Array, rays: Ints, intervals: tuple[Array, Array]
) -> Bools:
    """Whether each value t (n,) of a ray (n,) is outside all intervals of the same ray.

    The intervals, low and high (m,) each, are widened by `slack` (n,) at both ends. `rays` (m,) are
    their rays, in ascending order.
    """
    begins, ends = (np.searchsorted(rays, ray, side) for side in ("left", "right"))
    is_inside = np.zeros(len(ray), bool)
    low, high = intervals
    for k in range(int((ends - begins).max(initial=0))):
        row = np.minimum(begins + k, max(len(low) - 1, 0))
        is_inside |= (begins + k < ends) & (low[row] - slack <= t) & (t <= high[row] + slack)
    return ~is_inside


def judge(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The counts of one surface, by exhaustive search."""
    name, seed, count = case
    surface = find(name).surface() if name in EXAMPLES else FAMILIES[name].surface(seed)
    model = to_patches(surface.lower())
    sheets = build_sheets(model)
    points = np.concatenate([s.at(s.samples(200)) + s.origin for s in sheets])
    origins, directions = scatter_rays(model, points, count, seed)
    start = time.process_time()
    query = RayQuery(origins, directions, only_first=False)
    hits = intersect_rays(model, query, MAX_HITS)
    seconds = time.process_time() - start
    length = np.linalg.norm(directions, axis=1)
    ray, t, error = find_crossings(sheets, origins, directions, samples=12_000)
    # Rounding of the engine, which the errors of the search do not include.
    error += (1e-12 * (model.diagonal + np.linalg.norm(origins, axis=1)) / length)[ray]
    is_judged = hits["reached"][ray]
    ray, t, error = ray[is_judged], t[is_judged], error[is_judged]
    is_missed = find_values_outside(ray, t, error, hits["ray"], tuple(hits["t_bounds"].T))
    _print_rays(name, seed, ray[is_missed])
    ray_of_hit = hits["ray"]
    ray_points = origins[ray_of_hit] + hits["t"][:, np.newaxis] * directions[ray_of_hit]
    distances = np.linalg.norm(ray_points - hits["positions"], axis=1)
    rounding = 2e-16 * np.abs(origins[ray_of_hit]).max(axis=1)
    is_invented = distances > 1e-9 * model.diagonal + rounding
    _print_rays(name, seed, ray_of_hit[is_invented])
    return name, _count_results(hits, len(origins), is_missed, is_invented, seconds)


def _print_rays(name: str, seed: int, rays: Ints) -> None:
    """Prints the numbers of the first rays with a missed or invented hit."""
    if len(rays):
        print(f"{name}, {seed}: rays {np.unique(rays)[:9].tolist()}", flush=True)


def _count_results(
    hits: dict[str, Any], ray_count: int, is_missed: Bools, is_invented: Bools, seconds: float
) -> Counter[str]:
    kinds = Counter(list(hits["kind"]))
    return Counter(
        rays=ray_count, hits=len(hits["t"]),
        missed=int(is_missed.sum()), invented=int(is_invented.sum()),
        unreached=int((~hits["reached"]).sum()), touching=kinds["touching"], along=kinds["along"],
        milliseconds=round(1e3 * seconds),
    )  # fmt: skip


def judge_exactly(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The counts of the sphere or the torus: compares its roots with the hits."""
    name, seed, count = case
    model = to_patches(find(name).surface().lower())
    measure_offsets, find_roots = CLOSED_FORMS[name]
    origins, directions = draw_almost_tangent(name, count, seed)
    start = time.process_time()
    hits = intersect_rays(model, RayQuery(origins, directions, only_first=False), MAX_HITS)
    seconds = time.process_time() - start
    ray, t = hits["ray"], hits["t"]
    root_ray, root_t, error = find_roots(origins, directions)
    error += 1e-12  # the control points and weights of the model are rounded
    is_missed = find_values_outside(root_ray, root_t, error, ray, tuple(hits["t_bounds"].T))
    is_missed &= hits["reached"][root_ray]
    _print_rays(name, seed, root_ray[is_missed])
    ray_points = origins[ray] + t[:, np.newaxis] * directions[ray]
    is_invented = np.abs(measure_offsets(ray_points)[0]) > 2e-9 * model.diagonal
    # The interval of a crossing must contain a root, up to the error of the root. A hit that only
    # touches need not: the ray may pass the surface at a very small distance.
    order = np.lexsort((root_t, root_ray))
    root_intervals = root_t[order] - error[order], root_t[order] + error[order]
    low, high = hits["t_bounds"].T
    # Two intervals overlap if the middle of one is in the other, widened by half of its length.
    has_root = ~find_values_outside(
        ray, (low + high) / 2, (high - low) / 2, root_ray[order], root_intervals
    )
    is_invented |= (np.asarray(hits["kind"]) == "crossing") & ~has_root
    _print_rays(name, seed, ray[is_invented])
    return name, _count_results(hits, count, is_missed, is_invented, seconds)


def draw_almost_tangent(name: str, count: int, seed: int) -> tuple[Array, Array]:
    """Rays with unit directions, from 4 units before a point of the sphere or of the torus.

    Half of the rays are almost tangent: parallel to the tangent plane of the point, at a distance
    of 1e-10 to 1 from it. The other rays go through the point in a random direction.
    """
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    normals = points
    if name == "torus":
        turn, tilt = rng.uniform(0, 2 * np.pi, (2, count))
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        normals = points * np.cos(tilt)[:, np.newaxis] + np.outer(np.sin(tilt), [0, 0, 1])
        points = points + 0.4 * normals
    directions = rng.normal(size=(count, 3))
    is_grazing = rng.random(count) < 0.5
    directions[is_grazing] = np.cross(normals[is_grazing], directions[is_grazing])
    depth = rng.choice([-1, 1], count) * 10.0 ** rng.uniform(-10, 0, count)
    points = points - np.where(is_grazing, depth, 0.0)[:, np.newaxis] * normals
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return points - 4 * directions, directions


def _judge_any(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    return (judge_exactly if case[0] in CLOSED_FORMS else judge)(case)


def main(arguments: list[str]) -> int:
    """Judges all surfaces; prints a row for each family."""
    count = int(arguments[0]) if arguments else 1000
    surface_count = int(arguments[1]) if len(arguments) > 1 else 8
    names = arguments[2:] or [*FAMILIES, *EXAMPLES, "sphere", "torus"]
    cases = [
        (name, FIRST_SEED + k, RAY_FACTORS.get(name, 1) * count)
        for k in range(surface_count)
        for name in names
    ]
    totals: dict[str, Counter[str]] = {}
    with Pool(min(2, cpu_count()), pin_blas) as pool:
        for name, counts in pool.imap_unordered(_judge_any, cases):
            print(f"{name}: {dict(counts)}", file=sys.stderr, flush=True)
            for kind in (name, "all"):
                totals.setdefault(kind, Counter()).update(counts)
    columns = (
        "rays", "hits", "missed", "invented", "unreached", "touching", "along", "milliseconds"
    )  # fmt: skip
    print(f"{'family':28}" + "".join(f"{column:>13}" for column in columns))
    for name in [*names, "all"]:
        print(f"{name:28}" + "".join(f"{totals[name][column]:13}" for column in columns))
    has_faults = totals["all"]["missed"] + totals["all"]["invented"] > 0
    print("Something is wrong." if has_faults else "Nothing is wrong.")
    return int(has_faults)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
