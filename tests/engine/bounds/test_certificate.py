"""No sample of a surface is further from the mesh than the certificate says."""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.bounds import certificate
from service.engine.bounds.certificate import certify
from service.engine.bounds.goal import Goal, View
from service.engine.bounds.patch_nets import PatchNets
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from tests.engine.bounds.parting import (
    GOAL,
    checked,
    divided,
    divisions,
    evaluated,
    one_face,
    parts_of,
    seen,
    strayed,
    uneven,
    without_neighbours,
)


def sheet(rng: np.random.Generator, p: int, q: int, spread: float) -> np.ndarray:
    """A net over a grid, its points moved about."""
    x, y = np.meshgrid(np.linspace(0, 1, p + 1), np.linspace(0, 1, q + 1), indexing="ij")
    flat = np.stack([x, y, 0 * x], axis=-1)
    return flat + [spread, spread, 0.5] * rng.uniform(-1, 1, flat.shape)


DEGREES = [(1, 1), (3, 3), (2, 5), (4, 4), (7, 1), (6, 6), (3, 15)]


@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize(("p", "q"), DEGREES)
@pytest.mark.parametrize("spread", [0.1, 0.5])
def test_no_sample_is_beyond_the_bound(p: int, q: int, rational: bool, spread: float) -> None:
    rng = np.random.default_rng(p * 100 + q)
    net = sheet(rng, p, q, spread)
    weights = np.exp(rng.uniform(-2, 2, net.shape[:2])) if rational else None
    ground, faces = PatchNets.of(BezierSurface(net, weights).lower()), one_face()
    for u, v in ((divisions(1), divisions(1)), (divisions(4), divisions(8)), (uneven(rng, 5),) * 2):
        places, corners, beyond = divided(u, v)
        parts = parts_of(places, corners, beyond)
        positions = evaluated(ground, faces, places)
        bounds, _ = checked(ground, faces, parts, positions)
        alone, _ = checked(ground, faces, without_neighbours(parts), positions)
        assert (bounds.deviation <= alone.deviation * (1 + 1e-12)).all()


@pytest.mark.parametrize(("spread", "worst"), [(0.1, 1.1), (0.35, 1.12)])
def test_the_bound_is_hardly_more_than_the_truth(spread: float, worst: float) -> None:
    ratios = []
    for seed in range(4):
        net = sheet(np.random.default_rng(seed), 3, 3, spread)
        ground, faces = PatchNets.of(BezierSurface(net).lower()), one_face()
        places, corners, beyond = divided(divisions(16), divisions(16))
        parts = parts_of(places, corners, beyond)
        bounds, found = checked(ground, faces, parts, evaluated(ground, faces, places))
        ratios.append(bounds.deviation / found)
    assert np.median(ratios) < worst


def test_parts_across_knot_lines() -> None:
    rng = np.random.default_rng(12)
    net = sheet(rng, 7, 6, 0.2)
    for weights in (None, rng.uniform(0.3, 3, (8, 7))):
        surface = BsplineSurface(net, (3, 2), weights=weights)
        ground, faces = PatchNets.of(surface.lower()), one_face(5, 5)
        for u, v in ((divisions(1, 5), divisions(1, 5)), (uneven(rng, 3, 5), uneven(rng, 4, 5))):
            places, corners, beyond = divided(u, v)
            parts = parts_of(places, corners, beyond)
            checked(ground, faces, parts, evaluated(ground, faces, places))


