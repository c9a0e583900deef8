"""Judges `/v1/intersect` on parts: the hits of rays.

`wrong`: a crossing that the judge found is in no interval of its ray; or a hit is not on its ray,
not on its face, or outside of the trims of the face; or `near_edge` says what is not so; or a ray
that begins outside of a closed part has an odd number of crossings, none of them near an edge; or
the first hit is not the first of all. `unreached`: rays for which the service says that hits may be
missing. `certain`: crossings of the judge that are no nearer to an edge than its gap. `form`:
crossings of the closed form. `counted`: rays whose number of hits must be even.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from oracles.brep_documents import Array, Index
from oracles.forms import trace_rays
from oracles.part_samples import sample_border
from oracles.parts import INSIDE, OUTSIDE
from service.bases.arrays import Bools
from tools.judge.findings import Findings
from tools.judge.judged_part import ON_PART, ROUNDING, JudgedPart
from tools.judge.rays import find_values_outside

CELLS = 12_000
"""Cells of all faces of a part together, about."""

THICKNESS = 1e-9
"""The thickness of rays that is asked for, relative to the diagonal."""

LEAST_SINE = 1e-5
"""Rays that meet a surface at a smaller angle are not judged there."""

STEP = 1e-7
"""The least step along rays towards closed forms, relative to the diagonal."""

NEXT, ROUNDS = 41, 7
"""Points of edges that are compared with a ray, around the nearest so far, and rounds of this."""

NEAR = 9 / 8
"""Rays pass edges at no more than this number of thicknesses and reaches together."""

DIGITS = 100
"""Crossings of the judge are this many roundings off, divided by the sine of the angle."""


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays, with the columns of their answer; `reach` (m,) is the size of the coordinates."""

    origins: Array
    directions: Array
    columns: dict[str, Any]
    reach: Array

    @property
    def speeds(self) -> Array:
        """The lengths (m,) of the directions."""
        return np.asarray(np.linalg.norm(self.directions, axis=1))


def judge_rays(judged: JudgedPart, count: int, seed: int) -> Findings:
    """The findings about `count` rays."""
    rng = np.random.default_rng([seed, 4])
    origins, directions = scatter_rays(judged, count, rng)
    asked = {"origins": origins.tolist(), "directions": directions.tolist()}
    answer = judged.ask("intersect", rays=asked, hits="all")
    first = judged.ask("intersect", rays=asked)
    rays = Rays(
        origins, directions, _list_columns(answer), judged.size + np.abs(origins).max(axis=1)
    )
    findings = Findings(judged.case.name, seed)
    find_missed(judged, rays, findings)
    check_hits(judged, rays, findings)
    check_first(rays, _list_columns(first), findings)
    columns = rays.columns
    findings.counts += Counter(
        rays=count, hits=len(columns["ray"]), unreached=int((~columns["reached"]).sum()),
        near_edge=int(columns["near_edge"].sum()),
    )  # fmt: skip
    return findings


def _list_columns(answer: Any) -> dict[str, Any]:
    columns = {name: np.array(values) for name, values in answer.items()}
    columns["ray"] = columns["ray"].astype(np.intp)
    columns.setdefault("patch", np.zeros(len(columns["ray"]), np.intp))
    columns["patch"] = columns["patch"].astype(np.intp)
    columns["near_edge"] = columns["near_edge"].astype(bool)
    for name, width in (("t_bounds", 2), ("uv", 2), ("positions", 3)):
        columns[name] = columns[name].reshape(-1, width)
    return columns


