"""Isoparametric curves: their points and their number; they meet, and borders are drawn once."""

from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given

from oracles import exact, triangles
from service.engine.wires.divisions import bound_isocurves
from service.engine.wires.isocurves import IsoCurves, sample_isocurves
from service.surface.batches import TrianglePatches
from service.surface.lowered import Part, PatchModel
from tests.engine.meshing import build_mesh
from tests.strategies import (
    Array,
    build_cube,
    build_model,
    nets,
    resolutions,
    split_models,
    triangle_nets,
    weighted_nets,
)
from tools.examples import lower_patches


def sample_curves(
    model: PatchModel, counts: tuple[int, int], resolution: tuple[int, int] = (4, 4)
) -> list[IsoCurves]:
    """Samples the curves, and checks that their numbers are within the predicted bounds."""
    result = sample_isocurves(model, resolution, counts)
    triangles = sum(b.count for b in model.batches if isinstance(b, TrianglePatches))
    tensor_patches = model.patch_count - triangles
    curves, points = bound_isocurves(tensor_patches, triangles, resolution, counts)
    assert sum(len(run.points) for run in result) <= curves
    assert sum(run.points[..., 0].size for run in result) <= points
    return result


def count_curves(runs: list[IsoCurves]) -> int:
    """The number of curves."""
    return sum(len(run.points) for run in runs)


def list_parameters(run: IsoCurves, k: int) -> Array:
    """Parameters of the samples of one curve."""
    share = np.linspace(0, 1, run.points.shape[1])[:, None]
    parameters: Array = (1 - share) * run.first[k] + share * run.last[k]
    return parameters


@given(weighted_nets(nets(limit=4)), resolutions)
def test_every_sample_is_a_point_of_the_surface(
    net_and_weights: tuple[Array, Array | None], resolution: tuple[int, int]
) -> None:
    """Each curve has constant u or v; its points agree with exact arithmetic."""
    net, weights = net_and_weights
    model = build_model([net], None if weights is None else [weights])
    exact_net = exact.to_exact_net(net, weights)
    for run in sample_curves(model, (3, 2), resolution):
        for k in range(len(run.points)):
            # The ends (u, v) of the curve have one equal parameter: u or v.
            is_constant = run.first[k] == run.last[k]
            assert is_constant.sum() == 1
            value = run.first[k][is_constant][0]
            assert value in ((0, 1 / 3, 2 / 3, 1) if is_constant[0] else (0, 1 / 2, 1))
            for (u, v), point in zip(list_parameters(run, k), run.points[k], strict=True):
                expected = exact.surface_point(exact_net, Fraction(u), Fraction(v))
                x, y, z, w = expected if len(expected) == 4 else (*expected, Fraction(1))
                np.testing.assert_allclose(point, [float(c / w) for c in (x, y, z)], atol=1e-11)


@given(triangle_nets())
def test_a_triangle_has_curves_in_three_directions(net: Array) -> None:
    batch = TrianglePatches(net[np.newaxis])
    model = PatchModel("model", (batch,), (Part("model", 0, 1),))
    exact_net = triangles.to_exact_triangle(net)
    runs = sample_curves(model, (4, 1), (5, 8))
    for run in runs:
        for k in range(len(run.points)):
            for (s, t), point in zip(list_parameters(run, k), run.points[k], strict=True):
                place = (1 - Fraction(s) - Fraction(t), Fraction(s), Fraction(t))
                expected = [float(c) for c in triangles.value(exact_net, place)]
                np.testing.assert_allclose(point, expected, atol=1e-11)
    if len({tuple(point) for point in net.tolist()}) == len(net):  # no side is one point
        # A triangle takes the larger count, 4, and the larger resolution, 8. So its 3 sides have 8
        # divisions, and the lines at 1/4, 1/2 and 3/4 in each of 3 directions have 6, 4 and 2.
        divisions = Counter(run.points.shape[1] - 1 for run in runs for _ in run.points)
        assert divisions == {8: 3, 6: 3, 4: 3, 2: 3}


