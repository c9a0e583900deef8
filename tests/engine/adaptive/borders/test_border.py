"""Borders: the division of a side depends on that side alone."""

from math import inf, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.engine.bounds.faces import SPAN
from service.engine.bounds.goal import Goal, View
from service.errors import InvalidRequest, TooLarge
from service.surface.bspline import BsplineSurface
from service.surface.knots import Knots
from tests.engine.adaptive.bordering import build_border, check_border
from tests.strategies import (
    Array,
    apply_symmetry,
    build_model,
    degenerate_nets,
    nets,
    split_models,
    symmetries,
    translate,
    weighted_nets,
)
from tools.examples import lower_patches

tolerances = st.sampled_from([1.0, 0.1, 1e-2])


@given(weighted_nets(), tolerances)
def test_vertices_lie_on_the_sides_and_chords_near_them(
    net: tuple[Array, Array | None], tolerance: float
) -> None:
    """Checked at exact points of polynomial and rational curves."""
    points, weights = net
    model = build_model([points], None if weights is None else [weights])
    check_border(build_border(model, Goal(tolerance)), tolerance)


@given(degenerate_nets(), tolerances)
def test_degenerate_patches_have_sound_borders(net: Array, tolerance: float) -> None:
    """Patches that are points or lines, or have coinciding sides, or sides that return along
    themselves."""
    check_border(build_border([net], Goal(tolerance)), tolerance)


@given(split_models(oriented=False), tolerances, st.permutations(range(4)))
def test_neighbours_share_vertices_and_order_does_not_matter(
    split: tuple[Array, list[Array]], tolerance: float, order: list[int]
) -> None:
    """The 16 sides of four quarters of a patch are 12 edges: four of them have two sides.

    Vertices have the same bits alone, together and in any order.
    """
    _, quarters = split
    result = build_border(quarters, Goal(tolerance))
    check_border(result, tolerance)
    edges = {frozenset(result.find_side(face, side)[1]) for face in range(4) for side in range(4)}
    assert len(edges) == 12
    bits = result.list_bits()
    reordered = build_border([quarters[k] for k in order], Goal(tolerance)).list_bits()
    for row, k in enumerate(order):
        assert reordered[4 * row : 4 * row + 4] == bits[4 * k : 4 * k + 4]
        alone = build_border([quarters[k]], Goal(tolerance)).list_bits()
        assert alone == bits[4 * k : 4 * k + 4]