def scatter_rays(judged: JudgedPart, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Rays, origins and directions (count, 3): towards points of the box, of faces, of edges and of
    points close to edges; from outside, from inside, and along axes."""
    low, high = judged.part.corners
    reach = judged.search.diagonal
    samples, edges = judged.list_samples()
    middle = (low + high) / 2
    origins = middle + rng.normal(0, reach, (count, 3)) * rng.choice([0.2, 1], (count, 1))
    edge = edges[rng.integers(0, len(edges), count)]
    close = edge + reach * 10 ** rng.uniform(-8, -1, (count, 1)) * rng.normal(size=(count, 3))
    face = samples[rng.integers(0, len(samples), count)]
    kinds = [rng.uniform(low, high, (count, 3)), face, close, edge]
    kind = rng.choice(len(kinds), count, p=[0.45, 0.25, 0.25, 0.05])
    targets = np.stack(kinds)[kind, np.arange(count)]
    draw = rng.random(count)
    second = samples[rng.integers(0, len(samples), count)]
    origins = np.where((draw < 0.1)[:, np.newaxis], 3 * targets - 2 * second, origins)
    axis = np.eye(3)[rng.integers(0, 3, count)] * reach
    origins = np.where((draw > 0.9)[:, np.newaxis], targets - axis, origins)
    directions = targets - origins
    directions[~directions.any(axis=1)] = [0.0, 0, 1]
    return origins, directions


def find_missed(judged: JudgedPart, rays: Rays, findings: Findings) -> None:
    """Adds crossings that no interval of their ray contains."""
    hits = judged.search.find_hits(rays.origins, rays.directions, CELLS)
    on_face = judged.evaluate(hits.face, hits.places)
    answers, from_edges = judged.classify(hits.face, hits.places, on_face)
    thickness = 2 * THICKNESS * judged.diagonal
    is_certain = (answers == INSIDE) & (from_edges > thickness)
    _add_missed(rays, (hits.ray, hits.t, hits.sines), is_certain, findings)
    findings.counts["certain"] = int(is_certain.sum())
    form = judged.case.form
    if form is None:
        return
    lengths = np.linalg.norm(rays.origins - judged.part.corners.mean(axis=0), axis=1)
    lengths += judged.diagonal
    step = STEP * judged.search.diagonal
    ray, t = trace_rays(form, (rays.origins, rays.directions), lengths, step)
    # The sine of the angle is that of the distances just before and after.
    sines, shift = np.zeros(len(ray)), 10 * step / rays.speeds[ray]
    for sign in (-1, 1):
        points = rays.origins[ray] + (t + sign * shift)[:, np.newaxis] * rays.directions[ray]
        sines += np.abs(form.measure(points)) / (20 * step)
    is_steep = sines > LEAST_SINE
    _add_missed(rays, (ray, t, sines), is_steep, findings)
    findings.counts["form"] = int(is_steep.sum())


def _add_missed(
    rays: Rays, crossings: tuple[Index, Array, Array], some: Bools, findings: Findings
) -> None:
    """Adds those of `some` crossings (ray, t, sine) that are missed, if they are steep enough."""
    some = some & rays.columns["reached"][crossings[0]] & (np.abs(crossings[2]) > LEAST_SINE)
    ray, t, sines = crossings[0][some], crossings[1][some], np.abs(crossings[2][some])
    slack = DIGITS * ROUNDING * rays.reach[ray] / (sines * rays.speeds[ray])
    order = np.argsort(rays.columns["ray"], kind="stable")
    low, high = rays.columns["t_bounds"][order].T
    is_missed = find_values_outside(ray, t, slack, rays.columns["ray"][order], (low, high))
    findings.add(
        "missed hit of a ray", is_missed,
        lambda n: f"ray {ray[n]} at t = {float(t[n])!r}, sine {sines[n]:.2g}, "
        f"{rays.origins[ray[n]].tolist()} {rays.directions[ray[n]].tolist()}",
    )  # fmt: skip


def check_hits(judged: JudgedPart, rays: Rays, findings: Findings) -> None:
    """Adds hits that are not on their rays, or not on the part, and odd numbers of crossings."""
    columns = rays.columns
    ray, t, face, near_edge = (columns[each] for each in ("ray", "t", "patch", "near_edge"))
    positions, places = columns["positions"], columns["uv"]
    if not len(ray):
        return

    def describe(number: int) -> str:
        o, d = rays.origins[ray[number]], rays.directions[ray[number]]
        return (
            f"ray {ray[number]} {o.tolist()} {d.tolist()} at t = {float(t[number])!r}, face "
            f"{face[number]} at {places[number].tolist()}, near_edge {near_edge[number]}"
        )

    # A hit near an edge is on any of its faces, or between them.
    gaps = judged.gaps[face]
    gaps[near_edge] = judged.find_reaches(positions[near_edge])
    thickness = 1.01 * THICKNESS * judged.diagonal + ON_PART * rays.reach[ray]
    allowed = np.where(near_edge, NEAR * (thickness + gaps), thickness)
    offset = positions - rays.origins[ray]
    directions = rays.directions[ray] / rays.speeds[ray, np.newaxis]
    from_ray = np.linalg.norm(np.cross(offset, directions), axis=1)
    findings.add("hit off its ray", from_ray > allowed, lambda n: f"{from_ray[n]}, {describe(n)}")
    on_face = judged.evaluate(face, places)
    from_face = np.linalg.norm(on_face - positions, axis=1)
    findings.add(
        "hit off its face", from_face > allowed, lambda n: f"{from_face[n]}, {describe(n)}"
    )
    low, high = columns["t_bounds"].T
    along = (offset * directions).sum(axis=1)
    beyond = np.maximum(low * rays.speeds[ray] - along, along - high * rays.speeds[ray])
    findings.add(
        "hit off its interval", (beyond > allowed) | (t < low) | (t > high),
        lambda n: f"{beyond[n]}, {describe(n)}",
    )  # fmt: skip
    answers, from_edges = judged.classify(face, places, on_face)
    is_excused = near_edge & (from_edges <= 1.5 * gaps + 2 * thickness)
    findings.add(
        "hit outside of trims", (answers == OUTSIDE) & ~is_excused,
        lambda n: f"{from_edges[n]} from edges, {describe(n)}",
    )  # fmt: skip
    from_all, most = judged.search.find_borders(positions), 1.5 * gaps + 2 * thickness
    rows = np.flatnonzero(near_edge & (from_all > most))
    if len(rows):
        from_all[rows] = _measure_to_edges(judged, rays, rows)
    findings.add(
        "near_edge of hit", near_edge & (from_all > most),
        lambda n: f"{from_all[n]} from all edges and seams, {describe(n)}",
    )  # fmt: skip
    is_doubtful = near_edge | (columns["kind"] != "crossing")
    if judged.case.is_closed:
        check_parity(judged, rays, is_doubtful, findings)


def _measure_to_edges(judged: JudgedPart, rays: Rays, rows: Index) -> Array:
    """Distances from all edges, seams too, of the parts of rays in the intervals of hits `rows`."""
    ray, ends = rays.columns["ray"][rows], rays.columns["t_bounds"][rows].T
    origins, directions = (each[ray, np.newaxis] for each in (rays.origins, rays.directions))
    least, every = np.full(len(rows), np.inf), np.arange(len(rows))
    for curve in (*judged.part.borders, *judged.part.seams):
        places = np.sort(sample_border(curve).places[:, 0])
        places = np.broadcast_to(places, (len(rows), len(places)))
        for _ in range(ROUNDS):
            points = curve.at(places.ravel()).astype(np.float64).reshape(*places.shape, 3)
            t = ((points - origins) * directions).sum(axis=2) / (directions**2).sum(axis=2)
            on_ray = origins + np.clip(t, *ends[..., np.newaxis])[..., np.newaxis] * directions
            distances = np.linalg.norm(points - on_ray, axis=2)
            least = np.minimum(least, distances.min(axis=1))
            # Next, the two steps beside the nearest of these points.
            best, last = distances.argmin(axis=1), places.shape[1] - 1
            low, high = (places[every, np.clip(best + step, 0, last)] for step in (-1, 1))
            places = low[:, np.newaxis] + np.linspace(0, 1, NEXT) * (high - low)[:, np.newaxis]
    return least


def check_parity(judged: JudgedPart, rays: Rays, is_doubtful: Bools, findings: Findings) -> None:
    """Adds rays from outside of the box of a closed part with an odd number of crossings."""
    low, high = judged.part.corners
    is_outside = ((rays.origins < low) | (rays.origins > high)).any(axis=1)
    ray = rays.columns["ray"]
    count = np.bincount(ray, minlength=len(rays.origins))
    has_doubt = np.bincount(ray[is_doubtful], minlength=len(rays.origins)) > 0
    is_counted = is_outside & rays.columns["reached"] & ~has_doubt
    findings.add(
        "odd number of hits of ray", is_counted & (count % 2 == 1),
        lambda n: f"{count[n]}, {rays.origins[n].tolist()} {rays.directions[n].tolist()}",
    )  # fmt: skip
    findings.counts["counted"] = int(is_counted.sum())


def check_first(rays: Rays, first: dict[str, Any], findings: Findings) -> None:
    """Adds rays whose first hit is not the first of all hits."""
    columns, m = rays.columns, len(rays.origins)
    least, most = np.full((2, m), np.inf)
    np.minimum.at(least, columns["ray"], columns["t_bounds"][:, 0])
    np.minimum.at(most, columns["ray"], columns["t_bounds"][:, 1])
    alone, (low, high) = first["ray"], first["t_bounds"].T
    has_first = np.zeros(m, bool)
    has_first[alone] = True
    is_judged = columns["reached"] & first["reached"]
    is_wrong = is_judged & (has_first != np.isfinite(least))
    is_wrong[alone] |= is_judged[alone] & ((high < least[alone]) | (low > most[alone]))
    findings.add(
        "first hit of ray", is_wrong,
        lambda n: f"all hits begin at {least[n]}, {rays.origins[n].tolist()} "
        f"{rays.directions[n].tolist()}",
    )  # fmt: skip