@pytest.mark.parametrize(
    ("counts", "expected"),
    [((1, 1), 4), ((3, 2), 7), ((0, 2), 3), ((5, 0), 6), ((0, 0), 0), ((1, 0), 2)],
)
def test_one_patch_has_the_right_number_of_curves(counts: tuple[int, int], expected: int) -> None:
    assert count_curves(sample_curves(lower_patches("tveit"), counts)) == expected


def test_shared_borders_are_drawn_once() -> None:
    """A cube has 12 edges, and each face has 3 inner lines in each direction."""
    # Differently rotated and mirrored faces: some borders have opposite directions in two faces.
    model = build_model(build_cube((0, 3, 5, 6, 2, 1)))
    assert count_curves(sample_curves(model, (1, 1))) == 12
    assert count_curves(sample_curves(model, (4, 4))) == 12 + 6 * 6


def test_poles_are_not_drawn() -> None:
    """A sphere of eight octants: 3 great circles in quarters, and 1 meridian in each octant."""
    sphere = lower_patches("sphere")
    assert count_curves(sample_curves(sphere, (1, 1))) == 12
    assert count_curves(sample_curves(sphere, (2, 1))) == 20
    for run in sample_curves(sphere, (3, 3)):
        np.testing.assert_allclose(np.linalg.norm(run.points, axis=-1), 1, atol=1e-15)


@given(split_models(oriented=False))
def test_curves_of_neighbours_meet_bit_for_bit(net_and_pieces: tuple[Array, list[Array]]) -> None:
    """Inside the surface, at least two curves end at each end of a curve."""
    _, pieces = net_and_pieces
    model = build_model(pieces)
    runs = sample_curves(model, (3, 3), (4, 6))
    # The first two runs are the borders of patches, with 4 and with 6 divisions.
    patch_corners = {tuple(end) for run in runs[:2] for c in run.points for end in (c[0], c[-1])}
    ends = Counter(tuple(end) for run in runs for c in run.points for end in (c[0], c[-1]))
    single_ends = [end for end, uses in ends.items() if uses == 1 and end not in patch_corners]
    # At each of the 8 edges on the border of the surface, 2 inner curves end.
    assert len(single_ends) == 16


@pytest.mark.parametrize("example", ["utah-teapot", "torus", "cone"])
def test_lines_pass_through_the_vertices_of_the_mesh(example: str) -> None:
    """The number of curves divides the resolution, so each point of a curve is a vertex."""
    vertices = build_mesh(example, resolution=(8, 8)).positions
    vertex_points = {tuple(vertex) for vertex in vertices.tolist()}
    borders, *inner_runs = sample_curves(lower_patches(example), (4, 4), (8, 8))
    border_points = borders.points.reshape(-1, 3).tolist()
    assert all(tuple(point) in vertex_points for point in border_points)
    # Inner curves have the bits of the mesh only at their ends; adding 0.0 makes −0.0 equal to 0.0.
    rounded_vertices = {tuple(vertex) for vertex in (vertices.round(9) + 0.0).tolist()}
    for run in inner_runs:
        ends = run.points[:, [0, -1]].reshape(-1, 3).tolist()
        assert all(tuple(end) in vertex_points for end in ends)
        rounded_points = run.points.round(9).reshape(-1, 3) + 0.0
        assert all(tuple(point) in rounded_vertices for point in rounded_points.tolist())


def test_the_curves_of_a_spline_follow_its_knots() -> None:
    """With counts (1, 1) they are the knot lines; (2, 2) adds the middle of each span."""
    model = lower_patches("bspline-hills")
    assert model.domain is not None
    spans_u, spans_v = len(model.domain.u) - 1, len(model.domain.v) - 1
    edges = spans_u * (spans_v + 1) + spans_v * (spans_u + 1)
    assert count_curves(sample_curves(model, (1, 1))) == edges
    assert count_curves(sample_curves(model, (2, 2))) == edges + 2 * spans_u * spans_v
