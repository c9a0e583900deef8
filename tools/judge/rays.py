"""Judges hits of rays by closed forms and by looking everywhere, with none of the engine's code.

    python -m tools.judge.rays [rays] [surfaces] [family …]      (make judge-queries)

It sends 1000 rays through each of 8 surfaces of every family and of three examples: from outside,
from inside, along two points of the surface, and along axes; and 50 times as many to the sphere and
the torus, half of them almost tangent. A row counts crossings that are in no interval of their ray
(`missed`), hits that are not on the ray and the surface (`invented`), rays that were not reached,
and kinds of hits. The exit status is 1 if any hit is missed or invented.
"""

import sys
import time
from collections import Counter
from functools import partial
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
from tests.oracles.rays import Ints, crossings
from tests.oracles.sheets import Array, sheets_of
from tools.certify.surfaces import FAMILIES

FIRST = 8000
"""Number of the first surface of a family: others than tests and `make certify` have."""

EXAMPLES = ("utah-teapot", "octahedral-sphere", "nurbs-goblet")


def strewn(model: PatchModel, points: Array, count: int, seed: int) -> tuple[Array, Array]:
    """Rays towards points in the box, and of the surface; half of these along it."""
    rng = np.random.default_rng(seed)
    low, high = model.bounds
    reach = float(np.linalg.norm(high - low))
    origins = (low + high) / 2 + rng.normal(0, reach, (count, 3)) * rng.choice([0.1, 1], (count, 1))
    at = rng.uniform(low, high, (count, 3))
    on = points[rng.integers(0, len(points), count)]
    some = rng.random(count)
    at = np.where((some < 0.4)[:, np.newaxis], on, at)
    beside = points[rng.integers(0, len(points), count)]
    origins = np.where((some < 0.1)[:, np.newaxis], 3 * at - 2 * beside, origins)
    axis = np.eye(3)[rng.integers(0, 3, count)] * reach
    origins = np.where((some > 0.9)[:, np.newaxis], at - axis, origins)
    directions = at - origins
    still = ~directions.any(axis=1)
    directions[still] = [0.0, 0, 1]
    return origins, directions


def missed(found: dict[str, Any], ray: Ints, t: Array, slack: Array) -> int:
    """How many of true hits are in no interval of their rays."""
    order = np.argsort(ray, kind="stable")
    ray, t, slack = ray[order], t[order], slack[order]
    firsts, lasts = (np.searchsorted(found["ray"], ray, side) for side in ("left", "right"))
    held = np.zeros(len(ray), bool)
    low, high = found["t_bounds"].T
    for k in range(int((lasts - firsts).max(initial=0))):
        row = np.minimum(firsts + k, max(len(low) - 1, 0))
        held |= (firsts + k < lasts) & (low[row] - slack <= t) & (t <= high[row] + slack)
    return int((~held).sum())


