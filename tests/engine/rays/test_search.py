"""Hits of rays, compared with formulas of 50 digits, and with exhaustive searches."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from oracles.rays import Ints, find_crossings, torus_roots
from oracles.sheets import Array, build_sheets
from service.engine.cells.tree import WorkLimits
from service.engine.models import to_patches
from service.engine.rays.intersect import LIMITS, RayQuery, intersect_rays
from service.errors import TooLarge
from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.patches import PatchSurface
from service.surface.sizes import SurfaceKind
from tools.certify.surfaces import FAMILIES

RNG = np.random.default_rng
SQUARE = BezierSurface(np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]))
SADDLE = BezierSurface(np.array([[[-1.0, -1, 1], [-1, 1, -1]], [[1, -1, -1], [1, 1, 1]]]))
ROOF = np.array([[[0.0, 0, 0], [0, 3, 0]], [[1, 0, 1], [1, 3, 1]]])


def find_hits(
    surface: SurfaceKind,
    origins: Any,
    directions: Any,
    hits: str = "all",
    thickness: float = 1e-9,
    *,
    limits: WorkLimits = LIMITS,
) -> dict[str, Any]:
    """The columns of all hits, or of the first hit, of rays."""
    o, d = (np.atleast_2d(np.asarray(rows, np.float64)) for rows in (origins, directions))
    query = RayQuery(o, d, hits == "first", thickness, limits)
    return intersect_rays(to_patches(surface.lower()), query, 10**6)


def scatter_rays(surface: SurfaceKind, count: int, seed: int = 0) -> tuple[Array, Array]:
    """Rays from points near and far to random points in the bounding box of the surface."""
    low, high = to_patches(surface.lower()).bounds
    reach = float(np.linalg.norm(high - low))
    rng = RNG(seed)
    origins = (low + high) / 2 + rng.normal(0, reach, (count, 3)) * rng.choice([0.1, 1], (count, 1))
    return origins, rng.uniform(low, high, (count, 3)) - origins


def is_missed(hits: dict[str, Any], ray: Ints, t: Array, slack: Array | float) -> Array:
    """Whether each true hit (`ray`, `t`) is outside all intervals of its ray in `hits`, (n,)."""
    is_included = np.zeros(len(ray), bool)
    low, high = hits["t_bounds"].T
    for k in np.unique(hits["ray"]).tolist():
        is_of_ray, rows = hits["ray"] == k, np.flatnonzero(ray == k)
        row_t, row_slack = (np.broadcast_to(x, ray.shape)[rows][:, np.newaxis] for x in (t, slack))
        is_inside = (low[is_of_ray] - row_slack <= row_t) & (row_t <= high[is_of_ray] + row_slack)
        is_included[rows] = is_inside.any(axis=1)
    return ~is_included


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_all_hits_of_an_exhaustive_search_are_found(name: str) -> None:
    surface = FAMILIES[name].surface(seed=78)
    origins, directions = scatter_rays(surface, 20)
    result = find_hits(surface, origins, directions)
    assert result["reached"].all()
    length = np.linalg.norm(directions, axis=1)
    ray, t, error = find_crossings(build_sheets(surface), origins, directions)
    model = to_patches(surface.lower())
    slack = error + 1e-12 * model.diagonal / length[ray]
    assert not is_missed(result, ray, t, slack).any()
    hit_ray = result["ray"]
    ray_points = origins[hit_ray] + result["t"][:, np.newaxis] * directions[hit_ray]
    distances = np.linalg.norm(ray_points - result["positions"], axis=1)
    assert distances.max(initial=0.0) < 1e-9 * model.diagonal
    low, high = result["t_bounds"].T
    assert ((low <= result["t"]) & (result["t"] <= high)).all()
    first = find_hits(surface, origins, directions, "first")
    rows = np.flatnonzero(np.diff(hit_ray, prepend=-1))  # the first hit of each ray
    for column in ("ray", "t", "uv", "kind"):
        np.testing.assert_array_equal(np.asarray(result[column])[rows], first[column])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["utah-teapot", "octahedral-sphere", "nurbs-goblet"])
def test_the_numbers_of_hits_agree_with_an_exhaustive_search(name: str) -> None:
    surface = find(name).surface()
    model = to_patches(surface.lower())
    origins, directions = scatter_rays(surface, 50, 1)
    result = find_hits(surface, origins, directions)
    ray, t, error = find_crossings(build_sheets(model), origins, directions, samples=8_000)
    slack = error + 1e-12 * model.diagonal / np.linalg.norm(directions, axis=1)[ray]
    assert not is_missed(result, ray, t, slack).any()
    # The search finds a hit on a common edge once for each of its patches.
    counts = [len(np.unique(np.round(t[ray == k], 9))) for k in range(len(origins))]
    assert result["counts"].tolist() == counts


def test_rays_that_graze_a_sphere_have_the_right_hits() -> None:
    rng = RNG(3)
    normals = rng.normal(size=(300, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    d = np.cross(normals, rng.normal(size=(300, 3)))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    depth = np.repeat([0.7, 1e-3, 1e-5, 1e-7, -1e-7, -1e-3], 50)
    origins = normals * (1 - depth)[:, np.newaxis] - 3 * d
    result = find_hits(find("sphere").surface(), origins, 2 * d)
    assert result["reached"].all()
    assert result["counts"].tolist() == np.where(depth > 0, 2, 0).tolist()
    half_chord = np.sqrt(1 - (1 - depth[depth > 0]) ** 2)
    # The directions have the length 2.
    expected_t = np.stack([(3 - half_chord) / 2, (3 + half_chord) / 2], axis=1).ravel()
    assert (np.abs(result["t"] - expected_t) < 1e-8).all()
    assert result["entering"] == [True, False] * 200
    np.testing.assert_allclose(result["normals"], result["positions"], atol=1e-9)
    tangents = find_hits(find("sphere").surface(), normals[:20] - 3 * d[:20], d[:20])
    assert set(tangents["kind"]) == {"touching"}
    np.testing.assert_allclose(tangents["t"], 3, atol=2e-4)


def test_hits_of_a_torus_agree_with_roots_of_50_digits() -> None:
    rng = RNG(4)
    inner = rng.uniform([-1.4, -1.4, -0.4], [1.4, 1.4, 0.4], (40, 3))
    origins = rng.normal(size=(40, 3)) * 3
    result = find_hits(find("torus").surface(), origins, inner - origins)
    for k, (o, d) in enumerate(zip(origins, inner - origins, strict=True)):
        expected_t = torus_roots(o, d, 1.0, 0.4)
        np.testing.assert_allclose(
            result["t"][result["ray"] == k], expected_t, rtol=1e-11, atol=1e-11
        )


GRAZING: list[
    tuple[SurfaceKind | str, list[float], list[float], list[tuple[str, float, float]]]
] = [
    (SQUARE, [0.3, 0.4, 2], [0, 0, -2], [("crossing", 1, 1)]),
    (SQUARE, [0.5, 0.4, 0], [0, 0, 1], [("crossing", 0, 0)]),
    (SQUARE, [1, 1, 1], [0, 0, -1], [("crossing", 1, 1)]),
    (SQUARE, [-1, 0.4, 0], [2, 0, 0], [("along", 0.5, 1)]),
    (SQUARE, [0.5, 0.4, 0], [2, 0, 0], [("along", 0, 0.25)]),
    (SQUARE, [-1, 0.1, 0], [1, 0.3, 0], [("along", 1, 2)]),
    ("cylinder", [0.8, 0.6, 0.3], [0, 0, 1], [("along", 0, 0.7)]),
    (SQUARE, [-1, 0, 0], [1, 0, 0], [("along", 1, 2)]),
    (SQUARE, [-1, 1, 0], [1, -1, 0], [("touching", 1, 1)]),
    (SQUARE, [-1, -1, 0], [1, -1, 0], []),
    (SQUARE, [-1, 0.4, 1e-7], [1, 0, 0], []),
    (SQUARE, [0.5, 0.4, -1], [0, 0, -1], []),
    (SADDLE, [-2, 0.5, -1], [1, 0, 0.5], [("along", 1, 3)]),
    (SADDLE, [-1, -1, 0], [1, 1, 0], [("touching", 1, 1)]),
    ("cylinder", [0.8, 0.6, -4], [0, 0, 1], [("along", 3, 5)]),
    ("cylinder", [1, -4, 0.1], [0, 1, 0], [("touching", 4, 4)]),
    ("cone", [0, 0, -4], [0, 0, 1], [("crossing", 3, 3), ("crossing", 5, 5)]),
    ("cone", [-3, 0, 1], [1, 0, 0], [("touching", 3, 3)]),
    ("sphere", [0, 0, -3], [0, 0, 1], [("crossing", 2, 2), ("crossing", 4, 4)]),
    ("sphere", [1, 0, -3], [0, 0, 1], [("touching", 3, 3)]),
    ("torus", [-3, 0, 0.4], [1, 0, 0], [("touching", 2, 2), ("touching", 4, 4)]),
    ("torus", [-3, 0, 0], [1, 0, 0], [("crossing", t, t) for t in (1.6, 2.4, 3.6, 4.4)]),
    ("torus", [-3, 1, 0.4], [1, 0, 0], [("touching", 3, 3)]),
]
"""A surface, the origin and the direction of a ray, and (kind, first t, last t) of each hit."""


@pytest.mark.slow
@pytest.mark.parametrize("surface", dict.fromkeys(case[0] for case in GRAZING))
def test_rays_that_touch_or_follow_a_surface_have_the_right_kinds(
    surface: SurfaceKind | str,
) -> None:
    cases = [case[1:] for case in GRAZING if case[0] is surface]
    surface = find(surface).surface() if isinstance(surface, str) else surface
    origins, directions = (
        np.array(rows, np.float64) for rows in list(zip(*cases, strict=True))[:2]
    )
    result, first = (find_hits(surface, origins, directions, hits) for hits in ("all", "first"))
    assert result["reached"].all()
    ray_points = origins[result["ray"]] + result["t"][:, np.newaxis] * directions[result["ray"]]
    np.testing.assert_allclose(ray_points, result["positions"], atol=2e-8)
    for k, (_, _, expected_hits) in enumerate(cases):
        rows = np.flatnonzero(result["ray"] == k)
        kinds = [kind for kind, _, _ in expected_hits]
        assert [result["kind"][row] for row in rows] == kinds, cases[k]
        for (low, high), (kind, begin, end) in zip(
            result["t_bounds"][rows], expected_hits, strict=True
        ):
            assert low <= begin <= end <= high
            # Where a ray touches a surface, a wide interval of t is near the surface.
            assert high - low <= end - begin + (1e-7 if kind != "touching" else 0.02)
        rows_of_first = np.flatnonzero(first["ray"] == k)
        assert [first["kind"][row] for row in rows_of_first] == kinds[:1]


def test_a_hit_on_a_shared_edge_counts_once() -> None:
    # Two mirrored halves; the rows of the second are reversed, so that both normals point up.
    second_half = ROOF * [-1, 1, 1] + [2, 0, 0]
    vertices = np.concatenate([ROOF.reshape(-1, 3), second_half.reshape(-1, 3)])
    roof = PatchSurface(vertices, np.array([[[0, 1], [2, 3]], [[6, 7], [4, 5]]]))
    result = find_hits(
        roof,
        [[1, 1, 5], [1, 1.5, 5], [-1, 1, 1], [1, -1, 1]],
        [[0, 0, -1]] * 2 + [[1, 0, 0], [0, 1, 0]],
    )
    assert result["kind"] == ["crossing", "crossing", "touching", "along"]
    assert result["counts"].tolist() == [1, 1, 1, 1]
    assert result["entering"] == [True, True, None, None]


def test_hits_do_not_depend_on_other_rays() -> None:
    surface = FAMILIES["NURBS"].surface(seed=5)
    origins, directions = scatter_rays(surface, 40)
    for hits in ("all", "first"):
        all_hits = find_hits(surface, origins, directions, hits)
        for k in range(5):
            part = find_hits(surface, origins[k::5], directions[k::5], hits)
            rows = all_hits["ray"] % 5 == k
            for column in ("t", "t_bounds", "uv", "kind"):
                expected = np.asarray(all_hits[column])[rows]
                np.testing.assert_array_equal(np.asarray(part[column]), expected)


def test_rays_that_cannot_be_decided_are_not_reached() -> None:
    """From far away, rounding is larger than the thickness; and one ray runs along a line."""
    result = find_hits(SQUARE, [[0.5, 0.5, 1e12], [0.5, 0.5, 3e38]], [[0, 0, -1], [0, 0, -1e-30]])
    assert result["reached"].tolist() == [False, False]
    line = BezierSurface(np.array([[[0.0, 0, 0], [0, 0, 0]], [[1, 0, 0], [1, 0, 0]]]))
    result = find_hits(line, [[-1, 0, 0], [0.3, 0, 2]], [[1, 0, 0], [0, 0, -1]])
    assert result["reached"].tolist() == [False, True]
    assert result["kind"] == ["touching"]


def test_more_hits_than_allowed_are_refused() -> None:
    """Each of three rays has a hit; two are allowed."""
    rays = RayQuery(np.full((3, 3), 0.5), np.full((3, 3), -1.0))
    with pytest.raises(TooLarge):
        intersect_rays(to_patches(SQUARE.lower()), rays, max_hits=2)


def test_the_number_of_pairs_of_a_request_is_bounded() -> None:
    """20 rays cross the cylinder; two rays run along it and need more pairs than are allowed."""
    origins = [[0.1, 2, k / 50] for k in range(20)] + [[0.8, 0.6, -4.0], [0.8, 0.6, 3.0]]
    directions = [[0, -1, 0]] * 20 + [[0, 0, 1], [0, 0, -1]]
    limits = replace(LIMITS, pairs=1000)
    result = find_hits(find("cylinder").surface(), origins, directions, limits=limits)
    assert result["reached"].tolist() == [True] * 20 + [False] * 2
    assert result["counts"].tolist()[:20] == [2] * 20


@pytest.mark.parametrize("size", [1e-140, 1e-160])
def test_intervals_of_rays_from_very_far_away_are_finite(size: float) -> None:
    tiny = BezierSurface(SQUARE.control_net * size)
    result = find_hits(
        tiny, [[size / 3, size / 4, 2], [size / 3, size / 4, 2e38]], [[0, 0, -2.0]] * 2
    )
    assert result["counts"].tolist() == [1, 1]
    low, high = result["t_bounds"].T
    assert np.all((low <= [1, 1e38]) & (high >= [1, 1e38]) & (high <= [1.1, 1.1e38]))
