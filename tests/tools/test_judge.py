"""`make judge`, which shares no code with the engine, proves true bounds and refutes false ones."""

from collections import Counter
from collections.abc import Iterator
from itertools import product
from math import comb
from typing import Any

import numpy as np
import pytest

from service.api.app import create_app
from service.settings.values import Settings
from service.surface.bspline import BsplineSurface
from tests.api.client import Client, start_client
from tests.oracles.sheets import TensorSheet, build_sheets
from tests.strategies import Array
from tools.certify.surfaces import FAMILIES
from tools.judge.__main__ import Case, Verdict, judge, judge_cases, list_cases, write_document
from tools.judge.enclosures import enclose_least_distances
from tools.judge.exact import list_nets, read_glb
from tools.judge.proof import Mesh, _bound_distances, _halve_pieces, _project_points, prove

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
    (hull,) = verdicts  # a group has no patches of its own
    assert isinstance(hull, Verdict)
    assert (hull.proof.undecided, hull.proof.beyond) == (0, None)


@pytest.mark.parametrize("family", ["bicubic, wild", "NURBS", "rational triangles"])
def test_a_moved_vertex_and_a_missing_triangle_are_detected(client: Client, family: str) -> None:
    """A vertex is moved by three times the bound; then the largest triangle is removed."""
    surface: dict[str, Any] = write_document(FAMILIES[family].surface(7))
    response = client.post(
        "/v1/mesh?format=glb", {"surface": surface, "normals": False, **ACCURACY}
    )
    corners, origin = read_glb(response.content)
    nets, bound = list_nets(surface, origin), float(response.headers["surface-deviation-bound"])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    largest = np.linalg.norm(normals, axis=1).argmax()
    around = (corners == corners[largest, 0]).all(axis=2)
    normal = normals[around.any(axis=1)].sum(axis=0)
    broken = corners.copy()
    broken[around] += 3 * bound * normal / np.linalg.norm(normal)
    assert (prove(nets, broken, bound).beyond or 0) > bound
    assert prove(nets, corners, bound).beyond is None
    result = prove(nets, np.delete(corners, largest, axis=0), bound)
    assert (result.beyond or 0) > bound, "a triangle is missing"


@pytest.mark.parametrize("family", ["degrees 1 to 8", "rational", "creases", "NURBS",
                                    "rings and tori", "rational triangles"])  # fmt: skip
def test_nets_of_a_document_give_the_points_of_the_surface(family: str) -> None:
    for seed in range(2):
        surface = FAMILIES[family].surface(seed)
        (sheet,) = build_sheets(surface)
        (nets,) = list_nets(write_document(surface), sheet.origin)
        halves = [np.array([comb(n - 1, k) / 2.0 ** (n - 1) for k in range(n)])
                  for n in nets.shape[1:3]]  # fmt: skip
        middles = np.einsum("i,j,mijk->mk", *halves, nets)
        if isinstance(sheet, TensorSheet):
            u, v = ((b[1:] + b[:-1]) / 2 for b in sheet.breaks)
            places = np.array(list(product(u, v)))
        else:
            places = np.array([[0.25, 0.25]])
        assert isinstance(surface, BsplineSurface) or len(nets) == 1
        np.testing.assert_allclose(middles[:, :3] / middles[:, 3:], sheet.at(places), atol=1e-12)


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
        pieces = np.moveaxis(net, -1, 0)[:, np.newaxis]
        for _ in range(6):
            points = np.einsum("ai,bj,kmij->mabk", grid, grid, pieces)
            distances = mesh.soup.distances((points[..., :3] / points[..., 3:]).reshape(-1, 3))
            bounds = _bound_distances(mesh, _project_points(pieces), of_all=False)
            assert (distances.reshape(len(bounds), -1).max(axis=1) <= bounds + 1e-12).all()
            pieces = _halve_pieces(pieces, _project_points(pieces))


def test_every_family_has_200_cases() -> None:
    cases = list(list_cases())
    assert len({case.family for case in cases} & set(FAMILIES)) == len(FAMILIES) - 1
    assert set(Counter(case.family for case in cases if case.seed is not None).values()) == {200}


def test_enclosures_contain_the_distances_from_a_cylinder() -> None:
    """A quarter of a cylinder of radius 1 and height 1, whose distances have a closed form."""
    arc = np.array([[1, 0, 1], [1, 1, np.sqrt(0.5)], [0, 1, 1]])
    net = np.array([[[x * w, y * w, z * w, w] for z in (0.0, 1.0)] for x, y, w in arc])
    x = np.random.default_rng(3).uniform([0, 0, -1], [2, 2, 2], (40, 3))
    beyond = np.maximum(np.maximum(-x[:, 2], x[:, 2] - 1), 0.0)
    truth = np.hypot(np.hypot(x[:, 0], x[:, 1]) - 1, beyond)
    low, high = enclose_least_distances([net[np.newaxis]], x, 1e-9)
    assert ((low <= truth) & (truth <= high)).all()
    assert (high - low <= 1.001e-9).all()
    # All points of the arc are equally near to its axis, so no number of pieces is enough.
    assert np.isnan(
        enclose_least_distances([net[np.newaxis]], np.array([[0.0, 0.0, 0.5]]), 1e-9)[1]
    ).all()