def judge(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The findings about one surface."""
    name, seed, count = case
    surface = find(name).surface() if name in EXAMPLES else FAMILIES[name].surface(seed)
    model = to_patches(surface.lower())
    sheets = sheets_of(model)
    points = np.concatenate([s.at(s.samples(200)) + s.origin for s in sheets])
    origins, directions = strewn(model, points, count, seed)
    start = time.process_time()
    found = intersect_rays(model, RayQuery(origins, directions, False), 10**7)
    seconds = time.process_time() - start
    length = np.linalg.norm(directions, axis=1)
    ray, t = crossings(sheets, origins, directions, 12_000)
    slack = 1e-12 * (model.diagonal + np.linalg.norm(origins, axis=1)) / length
    is_judged = found["reached"][ray]
    ray, t = ray[is_judged], t[is_judged]
    ours = found["ray"]
    there = origins[ours] + found["t"][:, np.newaxis] * directions[ours]
    away = np.linalg.norm(there - found["positions"], axis=1)
    invented = away > 1e-9 * model.diagonal + 2e-16 * np.abs(origins[ours]).max(axis=1)
    return name, _counted(found, len(origins), missed(found, ray, t, slack[ray]), invented, seconds)


def _counted(
    found: dict[str, Any], rays: int, lost: int, invented: Bools, seconds: float
) -> Counter[str]:
    kinds = Counter(list(found["kind"]))
    return Counter(
        rays=rays, hits=len(found["t"]), missed=lost, invented=int(invented.sum()),
        wider=int((~found["reached"]).sum()), touching=kinds["touching"], along=kinds["along"],
        milliseconds=round(1e3 * seconds),
    )  # fmt: skip


def judge_exactly(case: tuple[str, int, int]) -> tuple[str, Counter[str]]:
    """The findings about the sphere or the torus: what is between crossings alternates in sign."""
    name, seed, count = case
    model = to_patches(find(name).surface().lower())
    off = partial(sphere, radius=1.0) if name == "sphere" else partial(torus, radius=1.0, tube=0.4)
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    if name == "torus":
        turn, tilt = rng.uniform(0, 2 * np.pi, (2, count))
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        normals = points * np.cos(tilt)[:, np.newaxis] + np.outer(np.sin(tilt), [0, 0, 1])
        points = points + 0.4 * normals
    else:
        normals = points
    d = rng.normal(size=(count, 3))
    some = rng.random(count) < 0.5
    d[some] = np.cross(normals[some], d[some])
    depth = rng.choice([-1, 1], count) * 10.0 ** rng.uniform(-8, 0, count)
    points = points - np.where(some, depth, 0.0)[:, np.newaxis] * normals
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    origins = points - 4 * d
    start = time.process_time()
    found = intersect_rays(model, RayQuery(origins, d, False), 10**7)
    seconds = time.process_time() - start
    ray, t = found["ray"], found["t"]
    there = origins[ray] + t[:, np.newaxis] * d[ray]
    invented = np.abs(off(there)[0]) > 2e-9 * model.diagonal
    # Between two neighbouring hits, before the first and after the last, nothing changes its side:
    # the residual there has no sign but that of its middle.
    lost = 0
    ends = found["t_bounds"]
    outside = np.full(len(origins), 1.0)
    steps = np.linspace(0, 1, 41)[1:-1]
    firsts = np.searchsorted(ray, np.arange(count))
    counts = found["counts"]
    for k in range(int(counts.max()) + 1):
        rows = np.flatnonzero(counts >= k)
        begin, end = np.zeros(len(rows)), np.full(len(rows), 8.0)
        if k:
            begin = ends[firsts[rows] + k - 1, 1]
        has_next = counts[rows] > k
        end[has_next] = ends[firsts[rows[has_next]] + k, 0]
        at = begin[:, np.newaxis] + (end - begin)[:, np.newaxis] * steps
        places = origins[rows][:, np.newaxis] + at[..., np.newaxis] * d[rows][:, np.newaxis]
        side = off(places.reshape(-1, 3))[0].reshape(at.shape)
        unknown = outside[rows] == 0
        outside[rows[unknown]] = np.sign(side[unknown, len(steps) // 2])
        sign = outside[rows][:, np.newaxis]
        lost += int(((side * sign < -1e-12) & (end > begin)[:, np.newaxis]).any(axis=1).sum())
        next_kind = np.asarray(found["kind"])[firsts[rows[has_next]] + k]
        outside[rows[has_next][next_kind == "crossing"]] *= -1
        # What is touched may be passed through once; the next gap tells.
        outside[rows[has_next][next_kind != "crossing"]] = 0.0
    return name, _counted(found, count, lost, invented, seconds)


def main(arguments: list[str]) -> int:
    """Judges all, and prints a row for each family."""
    count, surfaces = (int(a) for a in (arguments + ["1000", "8"][len(arguments[:2]) :])[:2])
    names = arguments[2:] or [*FAMILIES, *EXAMPLES, "sphere", "torus"]
    exact = [
        (n, FIRST + k, 50 * count)
        for k in range(surfaces)
        for n in names
        if n in ("sphere", "torus")
    ]
    cases = [
        (n, FIRST + k, count)
        for k in range(surfaces)
        for n in names
        if n not in ("sphere", "torus")
    ]
    totals: dict[str, Counter[str]] = {}
    with Pool(min(2, cpu_count()), pin_blas) as pool:
        for results in (
            pool.imap_unordered(judge, cases),
            pool.imap_unordered(judge_exactly, exact),
        ):
            for name, found in results:
                for kind in (name, "all"):
                    totals.setdefault(kind, Counter()).update(found)
    columns = ("rays", "hits", "missed", "invented", "wider", "touching", "along", "milliseconds")
    print(f"{'family':28}" + "".join(f"{column:>13}" for column in columns))
    for name in [*names, "all"]:
        print(f"{name:28}" + "".join(f"{totals[name][column]:13}" for column in columns))
    failed = totals["all"]["missed"] + totals["all"]["invented"] > 0
    print("Something is wrong." if failed else "Nothing is wrong.")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
