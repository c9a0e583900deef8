"""No sample of a surface is further from the mesh than the certificate says."""

from dataclasses import replace

import numpy as np
import pytest

from service.engine.bounds.certificate import PartBounds, PieceMeasure, certify, find_covering_hulls
from service.engine.bounds.clip import clip_parts
from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal, View
from service.engine.nets.patch_nets import PatchNets
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


@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize(("p", "q"), DEGREES)
def test_no_sample_is_beyond_the_bound(p: int, q: int, is_rational: bool) -> None:
    # Half of the cases have nearly regular nets. Each degree has both kinds of nets.
    has_odd_index = DEGREES.index((p, q)) % 2 == 1
    spread = 0.1 if has_odd_index == is_rational else 0.5
    rng = np.random.default_rng(p * 100 + q)
    net = build_net(rng, p, q, spread)
    weights = np.exp(rng.uniform(-2, 2, net.shape[:2])) if is_rational else None
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    for u, v in (
        (divide_evenly(1), divide_evenly(1)),
        (divide_evenly(4), divide_evenly(8)),
        (draw_places(rng, 5),) * 2,
    ):
        places, corners, across = divide_face(u, v)
        parts = build_parts(places, corners, across)
        positions = evaluate_places(patch_nets, faces, places)
        bounds, _ = check_bounds(patch_nets, faces, parts, positions)
        without, _ = check_bounds(patch_nets, faces, drop_neighbours(parts), positions)
        assert (bounds.deviation <= without.deviation * (1 + 1e-12)).all()


@pytest.mark.parametrize(("spread", "max_median"), [(0.1, 1.1), (0.35, 1.12)])
def test_the_bound_is_hardly_more_than_the_truth(spread: float, max_median: float) -> None:
    ratios = []
    for seed in range(2):
        net = build_net(np.random.default_rng(seed), 3, 3, spread)
        patch_nets, faces = PatchNets.of(BezierSurface(net).lower()), build_face()
        places, corners, across = divide_face(divide_evenly(16), divide_evenly(16))
        parts = build_parts(places, corners, across)
        bounds, result = check_bounds(
            patch_nets, faces, parts, evaluate_places(patch_nets, faces, places)
        )
        ratios.append(bounds.deviation / result)
    assert np.median(ratios) < max_median


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
            places, corners, across = divide_face(u, v)
            parts = build_parts(places, corners, across)
            check_bounds(patch_nets, faces, parts, evaluate_places(patch_nets, faces, places))


def test_bounds_do_not_depend_on_a_part_without_pieces() -> None:
    net = build_net(np.random.default_rng(13), 3, 2, 0.2)
    surface = BsplineSurface(net, (2, 2))
    patch_nets, faces = PatchNets.of(surface.lower()), build_face(2, 1)
    places = np.array([(0, 0), (2 * SPAN, 0), (SPAN, SPAN)])
    # The corners of the first part are in a line, so it has no pieces; the second part has two.
    # Together they have as many pieces as there are parts.
    corners = np.array([(0, 1, 1), (0, 1, 2)])
    parts = build_parts(places, corners, np.full((2, 3), -1))
    assert clip_parts(faces, parts.face, parts.corners).part.tolist() == [1, 1]
    positions = evaluate_places(patch_nets, faces, places)
    together = certify(patch_nets, faces, parts, positions, GOAL).deviation
    alone = certify(patch_nets, faces, parts.take(slice(1, 2)), positions, GOAL).deviation
    assert together.tolist() == [0.0, *alone.tolist()]


def test_most_patches_inside_a_part_are_bounded_by_the_hulls_of_their_nets() -> None:
    """A part that covers many patches has one piece in each patch.

    Less than half of the pieces need nets of their own: the others are bounded by the hull of the
    net of the whole patch. The bounds of the parts stay the same.
    """
    net = build_net(np.random.default_rng(13), 15, 16, 0.02)
    patch_nets, faces = PatchNets.of(BsplineSurface(net, (3, 2)).lower()), build_face(13, 15)
    places, corners, across = divide_face(divide_evenly(1, 13), divide_evenly(1, 15))
    parts = build_parts(places, corners, across)
    positions = evaluate_places(patch_nets, faces, places)
    bounds, _ = check_bounds(patch_nets, faces, parts, positions)
    pieces = clip_parts(faces, parts.face, parts.corners)
    measure = PieceMeasure(patch_nets, parts, pieces, positions, GOAL, images=None)
    piece_bounds = np.zeros((3, len(pieces.part)))
    measure.bound_pieces(piece_bounds, np.arange(len(pieces.part)))
    largest = np.array([piece_bounds[0, pieces.part == part].max() for part in range(2)])
    assert largest.tolist() == bounds.deviation.tolist()
    result = find_covering_hulls(measure)
    assert result is not None
    hull_bounds, is_first = result
    needs_net = is_first | (hull_bounds > largest[pieces.part])
    assert needs_net.sum() < 0.5 * len(needs_net)


