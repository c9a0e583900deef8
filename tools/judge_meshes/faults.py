"""Plants one fault in a good mesh, and says whether the judge's answer finds it.

    python -m tools.judge_meshes.faults [count]

The faults are, in turn, a moved vertex, a flipped face, a dropped triangle and a duplicated one.
The exit status is 1 if a fault is not found.
"""

import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from oracles.topology import weld_by_position
from service.engine.mesh_checks.query import CheckQuery
from service.settings.runtime import pin_blas
from service.surface.examples.catalogue import EXAMPLES
from service.surface.given_mesh import GivenMesh
from tools.certify.parts import PARTS
from tools.certify.surfaces import FAMILIES
from tools.judge_meshes.cases import LEFT_OUT, Case, build_surface
from tools.judge_meshes.compare import check
from tools.judge_meshes.meshes import Random, draw_direction, get_size, mesh_by_tolerance
from tools.judge_meshes.truths import Truth, spread_points

RELATIVE = 1e-2
"""The tolerance of the good meshes, as a share of the diagonal."""

FAR = 0.05, 0.5
"""How far a vertex is moved: shares of the diagonal."""

FARTHEST = 0.8
"""Samples of the triangles around a moved vertex are at most at this share of its distance."""

REVERSED = 2.0
"""The least angle, in radians, between the surface's normal and that of a flipped face."""

SEED = 9501
"""The seed of all families; with others, triangular patches are flat triangles."""

QUERY = CheckQuery(relative_tolerance=0.3)
"""How exactly meshes are judged."""


@dataclass(frozen=True, eq=False)
class Planted:
    """A mesh with a fault, and the function that says what an answer does not have."""

    mesh: GivenMesh
    find_missing: Callable[[dict[str, Any], dict[str, Any]], Sequence[str]]


def move_vertex(mesh: GivenMesh, truth: Truth, rng: Random) -> Planted:
    """A vertex, with all its copies, moved so far that no other point is as far away."""
    used = np.unique(mesh.triangles)
    for _ in range(60):
        row = rng.choice(used)
        moved = mesh.positions[row] + get_size(mesh) * rng.uniform(*FAR) * draw_direction(rng)
        copies = (mesh.positions == mesh.positions[row]).all(axis=1)
        positions = np.where(copies[:, np.newaxis], moved, mesh.positions)
        faulty = GivenMesh(positions, np.array(mesh.triangles))
        distance = float(truth.measure_points(moved[np.newaxis])[0])
        around = spread_points(faulty.corners[copies[mesh.triangles].any(axis=1)])
        around = around[(around != moved).any(axis=1)]
        # Other points of the triangles around the vertex must not be further away.
        is_farthest = truth.measure_points(around).max() <= FARTHEST * distance
        if is_farthest and distance > FAR[0] / 2 * get_size(mesh):
            break

    def find_missing(good: dict[str, Any], answer: dict[str, Any]) -> list[str]:
        del good
        found, missing = answer["mesh_to_surface"], []
        if not found["low"] <= distance * (1 + 1e-9) or not distance <= found["high"] * (1 + 1e-9):
            missing.append(f"the distance {distance} is not in {found['low']}, {found['high']}")
        away = np.linalg.norm(np.array(found["point"]) - moved)
        if away > 0.2 * distance:
            missing.append(f"the place is {away / distance} distances from the vertex")
        if not copies[faulty.triangles[found["triangle"]]].any():
            missing.append("the triangle has not the vertex")
        return missing

    return Planted(faulty, find_missing)


def flip_face(mesh: GivenMesh, truth: Truth, rng: Random) -> Planted:
    """The winding of one triangle reversed."""
    del truth
    row, inner = _choose_triangle(mesh, rng)
    triangles = np.array(mesh.triangles)
    triangles[row] = triangles[row, ::-1]

    def find_missing(good: dict[str, Any], answer: dict[str, Any]) -> list[str]:
        missing = []
        if answer["flipped_edges"] != good["flipped_edges"] + inner:
            missing.append(f"flipped_edges: {answer['flipped_edges']}, {inner} more were planted")
        if not answer["max_normal_angle"] >= REVERSED:
            missing.append(f"max_normal_angle: {answer['max_normal_angle']}")
        return missing

    return Planted(GivenMesh(np.array(mesh.positions), triangles), find_missing)


