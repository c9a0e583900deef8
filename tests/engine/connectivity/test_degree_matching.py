"""Neighbours of different degrees share an edge if their borders are the same curve."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oracles import triangles
from service.engine.connectivity.degree_matching import SAME_CURVE
from service.engine.connectivity.seams import Seams, find_seams
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Part, PatchModel
from tests.engine.meshing import build_mesh, check_sound, find_topology
from tests.strategies import Array, apply_symmetry, build_model, symmetries, translate

Curve = tuple[Array, Array]
"""Control points (n+1, 3) and weights (n+1,)."""


def elevate_exactly(curve: Curve, degree: int) -> Curve:
    """A curve elevated to a higher degree in exact arithmetic, rounded once at the end."""
    row = [
        [Fraction(w) * Fraction(x) for x in point] + [Fraction(w)]
        for point, w in zip(curve[0].tolist(), curve[1].tolist(), strict=True)
    ]
    for n in range(len(row) - 1, degree):
        shares = [Fraction(i, n + 1) for i in range(n + 2)]
        row = [
            [s * a + (1 - s) * b for a, b in zip(row[max(i - 1, 0)], row[min(i, n)], strict=True)]
            for i, s in enumerate(shares)
        ]
    points = np.array([[float(x / r[3]) for x in r[:3]] for r in row])
    return points, np.array([float(r[3]) for r in row])


def build_curves(count: int, degree: int, seed: int, is_rational: bool) -> list[Curve]:
    """Random curves side by side: x is the number of the curve, y its parameter."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.3, 0.3, (count, degree + 1, 3))
    points[..., 0] += np.arange(count)[:, None]
    points[..., 1] += np.linspace(0, 1, degree + 1)
    weights = (
        rng.uniform(0.3, 3, (count, degree + 1)) if is_rational else np.ones((count, degree + 1))
    )
    return list(zip(points, weights, strict=True))


def build_ribbons(
    lines: list[Curve], degrees: list[int], turns: list[int], is_rational: bool = False
) -> PatchModel:
    """Ruled patches: patch k is between curves k and k + 1, raised to degree `degrees[k]`.

    `turns[k]` is the symmetry that changes the parametrization of patch k.
    """
    nets, weights = [], []
    for k, degree in enumerate(degrees):
        sides = [elevate_exactly(lines[k + i], degree) for i in range(2)]
        nets.append(apply_symmetry(np.stack([points for points, _ in sides]), turns[k]))
        # A common factor of weights does not change the surface.
        weights.append(apply_symmetry(np.stack([(1 + k) * ws for _, ws in sides]), turns[k]))
    return build_model(nets, weights if is_rational else None)


def list_edges(seams: Seams) -> list[tuple[int, int]]:
    """(degree, number of sides) of each edge that is not a point, sorted."""
    edges = np.unique(seams.edge[~seams.collapsed])
    result = []
    for group in seams.curves:
        result += [
            (group.points.shape[1] - 1, int(seams.sides_per_edge[edge]))
            for edge in group.ids
            if edge in edges
        ]
    return sorted(result)


@given(
    st.integers(1, 3),
    st.lists(st.integers(0, 3), min_size=2, max_size=4),
    st.integers(0, 99),
    st.booleans(),
    st.data(),
)
def test_neighbours_of_any_degrees_share_their_edge(
    base: int, degree_steps: list[int], seed: int, is_rational: bool, data: st.DataObject
) -> None:
    """The edge has the lower of both degrees, for all orders and parametrizations of patches."""
    degrees = [base + k for k in degree_steps]
    count = len(degrees)
    turns = data.draw(st.lists(symmetries, min_size=count, max_size=count))
    model = build_ribbons(
        build_curves(count + 1, base, seed, is_rational), degrees, turns, is_rational
    )
    seams = find_seams(model.batches)
    inner = [(min(a, b), 2) for a, b in pairwise(degrees)]
    outer = [(degrees[0], 1), (degrees[-1], 1)] + [(1, 1)] * (2 * count)
    assert list_edges(seams) == sorted(inner + outer)
    mesh = build_mesh(model, resolution=(3, 4))
    check_sound(mesh)
    assert (find_topology(mesh).components, find_topology(mesh).euler) == (1, 1)


@pytest.mark.parametrize("degree", [2, 3, 5])
@pytest.mark.parametrize("is_triangle_first", [True, False])
def test_a_triangle_meets_a_grid_of_another_degree(degree: int, is_triangle_first: bool) -> None:
    """A quadratic triangle and a patch share an edge; they are in two batches."""
    rng = np.random.default_rng(degree)
    net = np.array([(j, k, 0.0) for _, j, k in triangles.keys(2)]) + rng.uniform(-0.2, 0.2, (6, 3))
    triangle = TrianglePatches(net[None])
    side = triangle.side(2)[0][0]
    edge = elevate_exactly((side, np.ones(3)), degree)[0] if degree > 2 else side
    # In the patch the edge has the opposite direction, so that both normals point up.
    patch = TensorPatches(np.stack([edge[::-1], edge[::-1] - (0, 2, 1)])[None])
    batches: tuple[Patches, ...] = (triangle, patch) if is_triangle_first else (patch, triangle)
    model = PatchModel("pair", batches, (Part("pair", 0, 2),))
    assert list_edges(find_seams(batches)).count((2, 2)) == 1
    for resolution in ((2, 2), (3, 5)):
        mesh = build_mesh(model, resolution=resolution)
        check_sound(mesh)
        assert (find_topology(mesh).components, find_topology(mesh).euler) == (1, 1)


