"""No sample of a surface is further from the mesh than the certificate says."""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.bounds import certificate
from service.engine.bounds.certificate import PartBounds, PieceMeasure, certify, find_covering_hulls
from service.engine.bounds.clip import clip_parts
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal, View
from service.engine.bounds.patch_nets import PatchNets
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from tests.engine.bounds.divided_faces import (
    GOAL,
    build_face,
    build_parts,
    check_bounds,
    divide_evenly,
    divide_face,
    draw_places,
    drop_neighbours,
    evaluate_places,
    measure_deviations,
    measure_reference_distances,
)


def build_net(rng: np.random.Generator, p: int, q: int, spread: float) -> np.ndarray:
    """A net over a regular grid, with random changes of its points."""
    x, y = np.meshgrid(np.linspace(0, 1, p + 1), np.linspace(0, 1, q + 1), indexing="ij")
    flat = np.stack([x, y, 0 * x], axis=-1)
    return flat + [spread, spread, 0.5] * rng.uniform(-1, 1, flat.shape)


DEGREES = [(1, 1), (3, 3), (2, 5), (4, 4), (7, 1), (6, 6), (3, 15)]


@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize(("p", "q"), DEGREES)
def test_no_sample_is_beyond_the_bound(p: int, q: int, rational: bool) -> None:
    spread = 0.1 if DEGREES.index((p, q)) % 2 == rational else 0.5
    rng = np.random.default_rng(p * 100 + q)
    net = build_net(rng, p, q, spread)
    weights = np.exp(rng.uniform(-2, 2, net.shape[:2])) if rational else None
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    for u, v in (
        (divide_evenly(1), divide_evenly(1)),
        (divide_evenly(4), divide_evenly(8)),
        (draw_places(rng, 5),) * 2,
    ):
        places, corners, beyond = divide_face(u, v)
        parts = build_parts(places, corners, beyond)
        positions = evaluate_places(patch_nets, faces, places)
        bounds, _ = check_bounds(patch_nets, faces, parts, positions)
        alone, _ = check_bounds(patch_nets, faces, drop_neighbours(parts), positions)
        assert (bounds.deviation <= alone.deviation * (1 + 1e-12)).all()


@pytest.mark.parametrize(("spread", "worst"), [(0.1, 1.1), (0.35, 1.12)])
def test_the_bound_is_hardly_more_than_the_truth(spread: float, worst: float) -> None:
    ratios = []
    for seed in range(2):
        net = build_net(np.random.default_rng(seed), 3, 3, spread)
        patch_nets, faces = PatchNets.of(BezierSurface(net).lower()), build_face()
        places, corners, beyond = divide_face(divide_evenly(16), divide_evenly(16))
        parts = build_parts(places, corners, beyond)
        bounds, result = check_bounds(
            patch_nets, faces, parts, evaluate_places(patch_nets, faces, places)
        )
        ratios.append(bounds.deviation / result)
    assert np.median(ratios) < worst


def test_no_sample_of_a_part_across_knot_lines_is_beyond_the_bound() -> None:
    rng = np.random.default_rng(12)
    net = build_net(rng, 7, 6, 0.2)
    for weights in (None, rng.uniform(0.3, 3, (8, 7))):
        surface = BsplineSurface(net, (3, 2), weights=weights)
        patch_nets, faces = PatchNets.of(surface.lower()), build_face(5, 5)
        for u, v in (
            (divide_evenly(1, 5), divide_evenly(1, 5)),
            (draw_places(rng, 3, 5), draw_places(rng, 4, 5)),
        ):
            places, corners, beyond = divide_face(u, v)
            parts = build_parts(places, corners, beyond)
            check_bounds(patch_nets, faces, parts, evaluate_places(patch_nets, faces, places))