def drop_triangle(mesh: GivenMesh, truth: Truth, rng: Random) -> Planted:
    """One triangle removed."""
    del truth
    row, inner = _choose_triangle(mesh, rng)
    triangles = np.delete(mesh.triangles, row, axis=0)

    def find_missing(good: dict[str, Any], answer: dict[str, Any]) -> list[str]:
        # Each inner edge is open now, and each edge of the border is gone.
        expected = good["open_edges"] + inner - (3 - inner)
        if answer["open_edges"] == expected:
            return []
        return [f"open_edges: {answer['open_edges']}, expected {expected}"]

    return Planted(GivenMesh(np.array(mesh.positions), triangles), find_missing)


def repeat_triangle(mesh: GivenMesh, truth: Truth, rng: Random) -> Planted:
    """One triangle twice; half of the copies have vertices of their own."""
    del truth
    row, inner = _choose_triangle(mesh, rng)
    positions, copy = np.array(mesh.positions), np.roll(mesh.triangles[row], rng.integers(3))
    if rng.integers(2):
        positions = np.concatenate([positions, positions[copy]])
        copy = len(mesh.positions) + np.arange(3)
    triangles = np.concatenate([mesh.triangles, [copy]])

    def find_missing(good: dict[str, Any], answer: dict[str, Any]) -> list[str]:
        found = answer["non_manifold_edges"] - good["non_manifold_edges"]
        return [] if found == inner else [f"non_manifold_edges: {found} more, planted {inner}"]

    return Planted(GivenMesh(positions, triangles), find_missing)


FAULTS: Mapping[str, Callable[[GivenMesh, Truth, Random], Planted]] = MappingProxyType(
    {
        "a moved vertex": move_vertex,
        "a flipped face": flip_face,
        "a dropped triangle": drop_triangle,
        "a duplicated triangle": repeat_triangle,
    }
)
"""Faults by name."""


def _choose_triangle(mesh: GivenMesh, rng: Random) -> tuple[int, int]:
    """A triangle that is not small, whose edges have one or two triangles; how many have two."""
    faces = weld_by_position(mesh.positions, mesh.triangles)
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    _, number, uses = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    of_edges = uses[number.ravel()].reshape(-1, 3)
    a, b, c = mesh.corners.transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    good = (of_edges <= 2).all(axis=1) & (of_edges == 2).any(axis=1) & (areas >= np.median(areas))
    row = int(rng.choice(np.flatnonzero(good)))
    return row, int((of_edges[row] == 2).sum())


def list_surfaces() -> list[Case]:
    """Surfaces of all families and examples, one of each."""
    left_out = LEFT_OUT | {"folded", "cusped", "degrees 1 to 8, anywhere"}
    cases = [Case("surfaces", name, SEED, 0) for name in FAMILIES if name not in left_out]
    cases += [Case("parts", name, SEED, 0) for name in PARTS if name not in left_out]
    return cases + [Case("examples", name, 0, 0) for name in EXAMPLES]


def try_fault(case: Case, name: str, seed: int) -> list[str]:
    """Plant a fault in the mesh of a surface; returns the findings that the judge does not have."""
    surface, truth = build_surface(case)
    good, good_answer = _check_good(case)
    planted = FAULTS[name](good, truth, np.random.default_rng(seed))
    answer = check(surface, planted.mesh, QUERY)
    return list(planted.find_missing(good_answer, answer))


@lru_cache(maxsize=1)
def _check_good(case: Case) -> tuple[GivenMesh, dict[str, Any]]:
    """The mesh without a fault, and the answer about it; the same for all faults of a surface."""
    surface, _ = build_surface(case)
    good = mesh_by_tolerance(surface, RELATIVE)
    return good, check(surface, good, QUERY)


def main(arguments: Sequence[str]) -> int:
    """Plants faults; prints those that are not found, and how many were planted."""
    pin_blas()
    count = int(arguments[0]) if arguments else 200
    cases, names = list_surfaces(), list(FAULTS)
    planted: Counter[str] = Counter()
    is_missed = False
    for seed in range(count):
        case, name = cases[seed // len(names) % len(cases)], names[seed % len(names)]
        missing = try_fault(case, name, seed)
        planted[name] += 1
        for text in missing:
            is_missed = True
            print(f"{case}, {name}, seed {seed}: {text}", flush=True)
    print(", ".join(f"{name}: {number}" for name, number in planted.items()))
    print("Something is missed." if is_missed else "All were found.")
    return int(is_missed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