def test_pieces_of_the_covered_patch_with_the_largest_hull_are_bounded_first() -> None:
    """A part covers a patch if all four corners of the patch are in the part.

    The part is a triangle of parameters; its edges have any directions.
    """
    net = build_net(np.random.default_rng(15), 15, 15, 0.02)
    patch_nets, faces = PatchNets.of(BsplineSurface(net, (3, 3)).lower()), build_face(13, 13)
    corners = SPAN * np.array([[[0, 0], [13, 3], [4, 13]], [[0, 1], [12, 0], [10, 13]]])
    # Each part is measured against a triangle of the mesh, its reference triangle.
    reference = np.arange(6).reshape(2, 3)
    parts = build_parts(corners.reshape(-1, 2), reference, np.full((2, 3), -1))
    pieces = clip_parts(faces, parts.face, parts.corners)
    positions = evaluate_places(patch_nets, faces, corners.reshape(-1, 2))
    measure = PieceMeasure(patch_nets, parts, pieces, positions, GOAL, images=None)
    result = find_covering_hulls(measure)
    assert result is not None
    hull_bounds, is_first = result
    piece_bounds = np.zeros((3, len(pieces.part)))
    measure.bound_pieces(piece_bounds, np.arange(len(pieces.part)))
    deviation, _, _ = piece_bounds
    assert (deviation <= hull_bounds * (1 + 1e-12)).all()
    # A patch is covered if its corners are on the left of all edges of the part, or on an edge.
    first_corner = SPAN * np.stack([pieces.patch // 13, pieces.patch % 13], axis=1)
    is_covered = np.ones(len(first_corner), dtype=bool)
    for step in SPAN * np.array([[0, 0], [0, 1], [1, 0], [1, 1]]):
        for k in range(3):
            begin, end = corners[pieces.part, k], corners[pieces.part, (k + 1) % 3]
            edge, offset = (end - begin) // SPAN, (first_corner + step - begin) // SPAN
            is_covered &= edge[:, 0] * offset[:, 1] >= edge[:, 1] * offset[:, 0]
    largest = [hull_bounds[is_covered & (pieces.part == part)].max() for part in range(2)]
    expected = is_covered & (hull_bounds >= np.array(largest)[pieces.part])
    assert is_first.tolist() == expected.tolist()


def test_parts_pass_with_the_allowed_deviation_and_twice_that_for_the_mesh() -> None:
    """The surface may deviate from the mesh by 1 here, and the mesh from the surface by 2."""
    deviation, mesh = np.array([1.0, 1.0, 1.1]), np.array([2.0, 2.1, 0.0])
    assert PartBounds(deviation, mesh, np.ones(3)).meets_goal.tolist() == [True, False, False]
    assert PartBounds(deviation, None, np.ones(3)).meets_goal.tolist() == [True, True, False]


def test_a_plane_has_distance_zero_from_two_triangles_however_it_is_parametrised() -> None:
    rng = np.random.default_rng(13)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    for p, q in ((3, 3), (2, 6), (9, 9)):
        # The border of the net is a unit square, whose inner points are random; then the square is
        # placed in space.
        net = rng.random((p + 1, q + 1, 2))
        along_u, along_v = np.linspace(0, 1, p + 1), np.linspace(0, 1, q + 1)
        for row, value in ((0, 0.0), (-1, 1.0)):
            net[row] = np.stack([np.full(q + 1, value), along_v], axis=-1)
            net[:, row] = np.stack([along_u, np.full(p + 1, value)], axis=-1)
        net = net @ (axes[:2] * 7) + 3
        patch_nets, faces = PatchNets.of(BezierSurface(net).lower()), build_face()
        places, corners, across = divide_face(divide_evenly(1), divide_evenly(1))
        parts = build_parts(places, corners, across)
        bounds, _ = check_bounds(
            patch_nets, faces, parts, evaluate_places(patch_nets, faces, places)
        )
        assert bounds.deviation.max() < 1e-11


@pytest.mark.parametrize("fault", ["one point", "two points", "a line", "near a line"])
def test_bounds_hold_for_reference_triangles_without_area(fault: str) -> None:
    rng = np.random.default_rng(14)
    patch_nets, faces = PatchNets.of(BezierSurface(build_net(rng, 3, 3, 0.3)).lower()), build_face()
    places, corners, across = divide_face(divide_evenly(2), divide_evenly(2))
    parts = build_parts(places, corners, across)
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
        places, corners, across = divide_face(divide_evenly(2), divide_evenly(2))
        positions = evaluate_places(patch_nets, faces, places)
        positions = positions + rng.normal(size=positions.shape) * rng.choice([0, 0.05, 0.5])
        check_bounds(patch_nets, faces, build_parts(places, corners, across), positions)


def test_the_allowed_deviation_grows_with_the_least_distance_from_the_eye() -> None:
    rng = np.random.default_rng(21)
    net = build_net(rng, 3, 3, 0.2)
    weights = rng.uniform(0.5, 2, (4, 4))
    eye = np.array([0.4, 3.0, 2.0])
    goal = Goal(1.0, view=View(eye, rate=0.01, near=0.5))
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    places, corners, across = divide_face(divide_evenly(8), divide_evenly(8))
    parts = build_parts(places, corners, across)
    positions = evaluate_places(patch_nets, faces, places)
    bounds = certify(patch_nets, faces, parts, positions, goal)
    # If all vertices of the mesh are at the eye, deviations are distances from the eye.
    eye_distance = measure_deviations(patch_nets, faces, parts, np.tile(eye, (len(positions), 1)))
    assert (bounds.allowed <= 0.01 * eye_distance).all()
    # A part may be nearer to the eye than its corners, but not by more than 0.15: its sides are
    # about 1/8 long.
    nearest_corner = np.linalg.norm(positions[corners] - eye, axis=2).min(axis=1)
    assert (bounds.allowed >= 0.01 * (nearest_corner - 0.15)).all()
    np.testing.assert_array_equal(bounds.meets_goal, bounds.deviation <= bounds.allowed)


@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize(("p", "q"), [(1, 2), (3, 3), (6, 5), (3, 12)])
def test_no_point_of_a_reference_triangle_is_beyond_the_bound_of_the_mesh(
    p: int, q: int, is_rational: bool
) -> None:
    rng = np.random.default_rng(22)
    net = build_net(rng, p, q, 0.3)
    weights = np.exp(rng.uniform(-1, 1, net.shape[:2])) if is_rational else None
    patch_nets, faces = PatchNets.of(BezierSurface(net, weights).lower()), build_face()
    for u, v in ((divide_evenly(4), divide_evenly(8)), (draw_places(rng, 5), draw_places(rng, 4))):
        places, corners, across = divide_face(u, v)
        parts = build_parts(places, corners, across)
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
    """The reference triangle of a part is the triangle of the mesh that it is measured against.

    Usually it is the image of the part itself (`is_own`). Here a third of them are treated as
    images of other parts: their points are bounded with those parts.
    """
    rng = np.random.default_rng(23)
    patch_nets, faces = (
        PatchNets.of(BsplineSurface(build_net(rng, 7, 6, 0.2), (3, 2)).lower()),
        build_face(5, 5),
    )
    places, corners, across = divide_face(draw_places(rng, 3, 5), draw_places(rng, 4, 5))
    is_own = np.arange(len(corners)) % 3 > 0
    parts = replace(build_parts(places, corners, across), is_own=is_own)
    positions = evaluate_places(patch_nets, faces, places)
    mesh = certify(patch_nets, faces, parts, positions, replace(GOAL, two_sided=True)).mesh
    assert mesh is not None
    result = measure_reference_distances(patch_nets, faces, parts, positions)
    assert (result[is_own] <= mesh[is_own]).all()
    assert np.median(mesh[is_own] / result[is_own]) < 1.5
    assert (mesh[~is_own] == 0).all()
