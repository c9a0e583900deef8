"""`make judge`, which shares no code with the engine, proves true bounds and refutes false ones."""

from collections import Counter
from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from math import comb
from typing import Any

import numpy as np
import pytest

from oracles.distance import measure_distances
from oracles.sheets import TensorSheet, build_sheets
from service.api.app import create_app
from service.settings.values import Settings
from service.surface.bspline import BsplineSurface
from tests.strategies import Array
from tools.certify.surfaces import FAMILIES
from tools.client import Client, start_client
from tools.judge.__main__ import Case, Verdict, judge, judge_cases, list_cases, write_document
from tools.judge.enclosures import enclose_least_distances
from tools.judge.exact import Exact, list_nets, read_glb, to_fractions
from tools.judge.hulls import cut_net, is_hull_near, measure_squared_distance
from tools.judge.proof import (
    Mesh,
    _find_closest,
    bound_distances,
    halve_pieces,
    project_points,
    prove,
)

ACCURACY = {"relative_tolerance": 3e-2}


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with start_client(create_app(Settings())) as client:
        yield client


@pytest.mark.parametrize(
    ("family", "suffix"),
    [("rational", "glb"), ("NURBS", "stl"), ("rational triangles", "glb"), ("far away", "stl")],
)
def test_bounds_of_meshes_are_proved(client: Client, family: str, suffix: str) -> None:
    """The test takes a few families; `make judge` takes all."""
    verdict = judge(client, Case(family, 7, ACCURACY, suffix))
    if verdict is None:  # STL is too coarse so far away
        assert (family, suffix) == ("far away", "stl")
        return
    assert (verdict.proof.undecided, verdict.proof.beyond) == (0, None)
    assert verdict.proof.pieces > 0


def test_bounds_of_built_in_multipatches_are_proved() -> None:
    verdicts = judge_cases(
        [Case("ship-hull", None, ACCURACY, "glb"), Case("tea-service", None, ACCURACY, "glb")]
    )
    # There is no verdict for tea-service: a group has no patches of its own.
    (hull,) = verdicts
    assert isinstance(hull, Verdict)
    assert (hull.proof.undecided, hull.proof.beyond) == (0, None)


def request_mesh(client: Client, surface: dict[str, Any]) -> tuple[list[Exact], Array, float]:
    """The nets of a surface, the corners of its mesh, and the bound."""
    request = {"surface": surface, "normals": False, **ACCURACY}
    response = client.post("/v1/mesh?format=glb", request)
    corners, origin = read_glb(response.content)
    return list_nets(surface, origin), corners, float(response.headers["surface-deviation-bound"])


@pytest.mark.parametrize("family", ["bicubic, wild", "NURBS", "rational triangles"])
def test_a_moved_vertex_and_a_missing_triangle_are_detected(client: Client, family: str) -> None:
    """A vertex is moved by three times the bound; then the largest triangle is removed."""
    nets, corners, bound = request_mesh(client, write_document(FAMILIES[family].surface(7)))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    largest_triangle = np.linalg.norm(normals, axis=1).argmax()
    is_at_vertex = (corners == corners[largest_triangle, 0]).all(axis=2)
    normal = normals[is_at_vertex.any(axis=1)].sum(axis=0)
    moved_corners = corners.copy()
    moved_corners[is_at_vertex] += 3 * bound * normal / np.linalg.norm(normal)
    assert (prove(nets, moved_corners, bound).beyond or 0) > bound
    assert prove(nets, corners, bound).beyond is None
    result = prove(nets, np.delete(corners, largest_triangle, axis=0), bound)
    assert (result.beyond or 0) > bound, "a triangle is missing"


@pytest.mark.parametrize("family", ["degrees 1 to 8", "rational", "creases", "NURBS",
                                    "rings and tori", "rational triangles"])  # fmt: skip
def test_nets_of_a_document_give_the_points_of_the_surface(family: str) -> None:
    for seed in range(2):
        surface = FAMILIES[family].surface(seed)
        (sheet,) = build_sheets(surface)
        (exact,) = list_nets(write_document(surface), sheet.origin)
        nets = exact.astype(np.float64)
        # The values of the Bernstein polynomials at 1/2.
        basis_values = [np.array([comb(n - 1, k) / 2.0 ** (n - 1) for k in range(n)])
                  for n in nets.shape[1:3]]  # fmt: skip
        middles = np.einsum("i,j,mijk->mk", *basis_values, nets)
        if isinstance(sheet, TensorSheet):
            u, v = ((b[1:] + b[:-1]) / 2 for b in sheet.breaks)
            places = np.array(list(product(u, v)))
        else:
            # As a patch, the triangle has u = s + t, and v is t / (s + t): both are 1/2 here.
            places = np.array([[0.25, 0.25]])
        assert isinstance(surface, BsplineSurface) or len(nets) == 1
        np.testing.assert_allclose(middles[:, :3] / middles[:, 3:], sheet.at(places), atol=1e-12)