def test_patches_that_a_part_covers_are_bounded_by_their_hulls_where_that_is_enough(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The bounds are those of all pieces, though few of these are looked at."""
    net = sheet(np.random.default_rng(13), 15, 16, 0.02)
    ground, faces = PatchNets.of(BsplineSurface(net, (3, 2)).lower()), one_face(13, 15)
    places, corners, beyond = divided(divisions(1, 13), divisions(1, 15))
    parts, positions = parts_of(places, corners, beyond), evaluated(ground, faces, places)
    looked: list[int] = []

    def add(self: certificate._Measure, found: np.ndarray, wanted: np.ndarray) -> None:
        looked.append(len(wanted))
        of_all(self, found, wanted)

    of_all = certificate._Measure.add
    monkeypatch.setattr(certificate._Measure, "add", add)
    bounds, _ = checked(ground, faces, parts, positions)
    few, looked[:] = sum(looked), []
    monkeypatch.setattr(certificate, "COVERED", 10**9)
    every = certify(ground, faces, parts, positions, GOAL)
    assert every.deviation.tolist() == bounds.deviation.tolist()
    assert few < 0.5 * sum(looked)


def test_a_plane_is_at_no_distance_from_two_triangles_whatever_its_parameters_do() -> None:
    rng = np.random.default_rng(13)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    for p, q in ((3, 3), (2, 6), (9, 9)):
        net = rng.random((p + 1, q + 1, 2))
        sides = np.linspace(0, 1, p + 1), np.linspace(0, 1, q + 1)
        for row, x in ((0, 0), (-1, 1)):
            net[row], net[:, row] = (np.stack([x + 0 * s, s], -1) for s in sides[::-1])
            net[:, row] = net[:, row][:, ::-1]
        net = net @ (axes[:2] * 7) + 3
        ground, faces = PatchNets.of(BezierSurface(net).lower()), one_face()
        places, corners, beyond = divided(divisions(1), divisions(1))
        parts = parts_of(places, corners, beyond)
        bounds, _ = checked(ground, faces, parts, evaluated(ground, faces, places))
        assert bounds.deviation.max() < 1e-11


@pytest.mark.parametrize("fault", ["one point", "two points", "a line", "near a line"])
def test_hosts_that_are_no_triangles(fault: str) -> None:
    rng = np.random.default_rng(14)
    ground, faces = PatchNets.of(BezierSurface(sheet(rng, 3, 3, 0.3)).lower()), one_face()
    places, corners, beyond = divided(divisions(2), divisions(2))
    parts = parts_of(places, corners, beyond)
    positions = evaluated(ground, faces, places)
    if fault == "one point":
        positions[:] = positions[4]
    elif fault == "two points":
        positions[:] = positions[[0, 8]][np.arange(9) % 2]
    else:
        share = rng.random((9, 1))
        positions = positions[0] + share * (positions[8] - positions[0])
        if fault == "near a line":
            positions += 1e-13 * rng.normal(size=(9, 3))
    checked(ground, faces, parts, positions)


def test_folded_neighbours_are_no_excuse() -> None:
    """Neighbours are where they are, also if they lie over the host, or at right angles to it."""
    rng = np.random.default_rng(18)
    ground, faces = PatchNets.of(BezierSurface(sheet(rng, 3, 3, 0.6)).lower()), one_face()
    for _ in range(40):
        places, corners, beyond = divided(divisions(2), divisions(2))
        positions = evaluated(ground, faces, places)
        positions = positions + rng.normal(size=positions.shape) * rng.choice([0, 0.05, 0.5])
        checked(ground, faces, parts_of(places, corners, beyond), positions)


def test_the_goal_grows_with_the_least_distance_from_the_eye() -> None:
    rng = np.random.default_rng(21)
    net = sheet(rng, 3, 3, 0.2)
    weights = rng.uniform(0.5, 2, (4, 4))
    eye = np.array([0.4, 3.0, 2.0])
    goal = Goal(1.0, view=View(eye, 0.01, 0.5))
    ground, faces = PatchNets.of(BezierSurface(net, weights).lower()), one_face()
    places, corners, beyond = divided(divisions(8), divisions(8))
    parts = parts_of(places, corners, beyond)
    positions = evaluated(ground, faces, places)
    bounds = certify(ground, faces, parts, positions, goal)
    points = np.full((1, 3, 3), eye)
    to_eye = -seen(ground, faces, parts, np.repeat(points[0][:1], len(positions), axis=0))
    assert (bounds.allowed <= 0.01 * np.abs(to_eye)).all()
    nearest = np.linalg.norm(positions[corners] - eye, axis=2).min(axis=1)
    assert (bounds.allowed >= 0.01 * (nearest - 0.15)).all()
    np.testing.assert_array_equal(bounds.passed, bounds.deviation <= bounds.allowed)


@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize(("p", "q"), [(1, 2), (3, 3), (6, 5), (3, 12)])
def test_no_point_of_a_host_is_beyond_the_bound_of_the_mesh(p: int, q: int, rational: bool) -> None:
    rng = np.random.default_rng(22)
    net = sheet(rng, p, q, 0.3)
    weights = np.exp(rng.uniform(-1, 1, net.shape[:2])) if rational else None
    ground, faces = PatchNets.of(BezierSurface(net, weights).lower()), one_face()
    for u, v in ((divisions(4), divisions(8)), (uneven(rng, 5), uneven(rng, 4))):
        places, corners, beyond = divided(u, v)
        parts = parts_of(places, corners, beyond)
        positions = evaluated(ground, faces, places)
        bounds = certify(ground, faces, parts, positions, replace(GOAL, two_sided=True))
        found = strayed(ground, faces, parts, positions)
        assert bounds.mesh is not None
        assert (found <= bounds.mesh).all()
        assert np.median(bounds.mesh / found) < 1.5
        np.testing.assert_array_equal(bounds.passed, (bounds.deviation <= 1) & (bounds.mesh <= 2))


def test_the_bound_of_the_mesh_holds_across_knot_lines_and_not_for_foster_parents() -> None:
    rng = np.random.default_rng(23)
    ground, faces = (
        PatchNets.of(BsplineSurface(sheet(rng, 7, 6, 0.2), (3, 2)).lower()),
        one_face(5, 5),
    )
    places, corners, beyond = divided(uneven(rng, 3, 5), uneven(rng, 4, 5))
    own = np.arange(len(corners)) % 3 > 0
    parts = replace(parts_of(places, corners, beyond), own=own)
    positions = evaluated(ground, faces, places)
    mesh = certify(ground, faces, parts, positions, replace(GOAL, two_sided=True)).mesh
    assert mesh is not None
    found = strayed(ground, faces, parts, positions)
    assert (found[own] <= mesh[own] + 1e-8).all()
    assert np.median(mesh[own] / found[own]) < 1.5
    assert (mesh[~own] == 0).all()
