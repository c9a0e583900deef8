"""Compares an answer of the judge with a slow truth: each finding is a sentence."""

import json
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from oracles.distance import Soup, measure_distances
from oracles.topology import weld_by_position
from service.engine.mesh_checks.query import CheckQuery
from service.pipeline.check import plan_check
from service.surface.given_mesh import GivenMesh
from service.surface.sizes import SurfaceKind
from tools.certify.judge import find_flat_triangles
from tools.judge_meshes.meshes import get_size
from tools.judge_meshes.truths import Array, Truth

RELATIVE = 1e-9
"""Allowance for rounding, as a share of a distance."""

ROUNDING = 64 * 2.0**-53
"""Allowance for rounding, as a share of the largest coordinate."""

FLOOR = 1e-8
"""An interval this narrow, as a share of the diagonal of the mesh, is narrow enough in any case."""


def check(surface: SurfaceKind, mesh: GivenMesh, query: CheckQuery) -> dict[str, Any]:
    """The answer of the service about a mesh."""
    answer: dict[str, Any] = json.loads(bytes(plan_check(surface, mesh, query).run()))
    return answer


def find_faults(
    answer: dict[str, Any], mesh: GivenMesh, truth: Truth, query: CheckQuery
) -> Iterator[str]:
    """The faults of the answer."""
    to_mesh, to_surface = answer["surface_to_mesh"], answer["mesh_to_surface"]
    slack = truth.slack + ROUNDING * float(np.abs(mesh.positions).max())
    for name, interval in (("surface to mesh", to_mesh), ("mesh to surface", to_surface)):
        low, high = interval["low"], interval["high"]
        if not 0 <= low <= high < np.inf:
            yield f"{name}: {low} to {high} is no interval"
        width = max(query.relative_tolerance * high * (1 + RELATIVE), FLOOR * get_size(mesh))
        if answer["reached"] and high - low > width:
            yield f"{name}: {low} to {high} is wider than asked"
    yield from _find_faults_to_mesh(to_mesh, mesh, truth, slack)
    yield from _find_faults_to_surface(to_surface, mesh, truth, slack)
    yield from find_topology_faults(answer, mesh)


def _find_faults_to_mesh(
    interval: dict[str, Any], mesh: GivenMesh, truth: Truth, slack: float
) -> Iterator[str]:
    sampled = truth.measure_to_mesh(mesh.corners)
    if sampled > interval["high"] * (1 + RELATIVE) + slack:
        yield f"surface to mesh: sampled {sampled}, above {interval['high']}"
    point = np.array([interval["point"]])
    distance = float(Soup(mesh.corners).distances(point)[0])
    if distance < interval["low"] * (1 - RELATIVE) - slack:
        yield f"surface to mesh: {distance} at the point, below {interval['low']}"
    away = truth.measure_place(point, np.array([interval.get("uv", [0.0, 0.0])]))
    if away > slack + _find_spacing(truth) + FLOOR * get_size(mesh):
        yield f"surface to mesh: the point is {away} from the surface"
    nearest = measure_to_triangle(point, mesh, interval["triangle"])
    if nearest > distance * (1 + RELATIVE) + slack:
        yield f"surface to mesh: triangle {nearest} from the point, the nearest {distance}"


def _find_faults_to_surface(
    interval: dict[str, Any], mesh: GivenMesh, truth: Truth, slack: float
) -> Iterator[str]:
    high = interval["high"] * (1 + RELATIVE) + slack
    sampled = truth.measure_from_mesh(mesh.corners, high)
    if sampled > high:
        yield f"mesh to surface: sampled {sampled}, above {interval['high']}"
    point = np.array([interval["point"]])
    away = measure_to_triangle(point, mesh, interval["triangle"])
    if away > slack:
        yield f"mesh to surface: the point is {away} from its triangle"
    distance = float(truth.measure_points(point)[0])
    if distance < interval["low"] * (1 - RELATIVE) - slack:
        yield f"mesh to surface: {distance} at the point, below {interval['low']}"


def _find_spacing(truth: Truth) -> float:
    """How far a point of the surface may be from the nearest known one."""
    return float(getattr(truth, "spacing", 0.0))


def measure_to_triangle(point: Array, mesh: GivenMesh, triangle: int) -> float:
    """The distance of a point (1, 3) from a triangle of a mesh."""
    return float(measure_distances(point, mesh.corners[[triangle]])[0])


def find_topology_faults(answer: dict[str, Any], mesh: GivenMesh) -> Iterator[str]:
    """Counts that differ from those of the edges, where equal positions are one vertex."""
    counts = count_edges(mesh)
    for name, count in counts.items():
        if answer[name] != count:
            yield f"{name}: {answer[name]}, counted {count}"
    flat = len(find_flat_triangles(mesh.corners))
    if answer["degenerate_faces"] < flat:
        yield f"degenerate_faces: {answer['degenerate_faces']}, {flat} have no area at all"


def count_edges(mesh: GivenMesh) -> dict[str, int]:
    """Open, non-manifold and flipped edges, as the documentation of the answer defines them."""
    faces = weld_by_position(mesh.positions, mesh.triangles).tolist()
    directed = Counter(
        pair for a, b, c in faces if len({a, b, c}) == 3 for pair in ((a, b), (b, c), (c, a))
    )
    uses = {(a, b): directed[a, b] + directed[b, a] for a, b in directed}
    edges = [(a, b) for a, b in uses if a < b or (b, a) not in uses]
    return {
        "open_edges": sum(uses[edge] == 1 for edge in edges),
        "non_manifold_edges": sum(uses[edge] > 2 for edge in edges),
        "flipped_edges": sum(uses[a, b] == 2 and directed[a, b] != 1 for a, b in edges),
    }