@pytest.mark.parametrize(
    ("family", "seed"),
    [("triangles", 5026), ("rational triangles", 5036), ("poles", 5197), ("flat", 5000)],
)
def test_bounds_as_small_as_the_rounding_of_vertices_are_decided(
    client: Client, family: str, seed: int
) -> None:
    """Flat surfaces whose vertices are rounded to float32, and the same mesh beyond its bound."""
    nets, corners, bound = request_mesh(client, write_document(FAMILIES[family].surface(seed)))
    assert bound < 2e-7
    proof = prove(nets, corners, bound)
    assert (proof.undecided, proof.beyond) == (0, None)
    normal = np.cross(corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0])
    step = 1.0001 * bound * normal / np.linalg.norm(normal)
    # Vertices may be rounded towards one side of the surface.
    deviations = [prove(nets, corners + shift, bound).beyond or 0 for shift in (-step, step)]
    assert max(deviations) > bound


@pytest.mark.parametrize("count", [1, 2])
def test_a_distance_that_is_almost_the_bound_is_decided_exactly(count: int) -> None:
    """A square, and one half of it, above triangles that are parallel to it."""
    x = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 1], [1, 1, 1]]]) / 3
    net = np.append(x, np.ones((2, 2, 1)), axis=-1)
    if count == 1:
        net[1, 1] = net[1, 0]
    (a, b), (c, d) = x
    corners = np.array([[a, b, c], [d, c, b]])[:count]
    bound = 1e-8
    normal = np.array([-1, 0, 1]) / np.sqrt(2)
    for factor in (1 - 1e-6, 1 + 1e-6):
        proof = prove([to_fractions(net[np.newaxis])], corners + factor * bound * normal, bound)
        assert proof.undecided == 0
        # Pieces so near to the bound are proved by fractions; a point beyond it ends the proof.
        is_within_bound = factor < 1
        assert (proof.exact > 0) == is_within_bound
        assert (proof.beyond is None) == is_within_bound


def test_exact_distances_and_hulls() -> None:
    rng = np.random.default_rng(2)
    triangles = rng.uniform(-1, 1, (40, 3, 3))
    triangles[0, 2] = triangles[0, 1]
    triangles[1] = triangles[1, 0]
    points = rng.uniform(-2, 2, (40, 3))
    squared_distances = map(measure_squared_distance, to_fractions(points), to_fractions(triangles))
    expected = measure_distances(points, triangles)
    np.testing.assert_allclose(
        [float(squared_distance) ** 0.5 for squared_distance in squared_distances],
        expected,
        rtol=1e-12,
    )

    # The hull is a square at height 1/3 above the triangles `host` and `twin`, which share edge bc.
    a, b, c, d = to_fractions(np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]]))
    hull = np.stack([a, b, c, d]) + np.array([0, 0, Fraction(1, 3)])
    host, twin = np.stack([b, c, a]), np.stack([c, b, d])
    assert is_hull_near(hull, host, twin, Fraction(1, 3))
    assert not is_hull_near(hull, host, twin, Fraction(1, 3) - Fraction(1, 10**40))
    # Without the twin, the corner above d is √(1/2 + 1/9) ≈ 0.78 away from bc.
    assert not is_hull_near(hull, host, None, Fraction(1, 3))
    assert is_hull_near(hull, host, None, Fraction(9, 10))