def test_patches_that_a_part_covers_are_bounded_by_their_hulls_where_that_is_enough(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Shared bounds hold for all pieces, although few pieces are bounded by their own nets."""
    net = build_net(np.random.default_rng(13), 15, 16, 0.02)
    patch_nets, faces = PatchNets.of(BsplineSurface(net, (3, 2)).lower()), build_face(13, 15)
    places, corners, beyond = divide_face(divide_evenly(1, 13), divide_evenly(1, 15))
    parts, positions = (
        build_parts(places, corners, beyond),
        evaluate_places(patch_nets, faces, places),
    )
    counts: list[int] = []

    def count_pieces(self: PieceMeasure, part_bounds: np.ndarray, rows: np.ndarray) -> None:
        counts.append(len(rows))
        bound_pieces(self, part_bounds, rows)

    bound_pieces = PieceMeasure.bound_pieces
    monkeypatch.setattr(PieceMeasure, "bound_pieces", count_pieces)
    bounds, _ = check_bounds(patch_nets, faces, parts, positions)
    few, counts[:] = sum(counts), []
    monkeypatch.setattr(certificate, "COVERED", 10**9)
    every = certify(patch_nets, faces, parts, positions, GOAL)
    assert every.deviation.tolist() == bounds.deviation.tolist()
    assert few < 0.5 * sum(counts)


def test_pieces_of_the_covered_patch_with_the_largest_hull_are_bounded_first() -> None:
    """A patch is covered if its four corners are in the part, for any directions of its edges."""
    net = build_net(np.random.default_rng(15), 15, 15, 0.02)
    patch_nets, faces = PatchNets.of(BsplineSurface(net, (3, 3)).lower()), build_face(13, 13)
    corners = SPAN * np.array([[[0, 0], [13, 3], [4, 13]], [[0, 1], [12, 0], [10, 13]]])
    reference = np.arange(6).reshape(2, 3)
    parts = build_parts(corners.reshape(-1, 2), reference, np.full((2, 3), -1))
    pieces = clip_parts(faces, parts.face, parts.corners.transpose(1, 2, 0))
    positions = evaluate_places(patch_nets, faces, corners.reshape(-1, 2))
    measure = PieceMeasure(patch_nets, parts, pieces, positions, GOAL, None)
    result = find_covering_hulls(measure)
    assert result is not None
    hull, is_first = result
    exact = np.zeros((3, len(pieces.part)))
    measure.bound_pieces(exact, np.arange(len(pieces.part)))
    assert (exact[0] <= hull * (1 + 1e-12)).all()
    first = SPAN * np.stack([pieces.patch // 13, pieces.patch % 13], axis=1)
    covered = np.ones(len(first), dtype=bool)
    for corner in SPAN * np.array([[0, 0], [0, 1], [1, 0], [1, 1]]):
        for k in range(3):
            begin, end = corners[pieces.part, k], corners[pieces.part, (k + 1) % 3]
            along, offset = (end - begin) // SPAN, (first + corner - begin) // SPAN
            covered &= along[:, 0] * offset[:, 1] >= along[:, 1] * offset[:, 0]
    largest = [hull[covered & (pieces.part == part)].max() for part in range(2)]
    expected = covered & (hull >= np.array(largest)[pieces.part])
    assert is_first.tolist() == expected.tolist()


def test_parts_pass_with_the_allowed_deviation_and_twice_that_for_the_mesh() -> None:
    deviation, mesh = np.array([1.0, 1.0, 1.1]), np.array([2.0, 2.1, 0.0])
    assert PartBounds(deviation, mesh, np.ones(3)).meets_goal.tolist() == [True, False, False]
    assert PartBounds(deviation, None, np.ones(3)).meets_goal.tolist() == [True, True, False]


def test_a_plane_has_distance_zero_from_two_triangles_however_it_is_parametrised() -> None:
    rng = np.random.default_rng(13)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    for p, q in ((3, 3), (2, 6), (9, 9)):
        net = rng.random((p + 1, q + 1, 2))
        sides = np.linspace(0, 1, p + 1), np.linspace(0, 1, q + 1)
        for row, x in ((0, 0), (-1, 1)):
            net[row], net[:, row] = (np.stack([x + 0 * s, s], -1) for s in sides[::-1])
            net[:, row] = net[:, row][:, ::-1]
        net = net @ (axes[:2] * 7) + 3
        patch_nets, faces = PatchNets.of(BezierSurface(net).lower()), build_face()
        places, corners, beyond = divide_face(divide_evenly(1), divide_evenly(1))
        parts = build_parts(places, corners, beyond)
        bounds, _ = check_bounds(
            patch_nets, faces, parts, evaluate_places(patch_nets, faces, places)
        )
        assert bounds.deviation.max() < 1e-11


@pytest.mark.parametrize("fault", ["one point", "two points", "a line", "near a line"])
def test_bounds_hold_for_reference_triangles_without_area(fault: str) -> None:
    rng = np.random.default_rng(14)
    patch_nets, faces = PatchNets.of(BezierSurface(build_net(rng, 3, 3, 0.3)).lower()), build_face()
    places, corners, beyond = divide_face(divide_evenly(2), divide_evenly(2))
    parts = build_parts(places, corners, beyond)
    positions = evaluate_places(patch_nets, faces, places)
    if fault == "one point":
        positions[:] = positions[4]
    elif fault == "two points":
        positions[:] = positions[[0, 8]][np.arange(9) % 2]
    else:
        share = rng.random((9, 1))
        positions = positions[0] + share * (positions[8] - positions[0])
        if fault == "near a line":
            positions += 1e-13 * rng.normal(size=(9, 3))
    check_bounds(patch_nets, faces, parts, positions)


def test_folded_neighbours_do_not_lower_the_bound_too_far() -> None:
    """The bound also holds if a neighbour lies over the reference triangle, or is orthogonal."""
    rng = np.random.default_rng(18)
    patch_nets, faces = PatchNets.of(BezierSurface(build_net(rng, 3, 3, 0.6)).lower()), build_face()
    for _ in range(40):
        places, corners, beyond = divide_face(divide_evenly(2), divide_evenly(2))
        positions = evaluate_places(patch_nets, faces, places)
        positions = positions + rng.normal(size=positions.shape) * rng.choice([0, 0.05, 0.5])
        check_bounds(patch_nets, faces, build_parts(places, corners, beyond), positions)


def test_the_goal_grows_with_the_least_distance_from_the_eye() -> None:
    rng = np.random.default_rng(21)
    net = build_net(rng, 3, 3, 0.2)
    weights = rng.uniform(0.5, 2, (4, 4))
    eye = np.array([0.4, 3.0, 2.0])
    goal = Goal(1.0, view=View(eye, 0.01, 0.5))
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    places, corners, beyond = divide_face(divide_evenly(8), divide_evenly(8))
    parts = build_parts(places, corners, beyond)
    positions = evaluate_places(patch_nets, faces, places)
    bounds = certify(patch_nets, faces, parts, positions, goal)
    points = np.full((1, 3, 3), eye)
    to_eye = -measure_deviations(
        patch_nets, faces, parts, np.repeat(points[0][:1], len(positions), axis=0)
    )
    assert (bounds.allowed <= 0.01 * np.abs(to_eye)).all()
    nearest = np.linalg.norm(positions[corners] - eye, axis=2).min(axis=1)
    assert (bounds.allowed >= 0.01 * (nearest - 0.15)).all()
    np.testing.assert_array_equal(bounds.meets_goal, bounds.deviation <= bounds.allowed)


@pytest.mark.parametrize("rational", [False, True])
@pytest.mark.parametrize(("p", "q"), [(1, 2), (3, 3), (6, 5), (3, 12)])
def test_no_point_of_a_reference_triangle_is_beyond_the_bound_of_the_mesh(
    p: int, q: int, rational: bool
) -> None:
    rng = np.random.default_rng(22)
    net = build_net(rng, p, q, 0.3)
    weights = np.exp(rng.uniform(-1, 1, net.shape[:2])) if rational else None
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    for u, v in ((divide_evenly(4), divide_evenly(8)), (draw_places(rng, 5), draw_places(rng, 4))):
        places, corners, beyond = divide_face(u, v)
        parts = build_parts(places, corners, beyond)
        positions = evaluate_places(patch_nets, faces, places)
        bounds = certify(patch_nets, faces, parts, positions, replace(GOAL, two_sided=True))
        result = measure_reference_distances(patch_nets, faces, parts, positions)
        assert bounds.mesh is not None
        assert (result <= bounds.mesh).all()
        assert np.median(bounds.mesh / result) < 1.5
        np.testing.assert_array_equal(
            bounds.meets_goal, (bounds.deviation <= 1) & (bounds.mesh <= 2)
        )


def test_the_bound_of_the_mesh_is_0_for_reference_triangles_of_other_parts() -> None:
    rng = np.random.default_rng(23)
    patch_nets, faces = (
        PatchNets.of(BsplineSurface(build_net(rng, 7, 6, 0.2), (3, 2)).lower()),
        build_face(5, 5),
    )
    places, corners, beyond = divide_face(draw_places(rng, 3, 5), draw_places(rng, 4, 5))
    is_own_part = np.arange(len(corners)) % 3 > 0
    parts = replace(build_parts(places, corners, beyond), is_own=is_own_part)
    positions = evaluate_places(patch_nets, faces, places)
    mesh = certify(patch_nets, faces, parts, positions, replace(GOAL, two_sided=True)).mesh
    assert mesh is not None
    result = measure_reference_distances(patch_nets, faces, parts, positions)
    assert (result[is_own_part] <= mesh[is_own_part] + 1e-8).all()
    assert np.median(mesh[is_own_part] / result[is_own_part]) < 1.5
    assert (mesh[~is_own_part] == 0).all()