def build_spline(seed: int, rows: int, columns: int, rational: bool) -> tuple[Array, Array | None]:
    """A random control net and its weights, or None if it is not rational."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.arange(float(rows)), np.arange(float(columns)), indexing="ij")
    net = np.stack([u, v, rng.uniform(-1, 1, u.shape)], axis=-1)
    return net, rng.uniform(0.3, 3, u.shape) if rational else None


@pytest.mark.slow
@given(st.integers(0, 99), st.integers(4, 9), st.booleans(), symmetries, st.sampled_from([2, 3]))
@settings(max_examples=12)
def test_splines_that_meet_agree_without_knowing_each_other(
    seed: int, columns: int, rational: bool, symmetry: int, degree: int
) -> None:
    """Two splines in separate requests: one shares the last row of the other, in another
    orientation."""
    net, weights = build_spline(seed, 5, columns, rational)
    net_2, weights_2 = build_spline(seed + 100, 6, columns, rational)
    net_2[0] = net[-1]
    if weights is not None and weights_2 is not None:
        weights_2[0] = weights[-1]
        weights_2 = apply_symmetry(weights_2, symmetry)
    one = BsplineSurface(net, (degree, 3), weights=weights)
    swapped = symmetry & 4  # u and v are swapped
    two = BsplineSurface(
        apply_symmetry(net_2, symmetry), (3, degree) if swapped else (degree, 3), weights=weights_2
    )
    for tolerance in (3.0, 0.1, 1e-2):
        result = build_border(one.lower(), Goal(tolerance))
        check_border(result, tolerance)
        side = result.find_side(0, 1)[2]  # u = 1: the shared row is the last one
        bits = build_border(two.lower(), Goal(tolerance)).list_bits()
        assert min(side.tobytes(), side[::-1].tobytes()) in bits


def test_flat_spans_are_merged_along_the_border() -> None:
    """A plane of 20 × 20 spans has four vertices; one raised point on the border adds few."""
    u, v = np.meshgrid(np.arange(23.0), np.arange(23.0), indexing="ij")
    net = np.stack([u, v, 0 * u], axis=-1)
    assert len(build_border(BsplineSurface(net).lower(), Goal(0.1)).border.points) == 4
    net[0, 11, 2] = 1
    result = build_border(BsplineSurface(net).lower(), Goal(0.1))
    check_border(result, 0.1)
    assert [len(result.find_side(0, side)[0]) for side in (1, 2, 3)] == [2, 2, 2]
    # Flat spans far from the point add no vertices.
    at = np.array(result.find_side(0, 0)[0]) / SPAN
    assert 4 < len(at) < 16
    assert not ((at > 0) & (at < 5)).any()


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("spans", [1, 2, 3, 5])
def test_rings_have_three_divisions_however_coarse(periodic: bool, spans: int) -> None:
    """A closed side is not a point, and its vertices are different."""
    degree = 3
    count = max(spans, degree + 1) if periodic else spans + degree
    angle = 2 * pi * np.arange(count) / (count if periodic else count - 1)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    if not periodic:
        ring[-1] = ring[0]  # exactly
    net = np.stack([ring, translate(ring, 0, 0, 1)])
    knots: Knots = "periodic" if periodic else "clamped"
    model = BsplineSurface(net, (1, degree), ("clamped", knots)).lower()
    result = build_border(model, Goal(100.0))
    check_border(result, 100.0)
    for side in (0, 1):
        vertex = result.find_side(0, side)[1]
        assert vertex[0] == vertex[-1]
        assert len(set(vertex)) >= 3
    assert result.find_side(0, 2)[1] == result.find_side(0, 3)[1]


@pytest.mark.parametrize("thickness", [0.12, 0.2, 1.0])
def test_two_curves_between_two_corners_stay_two(thickness: float) -> None:
    """The upper and the lower curve of a wing's end stay apart at a tolerance above its
    thickness."""
    upper, lower = (
        np.array([[0.0, 0, 0], [0, 0, z], [0.5, 0, z], [1, 0, 0]])
        for z in (thickness, -0.7 * thickness)
    )
    wing = [np.stack([side, translate(side, 0, 3)]) for side in (upper, lower)]
    result = build_border(wing, Goal(10.0))
    check_border(result, 10.0)
    ends = [result.find_side(face, 0)[1] for face in range(2)]
    assert [len(vertex) for vertex in ends] == [3, 3]
    assert ends[0][1] != ends[1][1]
    assert [{vertex[0], vertex[-1]} for vertex in ends] == [{ends[0][0], ends[0][-1]}] * 2


@given(nets(), st.sampled_from([0.5, 0.05]))
def test_division_by_angles_ends(net: Array, angle: float) -> None:
    """Random sides, which may have cusps and loops."""
    check_border(build_border([net], Goal(0.5, angle)), 0.5)


@pytest.mark.parametrize("rational", [False, True])
def test_two_sided_goals_limit_distances_at_equal_parameters(rational: bool) -> None:
    """A straight side is its own chord, but its points are elsewhere than those of the chord at
    equal parameters. With `two_sided` their distance is at most twice the tolerance."""
    weights = np.array([[1.0, 1, 9, 1]] * 2) if rational else None
    line = np.array([[0.0, 0, 0], [0, 0, 0], [0, 1, 0], [0, 9, 0]])
    model = build_model(
        [np.stack([line, translate(line, 1)])], None if weights is None else [weights]
    )
    assert len(build_border(model, Goal(0.5)).find_side(0, 0)[0]) == 2
    result = build_border(model, Goal(0.5, two_sided=True))
    at, _, points = result.find_side(0, 0)
    check_border(result, 0.5)
    assert len(at) > 2
    for a, b, p, q in zip(at, at[1:], points, points[1:], strict=False):
        for k in range(9):
            t = (a + (b - a) * k / 8) / SPAN
            basis = np.array([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
            basis *= 1.0 if weights is None else weights[0]
            point = basis @ line / basis.sum()
            assert np.linalg.norm(point - (p + (q - p) * k / 8)) <= 1.0
    # Seven straight spans of increasing length: each is compared with 1/7 of the chord.
    net = np.stack([translate(np.array([[y * y, 0, 0] for y in range(8)]), 0, k) for k in range(2)])
    spline = BsplineSurface(net, (1, 1)).lower()
    assert len(build_border(spline, Goal(5.0)).find_side(0, 0)[0]) == 2
    assert len(build_border(spline, Goal(5.0, two_sided=True)).find_side(0, 0)[0]) == 3


def test_tolerances_below_the_rounding_are_refused() -> None:
    """The limit also holds for a plane with straight sides, far from the origin."""
    net = np.array([[[0.0, 0, 0], [0, 1, 2]], [[1, 0, 0], [1, 1, 2]]])
    for model, tolerance in (
        (lower_patches("utah-teapot"), 1e-15),
        (build_model([net + 1e9]), 1e-8),
    ):
        with pytest.raises(InvalidRequest) as refused:
            build_border(model, Goal(tolerance))
        (issue,) = refused.value.issues
        assert issue.code == "tolerance_too_small"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("scale", "rational"),
    [(3e38, False), (3e38, True), (1e-30, False), (1e-30, True), (4e-321, False)],
)
def test_borders_of_huge_and_of_tiny_surfaces_are_divided(scale: float, rational: bool) -> None:
    """Coordinates from the largest that requests may have, that of float32, to subnormal numbers;
    quotients of weights of up to 1e8."""
    rng = np.random.default_rng(1)
    net = rng.uniform(-1, 1, (4, 6, 3)) * scale
    model = build_model([net], [10 ** rng.uniform(-8, 0, (4, 6))] if rational else None)
    view = View(np.array([2.0, 0, 0]) * scale, 1e-2, 0.01 * scale)
    for goal in (
        Goal(0.1 * scale),
        Goal(0.1 * scale, 0.3, two_sided=True),
        Goal(inf, view=view),
    ):
        result = build_border(model, goal)
        assert len(result.border.points) >= 4
        if scale > 1e-300:  # subnormal points are less precise
            check_border(result, 0.1 * scale)


def test_a_side_that_is_shared_in_part_is_divided_edge_by_edge() -> None:
    """A rolled sheet whose ends meet along half their length."""
    angle = np.linspace(0, 2 * pi, 7)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    ring[-1] = ring[0]
    net = np.stack([translate(ring, 0, 0, k) for k in range(5)], axis=1)
    whole = build_border(BsplineSurface(net, (3, 1)).lower(), Goal(0.1))
    assert len(whole.find_side(0, 0)[0]) == 2
    net[-1, 3:] += (0, 0.5, 0)
    result = build_border(BsplineSurface(net, (3, 1)).lower(), Goal(0.1))
    check_border(result, 0.1)
    sides = [result.find_side(0, side) for side in (0, 1)]
    for at, _, _ in sides:
        assert at == [k * SPAN for k in range(5)]
    assert sides[0][1][:3] == sides[1][1][:3]
    assert not set(sides[0][1][3:]) & set(sides[1][1][3:])


def test_too_many_triangles_are_refused_as_soon_as_sides_need_them() -> None:
    """A number of triangles that is enough for the mesh is never refused because of its sides."""
    with pytest.raises(TooLarge) as refused:
        build_border(lower_patches("utah-teapot"), Goal(1e-9), 1000)
    assert refused.value.issues[0].code == "too_many_triangles"
    square = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])
    assert len(build_border([square], Goal(1e-9), 2).border.points) == 4