def test_nearest_points_of_needles_are_near() -> None:
    """Triangles of length 1, some of them narrower than float64 can resolve.

    The point that is found is in the triangle, so its distance is the least one or larger.
    """
    rng = np.random.default_rng(4)
    corners = rng.uniform(-1, 1, (300, 3, 3))
    share = rng.uniform(0, 1, (300, 1))
    width = 10 ** rng.uniform(-14, -1, (300, 1))
    edge_points = corners[:, 0] + share * (corners[:, 1] - corners[:, 0])
    corners[:, 2] = edge_points + width * corners[:, 2]
    points = np.einsum("mk,mki->mi", rng.dirichlet(np.ones(3), 300), corners)
    points += 10 ** rng.uniform(-9, -1, (300, 1)) * rng.uniform(-1, 1, points.shape)
    distances, _, _ = _find_closest(
        points.T[..., np.newaxis], corners.transpose(1, 2, 0)[..., None]
    )
    for distance, point, each in zip(
        distances[:, 0], *map(to_fractions, (points, corners)), strict=True
    ):
        min_distance = float(measure_squared_distance(point, each)) ** 0.5
        assert min_distance - 1e-15 <= distance <= min_distance + 1e-4


def crumple_square(rng: np.random.Generator, spread: float) -> Array:
    """Triangles (8, 3, 3) near the unit square, folded along their edges, some of them sharply."""
    grid = np.stack(np.meshgrid([0.0, 0.4, 1], [0.0, 0.7, 1], [0.0], indexing="ij"), -1)[:, :, 0]
    grid = grid + spread * rng.uniform(-1, 1, grid.shape)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.concatenate([np.stack(x, 2).reshape(-1, 3, 3) for x in ((a, b, d), (b, c, d))])


@pytest.mark.parametrize("spread", [0.02, 0.2, 0.6])
def test_distances_of_all_points_of_a_piece_are_within_its_bound(spread: float) -> None:
    """Pieces of many sizes are near folds, where a piece is near to two triangles."""
    rng = np.random.default_rng(5)
    t = np.linspace(0, 1, 9)
    lines = [np.array([comb(2, k) * x**k * (1 - x) ** (2 - k) for k in range(3)]) for x in t]
    grid = np.stack(lines)
    for _ in range(2):
        mesh = Mesh(crumple_square(rng, spread))
        net = np.append(rng.uniform(0, 1, (3, 3, 3)), rng.uniform(0.3, 3, (3, 3, 1)), axis=-1)
        net[..., 2] *= spread
        net[..., :3] *= net[..., 3:]
        # Each piece has three numbers in `places`: of its net, and of its interval along u and v,
        # where 1 is the whole interval, and 2k and 2k + 1 are the halves of k.
        pieces, places = np.moveaxis(net, -1, 0)[:, np.newaxis], np.array([[0], [1], [1]])
        for _ in range(6):
            points = np.einsum("ai,bj,kmij->mabk", grid, grid, pieces)
            distances = mesh.soup.distances((points[..., :3] / points[..., 3:]).reshape(-1, 3))
            bounds, _, _ = bound_distances(mesh, project_points(pieces), of_all=False)
            assert (distances.reshape(len(bounds), -1).max(axis=1) <= bounds + 1e-12).all()
            pieces, places = halve_pieces(pieces, places, project_points(pieces))
            for piece, (_, u, v) in zip(np.moveaxis(pieces, 0, -1), places.T, strict=True):
                cut = cut_net(to_fractions(net), u, v).astype(np.float64)
                np.testing.assert_allclose(piece, cut, rtol=0, atol=1e-15)


def test_every_family_has_200_cases() -> None:
    cases = list(list_cases())
    # One family is left out, because its surfaces are lines; the cases of examples have no seed.
    assert len({case.family for case in cases} & set(FAMILIES)) == len(FAMILIES) - 1
    assert set(Counter(case.family for case in cases if case.seed is not None).values()) == {200}


def test_enclosures_contain_the_distances_from_a_cylinder() -> None:
    """A quarter of a cylinder of radius 1 and height 1, whose distances have a closed form."""
    arc = np.array([[1, 0, 1], [1, 1, np.sqrt(0.5)], [0, 1, 1]])
    net = np.array([[[x * w, y * w, z * w, w] for z in (0.0, 1.0)] for x, y, w in arc])
    points = np.random.default_rng(3).uniform([0, 0, -1], [2, 2, 2], (40, 3))
    height_outside = np.maximum(np.maximum(-points[:, 2], points[:, 2] - 1), 0.0)
    distances = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1, height_outside)
    low, high = enclose_least_distances([net[np.newaxis]], points, 1e-9)
    assert ((low <= distances) & (distances <= high)).all()
    assert (high - low <= 1.001e-9).all()
    # All points of the arc are equally near to its axis, so no piece can be dropped, and the search
    # gives up with NaN.
    assert np.isnan(
        enclose_least_distances([net[np.newaxis]], np.array([[0.0, 0.0, 0.5]]), 1e-9)[1]
    ).all()