@pytest.mark.parametrize("is_rational", [False, True])
@pytest.mark.parametrize("is_symmetric", [False, True])
def test_closed_edges_meet_in_either_direction(is_rational: bool, is_symmetric: bool) -> None:
    """A closed curve and the same curve in a higher degree, in equal or opposite direction."""
    points = np.array([[1.0, 0, 0], [1, 1.7, 0], [-2.3, 0.9, 0.2], [-1, -1.1, 0], [1, 0, 0]])
    weights = np.array([1.0, 0.7, 1.9, 0.8, 1.0]) if is_rational else np.ones(5)
    if is_symmetric:
        points[3], weights[3] = points[1] * (1, -1, 1), weights[1]
        points[2, 1:] = 0
    loop, raised_loop = (points, weights), elevate_exactly((points, weights), 6)
    for direction in (1, -1):
        rings = [
            (
                np.stack([net, translate(net, 0, 0, height)])[:, ::order],
                np.stack([ws, ws])[:, ::order],
            )
            for (net, ws), height, order in ((loop, -1, 1), (raised_loop, 1, direction))
        ]
        model = build_model(
            [net for net, _ in rings], [ws for _, ws in rings] if is_rational else None
        )
        seams = find_seams(model.batches)
        assert (4, 2) in list_edges(seams)
        mesh = build_mesh(model, resolution=(2, 8))
        check_sound(mesh)
        assert find_topology(mesh).boundary == 16


def test_nearly_equal_edges_are_not_joined() -> None:
    """A change of a point by 1e-9, or of a weight by 1e-9 of itself, makes a different edge."""
    (line,) = build_curves(1, 2, 3, is_rational=True)
    cubic, weights = elevate_exactly(line, 3)
    for shift, factor, is_shared in ((0.0, 1.0, True), (1e-9, 1.0, False), (0.0, 1 + 1e-9, False)):
        points, ws = cubic.copy(), weights.copy()
        points[1, 2] += shift
        ws[1] *= factor
        model = build_model(
            [
                np.stack([line[0], line[0] - (1, 0, 0)]),
                np.stack([points, translate(points, 1, 0, 0)]),
            ],
            [np.stack([line[1]] * 2), np.stack([ws] * 2)],
        )
        assert ((2, 2) in list_edges(find_seams(model.batches))) == is_shared


def test_joined_edges_are_within_the_stated_distance() -> None:
    """Compares samples of a rational edge, far from the origin, before and after raising.

    `SAME_CURVE` states the distance: ten times its value, relative to the largest coordinate.
    """
    largest_gap = 0.0
    for seed in range(20):
        (line,) = build_curves(1, 3, seed, is_rational=True)
        points = line[0] + 1000
        raised_line = elevate_exactly((points, line[1]), 7)
        meshes = [
            build_mesh(
                build_model([np.stack([p, p - (1, 0, 0)])], [np.stack([w, w])]), resolution=(1, 9)
            )
            for p, w in ((points, line[1]), raised_line)
        ]
        gap = meshes[0].positions[:10] - meshes[1].positions[:10]
        largest_gap = max(largest_gap, float(np.abs(gap).max()) / 1000)  # coordinates are near 1000
    assert largest_gap <= 10 * SAME_CURVE


def test_curves_of_different_sizes_are_not_joined() -> None:
    """A closed curve and a larger copy from the same point; two arches and a very high arch.

    The high arch must not make the tolerance larger for the others, which differ by 1e-9.
    """
    loop = np.array([[0.0, 0, 0], [1, 2, 0], [-1, 2, 1], [0, 0, 0]])
    larger_loop = elevate_exactly((2 * loop, np.ones(4)), 4)[0]
    model = build_model([np.stack([net, translate(net, 0, 0, 9)]) for net in (loop, larger_loop)])
    assert (3, 2) not in list_edges(find_seams(model.batches))
    arch = np.array([[0.0, 0, 0], [1, 1, 0], [2, 0, 0]])
    near_arch = elevate_exactly((arch * (1, 1 + 1e-9, 1), np.ones(3)), 3)[0]
    high_arch = elevate_exactly((arch * (1, 1e15, 1), np.ones(3)), 4)[0]
    model = build_model(
        [np.stack([net, translate(net, 0, 0, 9)]) for net in (arch, near_arch, high_arch)]
    )
    assert [line for line in list_edges(find_seams(model.batches)) if line[0] > 1] == [
        (2, 1), (2, 1), (3, 1), (3, 1), (4, 1), (4, 1),
    ]  # fmt: skip
